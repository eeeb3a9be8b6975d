// SPDX-License-Identifier: GPL-3.0-or-later
//! What is flat about each triangle, which coverage knows without a ray.

use crate::InvalidInput;
use crate::edges::{Edge, Edges};
use crate::solid::solid;

/// A corner so far from a triangle's plane at most, over how far from its edge, is in it.
const FLAT: f64 = 1.0e-3;

/// Of a triangle (glsl/lib/own.glsl reads it): the fourth corner of the convex quad that it makes with a neighbour in
/// its plane, where it has one; and a code: 1 plus what [`crate::solid`] tells of it, and 4 times 1 plus the number of
/// the edge that is the quad's diagonal, or 0 where there is none.
pub type Face = [f32; 4];

/// The faces of triangles. `materials` of the triangles: those of one quad wear one.
///
/// # Errors
/// An index outside the vertices; as many surfaces or materials as triangles were not given.
pub fn faces(
    vertices: &[[f32; 3]],
    triangles: &[[i32; 3]],
    surfaces: &[i32],
    materials: &[i32],
) -> Result<Vec<Face>, InvalidInput> {
    if materials.len() != triangles.len() {
        let (n, m) = (materials.len(), triangles.len());
        return Err(InvalidInput(format!("materials has {n} numbers, but there are {m} triangles")));
    }
    let edges = Edges::of(vertices, triangles, surfaces)?;
    let sides = solid(vertices, &edges);
    let shape = |triangle: u32| Shape::of(vertices, &edges.corners[triangle as usize]);
    // Of each triangle the largest neighbour that makes a quad with it, and the edge between them.
    let mut partners: Vec<Option<Partner>> = vec![None; triangles.len()];
    for passed in edges.passed() {
        let &[one, other] = passed else { continue };
        let [a, b] = [one, other].map(|edge| edge.triangle as usize);
        if surfaces[a] != surfaces[b] || materials[a] != materials[b] {
            continue;
        }
        for [own, next] in [[one, other], [other, one]] {
            let (shapes, partner) =
                ([own, next].map(|edge| shape(edge.triangle)), &mut partners[own.triangle as usize]);
            let is_larger =
                partner.as_ref().is_none_or(|partner| shapes[1].area > shape(partner.triangle).area);
            if is_larger && shapes[0].makes_quad(own, &shapes[1], next) {
                *partner = Some(Partner { triangle: next.triangle, corners: [own.corner, next.corner] });
            }
        }
    }
    let face = |triangle: usize| {
        let solid = f32::from(sides[triangle] + 1);
        let Some(partner) = &partners[triangle] else { return [0.0, 0.0, 0.0, solid] };
        let [corner, others] = partner.corners;
        let fourth = edges.corners[partner.triangle as usize][(others as usize + 2) % 3];
        let [x, y, z] = vertices[fourth as usize];
        [x, y, z, solid + 4.0 * f32::from(corner + 1)]
    };
    Ok((0..triangles.len()).map(face).collect())
}

/// A neighbour, and which corner of a triangle and of it the edge between them begins at.
#[derive(Clone)]
struct Partner {
    triangle: u32,
    corners: [u8; 2],
}

/// A triangle's corners, unit normal and doubled area.
struct Shape {
    corners: [[f64; 3]; 3],
    normal: [f64; 3],
    area: f64,
}

impl Shape {
    fn of(vertices: &[[f32; 3]], corners: &[u32; 3]) -> Shape {
        let corners = corners.map(|vertex| vertices[vertex as usize].map(f64::from));
        let [a, b, c] = corners;
        let normal = cross(minus(b, a), minus(c, a));
        let area = dot(normal, normal).sqrt();
        Shape { corners, normal: normal.map(|x| x / area), area }
    }

    /// Whether a neighbour beyond an edge lies in the plane, and is a convex quad with this. False of what has no
    /// area.
    fn makes_quad(&self, edge: Edge, other: &Shape, others: Edge) -> bool {
        let [q, r, p] = [0, 1, 2].map(|k| self.corners[(edge.corner as usize + k) % 3]);
        let s = other.corners[(others.corner as usize + 2) % 3];
        let height = dot(minus(s, q), self.normal).abs();
        let turn = |a, b, c| dot(cross(minus(b, a), minus(c, b)), self.normal);
        let away = other.area / dot(minus(r, q), minus(r, q)).sqrt();
        edge.is_upwards() != others.is_upwards()
            && dot(self.normal, other.normal) > 0.0
            && height <= FLAT * away
            && turn(p, q, s) > 0.0
            && turn(s, r, p) > 0.0
    }
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| a[k] - b[k])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A square's corners, and two below.
    const VERTICES: [[f32; 3]; 6] =
        [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, 0.0, -1.0], [1.0, 1.0, -1.0]];

    const NO_QUAD: Face = [0.0, 0.0, 0.0, 1.0];

    fn of(triangles: &[[i32; 3]]) -> Vec<Face> {
        faces(&VERTICES, triangles, &vec![0; triangles.len()], &vec![0; triangles.len()]).unwrap()
    }

    #[test]
    fn two_triangles_make_a_quad() {
        assert_eq!(of(&[[0, 1, 2], [3, 2, 1]]), [[1.0, 1.0, 0.0, 9.0], [0.0, 0.0, 0.0, 9.0]]);
        assert_eq!(of(&[[0, 1, 2]]), [NO_QUAD]);
    }

    /// A step; boards of two materials or surfaces, or of which one faces the other way.
    #[test]
    fn what_makes_no_quad() {
        assert_eq!(of(&[[0, 1, 2], [1, 4, 2]]), [NO_QUAD; 2]);
        let board = [[0, 1, 2], [3, 2, 1]];
        assert_eq!(faces(&VERTICES, &board, &[0, 0], &[0, 1]).unwrap(), [NO_QUAD; 2]);
        assert_eq!(faces(&VERTICES, &board, &[0, 1], &[0, 0]).unwrap(), [NO_QUAD; 2]);
        assert_eq!(of(&[[0, 1, 2], [3, 1, 2]]), [NO_QUAD; 2]);
    }

    #[test]
    fn of_two_neighbours_the_larger_is_taken() {
        let mut vertices = VERTICES.to_vec();
        vertices.extend([[-0.5, 0.5, 0.0]]);
        let found = faces(&vertices, &[[0, 1, 2], [3, 2, 1], [0, 2, 6]], &[0; 3], &[0; 3]).unwrap();
        assert_eq!(found[0], [1.0, 1.0, 0.0, 9.0]);
        assert_eq!(found[2], [1.0, 0.0, 0.0, 5.0]);
    }

    #[test]
    fn a_dart_is_no_quad() {
        let mut vertices = VERTICES;
        vertices[3] = [-0.5, 1.0, 0.0];
        vertices[2] = [0.0, 0.1, 0.0];
        let found = faces(&vertices, &[[0, 1, 2], [3, 2, 1]], &[0; 2], &[0; 2]).unwrap();
        assert_eq!(found, [NO_QUAD; 2]);
    }

    #[test]
    fn bad_input() {
        assert!(faces(&VERTICES, &[[0, 1, 6]], &[0], &[0]).is_err());
        assert!(faces(&VERTICES, &[[0, 1, 2]], &[], &[0]).is_err());
        assert!(faces(&VERTICES, &[[0, 1, 2]], &[0], &[]).is_err());
        assert!(faces(&[], &[], &[], &[]).unwrap().is_empty());
        assert_eq!(of(&[[1, 1, 2]]), [NO_QUAD]);
    }
}
