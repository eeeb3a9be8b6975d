// SPDX-License-Identifier: GPL-3.0-or-later
//! Which triangles bound a solid, and on which side it is: no light of the outside falls on what is in it.

use rayon::prelude::*;

use crate::InvalidInput;
use crate::bvh::check_indices;

/// Bits of a vertex's number in an edge's key, of which the lowest bit is the edge's direction.
const BITS: u32 = 31;

/// For each triangle 0 if the piece of its surface that it belongs to is not closed or does not face one way: every
/// edge is passed as often one way as the other. Else 1 if its front is outside, where its corners go round to the
/// left, or -1 if its back is. Corners of a surface that are in one place are one, whatever vertices they are.
///
/// # Errors
/// An index outside the vertices; as many surfaces as triangles were not given.
pub fn solid(
    vertices: &[[f32; 3]],
    triangles: &[[i32; 3]],
    surfaces: &[i32],
) -> Result<Vec<i8>, InvalidInput> {
    if surfaces.len() != triangles.len() {
        let (n, m) = (surfaces.len(), triangles.len());
        return Err(InvalidInput(format!("surfaces has {n} numbers, but there are {m} triangles")));
    }
    check_indices(triangles, vertices.len())?;
    let places = places(vertices, triangles, surfaces);
    let corners: Vec<[u32; 3]> =
        triangles.iter().map(|triangle| triangle.map(|vertex| places[vertex as usize])).collect();
    let mut pieces = Pieces::new(vertices.len());
    for [a, b, c] in &corners {
        pieces.join(*a, *b);
        pieces.join(*b, *c);
    }
    let mut edges: Vec<u64> = corners
        .iter()
        .filter(|[a, b, c]| a != b && b != c && c != a)
        .flat_map(|&[a, b, c]| [key_of(a, b), key_of(b, c), key_of(c, a)])
        .collect();
    edges.par_sort_unstable();
    let mut is_open = vec![false; vertices.len()];
    for edge in edges.chunk_by(|one, other| one >> 1 == other >> 1) {
        if 2 * edge.iter().filter(|key| *key & 1 == 1).count() != edge.len() {
            is_open[pieces.of((edge[0] >> (1 + BITS)) as u32) as usize] = true;
        }
    }
    let mut volumes = vec![0.0f64; vertices.len()];
    for corners in &corners {
        let piece = pieces.of(corners[0]) as usize;
        volumes[piece] += volume(corners.map(|vertex| vertices[vertex as usize]), vertices[piece]);
    }
    let solid_of = |piece: usize| {
        if is_open[piece] { 0 } else { (volumes[piece] > 0.0) as i8 - (volumes[piece] < 0.0) as i8 }
    };
    Ok(corners.iter().map(|[a, ..]| solid_of(pieces.of(*a) as usize)).collect())
}

/// Of each vertex the one that stands for all in its place on its surface.
fn places(vertices: &[[f32; 3]], triangles: &[[i32; 3]], surfaces: &[i32]) -> Vec<u32> {
    let mut owner = vec![-1i32; vertices.len()];
    for (triangle, &surface) in triangles.iter().zip(surfaces) {
        triangle.iter().for_each(|&vertex| owner[vertex as usize] = surface);
    }
    let key = |vertex: u32| {
        let [x, y, z] = vertices[vertex as usize].map(|x| (x + 0.0).to_bits()); // -0 is 0
        (owner[vertex as usize], x, y, z)
    };
    let mut order: Vec<u32> = (0..vertices.len() as u32).collect();
    order.par_sort_unstable_by_key(|&vertex| (key(vertex), vertex));
    let mut places = vec![0; vertices.len()];
    for same in order.chunk_by(|&one, &other| key(one) == key(other)) {
        same.iter().for_each(|&vertex| places[vertex as usize] = same[0]);
    }
    places
}

/// Six times that between a triangle and a place; below zero where its back is away from it.
fn volume(corners: [[f32; 3]; 3], from: [f32; 3]) -> f64 {
    let [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] =
        corners.map(|corner| std::array::from_fn(|k| f64::from(corner[k]) - f64::from(from[k])));
    ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
}

/// An edge without its direction, but for the lowest bit.
fn key_of(from: u32, to: u32) -> u64 {
    let (low, high) = (u64::from(from.min(to)), u64::from(from.max(to)));
    low << (1 + BITS) | high << 1 | u64::from(from < to)
}

/// Vertices that triangles join, as a forest.
struct Pieces(Vec<u32>);

impl Pieces {
    fn new(count: usize) -> Pieces {
        Pieces((0..count as u32).collect())
    }

    /// The vertex that stands for a vertex's piece.
    fn of(&mut self, mut vertex: u32) -> u32 {
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

    fn of(faces: &[[i32; 3]]) -> Vec<i8> {
        solid(&CORNERS, faces, &vec![0; faces.len()]).unwrap()
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
        assert_eq!(solid(&vertices, &triangles, &[0, 0, 0, 0, 1]).unwrap(), [1, 1, 1, 1, 0]);
        assert_eq!(solid(&vertices, &triangles, &[0; 5]).unwrap(), [0; 5]);
    }

    #[test]
    fn bad_input() {
        assert!(solid(&CORNERS, &[[0, 1, 4]], &[0]).is_err());
        assert!(solid(&CORNERS, &[[0, -1, 2]], &[0]).is_err());
        assert!(solid(&CORNERS, &FACES, &[0]).is_err());
        assert!(solid(&[], &[], &[]).unwrap().is_empty());
        assert_eq!(of(&[[1, 1, 2]]), [0]); // no volume
    }
}
