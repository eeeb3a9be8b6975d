// SPDX-License-Identifier: GPL-3.0-or-later
//! Which triangles bound a solid, and on which side it is: no light of the outside falls on what is in it.

use crate::edges::Edges;

/// For each triangle 0 if the piece of its surface that it belongs to is not closed or does not face one way: every
/// edge is passed as often one way as the other. Else 1 if its front is outside, where its corners go round to the
/// left, or -1 if its back is. Corners of a surface that are in one place are one, whatever vertices they are.
pub(crate) fn solid(vertices: &[[f32; 3]], edges: &Edges, pieces: &mut Pieces) -> Vec<i8> {
    let mut is_open = vec![false; vertices.len()];
    for passed in edges.passed() {
        if 2 * passed.iter().filter(|edge| edge.is_upwards()).count() != passed.len() {
            is_open[pieces.of(passed[0].vertex()) as usize] = true;
        }
    }
    let mut volumes = vec![0.0f64; vertices.len()];
    for corners in &edges.corners {
        let piece = pieces.of(corners[0]) as usize;
        volumes[piece] += volume(corners.map(|vertex| vertices[vertex as usize]), vertices[piece]);
    }
    let solid_of = |piece: usize| {
        if is_open[piece] { 0 } else { (volumes[piece] > 0.0) as i8 - (volumes[piece] < 0.0) as i8 }
    };
    edges.corners.iter().map(|[a, ..]| solid_of(pieces.of(*a) as usize)).collect()
}

/// Six times that between a triangle and a place; below zero where its back is away from it.
fn volume(corners: [[f32; 3]; 3], from: [f32; 3]) -> f64 {
    let [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] =
        corners.map(|corner| std::array::from_fn(|k| f64::from(corner[k]) - f64::from(from[k])));
    ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
}

/// Vertices that triangles join, as a forest.
pub(crate) struct Pieces(Vec<u32>);

impl Pieces {
    /// Those of so many vertices.
    pub(crate) fn of_edges(vertices: usize, edges: &Edges) -> Pieces {
        let mut pieces = Pieces((0..vertices as u32).collect());
        for [a, b, c] in &edges.corners {
            pieces.join(*a, *b);
            pieces.join(*b, *c);
        }
        pieces
    }

    /// The vertex that stands for a vertex's piece.
    pub(crate) fn of(&mut self, mut vertex: u32) -> u32 {
        while self.0[vertex as usize] != vertex {
            let next = self.0[vertex as usize];
            self.0[vertex as usize] = self.0[next as usize];
            vertex = self.0[vertex as usize];
        }
        vertex
    }

    fn join(&mut self, one: u32, other: u32) {
        let (one, other) = (self.of(one), self.of(other));
        self.0[one.max(other) as usize] = one.min(other);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CORNERS: [[f32; 3]; 4] = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    const FACES: [[i32; 3]; 4] = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

    fn solid_of(vertices: &[[f32; 3]], faces: &[[i32; 3]], surfaces: &[i32]) -> Vec<i8> {
        let edges = Edges::of(vertices, faces, surfaces).unwrap();
        solid(vertices, &edges, &mut Pieces::of_edges(vertices.len(), &edges))
    }

    fn of(faces: &[[i32; 3]]) -> Vec<i8> {
        solid_of(&CORNERS, faces, &vec![0; faces.len()])
    }

    #[test]
    fn a_tetrahedron_is_one_and_knows_its_outside() {
        assert_eq!(of(&FACES), [1; 4]);
        assert_eq!(of(&FACES.map(|[a, b, c]| [a, c, b])), [-1; 4]);
    }

    #[test]
    fn what_has_a_hole_or_a_turned_face_is_none() {
        assert_eq!(of(&FACES[1..]), [0; 3]);
        let [a, b, c] = FACES[0];
        assert_eq!(of(&[[a, c, b], FACES[1], FACES[2], FACES[3]]), [0; 4]);
    }

    /// As files for games have it: a vertex for each corner; beside a sheet that is as near as it can be.
    #[test]
    fn corners_in_one_place_are_one_of_a_surface() {
        let mut vertices: Vec<[f32; 3]> = FACES
            .iter()
            .flatten()
            .map(|&at| CORNERS[at as usize].map(|x| if x == 0.0 { -x } else { x }))
            .collect();
        vertices.extend([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, -1.0, 0.0]]);
        let triangles: Vec<[i32; 3]> = (0..5).map(|at| [3 * at, 3 * at + 1, 3 * at + 2]).collect();
        assert_eq!(solid_of(&vertices, &triangles, &[0, 0, 0, 0, 1]), [1, 1, 1, 1, 0]);
        assert_eq!(solid_of(&vertices, &triangles, &[0; 5]), [0; 5]);
    }

    #[test]
    fn bad_input() {
        assert!(Edges::of(&CORNERS, &[[0, 1, 4]], &[0]).is_err());
        assert!(Edges::of(&CORNERS, &[[0, -1, 2]], &[0]).is_err());
        assert!(Edges::of(&CORNERS, &FACES, &[0]).is_err());
        assert!(solid_of(&[], &[], &[]).is_empty());
        assert_eq!(of(&[[1, 1, 2]]), [0]); // no volume
    }
}
