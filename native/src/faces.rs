// SPDX-License-Identifier: GPL-3.0-or-later
//! What is flat about each triangle, which coverage knows without a ray.

use std::f64::consts::PI;

use rayon::prelude::*;

use crate::InvalidInput;
use crate::bvh::NODE_FLOATS;
use crate::coverage::TOUCHES;
use crate::edges::{Edge, Edges};
use crate::lying::{Bodies, Shape, Triangles};
use crate::own::SMALL;
use crate::refit::skipped_by;
use crate::solid::{Pieces, solid};
use crate::vector::{cross64, dot64, minus64};

/// A corner so far from a triangle's plane at most, over how far from its edge, is in it.
const FLAT: f64 = 1.0e-3;

/// What is no higher above a triangle may lie on it: a fiftieth, as coverage takes for a touch, of discs a quarter wide,
/// and wider ones are of no use [scene units].
const LYING: f64 = 5.0e-3;
/// Where a disc is so narrow that a triangle or quad is small beside it, what lies on that is not looked for, for that
/// takes long, and most of the discs that it is not small beside are narrower than pixels commonly are [scene units].
const NARROW: f64 = 0.02;
/// Bits of a face's code: something lies on its front, and on its back.
pub(crate) const LIES_ON: [usize; 2] = [16, 32];

/// Of a triangle (glsl/lib/own.glsl reads it): the fourth corner of the convex quad that it makes with a neighbour in
/// its plane, where it has one; and a code: 1 plus what [`crate::solid`] tells of it; 4 times 1 plus the number of the
/// edge that is the quad's diagonal, or 0 where there is none; 16 if something lies on the front of either, from where
/// corners go round to the left ([`crate::lying`]), and 32 if it does on the back.
pub type Face = [f32; 4];

/// The faces of triangles, whose tree has these nodes and this order. `materials` of the triangles: those of one quad
/// wear one.
///
/// # Errors
/// An index outside the vertices; as many surfaces or materials as triangles were not given; an order of other
/// triangles; references of `nodes` out of range or not to a later node.
pub fn faces(
    nodes: &[f32],
    order: &[i32],
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
    let (nodes, rest) = nodes.as_chunks::<NODE_FLOATS>();
    if nodes.is_empty() || !rest.is_empty() {
        return Err(InvalidInput(format!("nodes: expected rows of {NODE_FLOATS} floats, at least one")));
    }
    skipped_by(order, triangles.len())?;
    let mut pieces = Pieces::of_edges(vertices.len(), &edges);
    let solid = solid(vertices, &edges, &mut pieces);
    let partners = partners(vertices, &edges, surfaces, materials);
    let shape_of = |triangle: u32| Shape::of(vertices, &edges.corners[triangle as usize]);
    let bodies = Bodies::new(vertices, &edges, pieces);
    let all = Triangles { nodes, order, vertices, corners: &edges.corners, bodies: &bodies };
    let lain_on = (0..triangles.len()).into_par_iter().map_init(Vec::new, |stack, triangle| {
        let (shape, partner) = (shape_of(triangle as u32), partners[triangle].as_ref());
        let area = shape.area + partner.map_or(0.0, |partner| shape_of(partner.triangle).area);
        let widest = (0.5 * area / (f64::from(SMALL) * PI)).sqrt();
        let most = if widest < NARROW { 0.0 } else { LYING.min(f64::from(TOUCHES) * widest) };
        all.lies_on(&shape, most, stack)
    });
    let lain_on = lain_on.collect::<Result<Vec<_>, _>>()?;
    let face = |triangle: usize| {
        let (mut code, mut lain_on_either) = ((solid[triangle] + 1) as usize, lain_on[triangle]);
        let mut corner = [0.0; 3];
        if let Some(Partner { triangle: partner, corners: [own, others] }) = partners[triangle] {
            corner = vertices[edges.corners[partner as usize][(others as usize + 2) % 3] as usize];
            code += 4 * (usize::from(own) + 1);
            lain_on_either = std::array::from_fn(|k| lain_on_either[k] || lain_on[partner as usize][k]);
        }
        code += (0..2).filter(|&k| lain_on_either[k]).map(|k| LIES_ON[k]).sum::<usize>();
        let [x, y, z] = corner;
        [x, y, z, code as f32]
    };
    Ok((0..triangles.len()).map(face).collect())
}

/// Of each triangle the largest neighbour that makes a quad with it.
fn partners(
    vertices: &[[f32; 3]],
    edges: &Edges,
    surfaces: &[i32],
    materials: &[i32],
) -> Vec<Option<Partner>> {
    let shape_of = |triangle: u32| Shape::of(vertices, &edges.corners[triangle as usize]);
    let mut partners: Vec<Option<Partner>> = vec![None; edges.corners.len()];
    for passed in edges.passed() {
        let &[one, other] = passed else { continue };
        let [a, b] = [one, other].map(|edge| edge.triangle as usize);
        if surfaces[a] != surfaces[b] || materials[a] != materials[b] {
            continue;
        }
        for [own, next] in [[one, other], [other, one]] {
            let (shapes, partner) =
                ([own, next].map(|edge| shape_of(edge.triangle)), &mut partners[own.triangle as usize]);
            let is_larger =
                partner.as_ref().is_none_or(|partner| shapes[1].area > shape_of(partner.triangle).area);
            if is_larger && shapes[0].makes_quad(own, &shapes[1], next) {
                *partner = Some(Partner { triangle: next.triangle, corners: [own.corner, next.corner] });
            }
        }
    }
    partners
}

/// A neighbour, and which corner of a triangle and of it the edge between them begins at.
#[derive(Clone)]
struct Partner {
    triangle: u32,
    corners: [u8; 2],
}

impl Shape {
    /// Whether a neighbour beyond an edge lies in the plane, and is a convex quad with this. False of what has no
    /// area.
    fn makes_quad(&self, edge: Edge, other: &Shape, others: Edge) -> bool {
        let [q, r, p] = [0, 1, 2].map(|k| self.corners[(edge.corner as usize + k) % 3]);
        let s = other.corners[(others.corner as usize + 2) % 3];
        let height = dot64(minus64(s, q), self.normal).abs();
        let turn = |a, b, c| dot64(cross64(minus64(b, a), minus64(c, b)), self.normal);
        let away = other.area / dot64(minus64(r, q), minus64(r, q)).sqrt();
        edge.is_upwards() != others.is_upwards()
            && dot64(self.normal, other.normal) > 0.0
            && height <= FLAT * away
            && turn(p, q, s) > 0.0
            && turn(s, r, p) > 0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh;

    /// A square's corners, and two below.
    const VERTICES: [[f32; 3]; 6] =
        [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, 0.0], [1.0, 0.0, -1.0], [1.0, 1.0, -1.0]];

    const NO_QUAD: Face = [0.0, 0.0, 0.0, 1.0];

    /// Of triangles in their tree.
    fn in_tree(
        vertices: &[[f32; 3]],
        triangles: &[[i32; 3]],
        surfaces: &[i32],
        materials: &[i32],
    ) -> Result<Vec<Face>, InvalidInput> {
        let tree = bvh::build(vertices, triangles)?;
        let order: Vec<i32> = tree.order.iter().map(|&triangle| triangle as i32).collect();
        faces(&tree.nodes, &order, vertices, triangles, surfaces, materials)
    }

    fn of(triangles: &[[i32; 3]]) -> Vec<Face> {
        in_tree(&VERTICES, triangles, &vec![0; triangles.len()], &vec![0; triangles.len()]).unwrap()
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
        assert_eq!(in_tree(&VERTICES, &board, &[0, 0], &[0, 1]).unwrap(), [NO_QUAD; 2]);
        assert_eq!(in_tree(&VERTICES, &board, &[0, 1], &[0, 0]).unwrap(), [NO_QUAD; 2]);
        assert_eq!(of(&[[0, 1, 2], [3, 1, 2]]), [NO_QUAD; 2]);
    }

    #[test]
    fn of_two_neighbours_the_larger_is_taken() {
        let mut vertices = VERTICES.to_vec();
        vertices.extend([[-0.5, 0.5, 0.0]]);
        let found = in_tree(&vertices, &[[0, 1, 2], [3, 2, 1], [0, 2, 6]], &[0; 3], &[0; 3]).unwrap();
        assert_eq!(found[0], [1.0, 1.0, 0.0, 9.0]);
        assert_eq!(found[2], [1.0, 0.0, 0.0, 5.0]);
    }

    #[test]
    fn a_dart_is_no_quad() {
        let mut vertices = VERTICES;
        vertices[3] = [-0.5, 1.0, 0.0];
        vertices[2] = [0.0, 0.1, 0.0];
        let found = in_tree(&vertices, &[[0, 1, 2], [3, 2, 1]], &[0; 2], &[0; 2]).unwrap();
        assert_eq!(found, [NO_QUAD; 2]);
    }

    /// A sheet above one of a quad's triangles, and below it.
    #[test]
    fn what_lies_on_a_quad() {
        let mut vertices = VERTICES.to_vec();
        vertices.extend([[0.1, 0.1, 0.001], [0.2, 0.1, 0.001], [0.1, 0.2, 0.001]]);
        let triangles = [[0, 1, 2], [3, 2, 1], [6, 7, 8]];
        let found = in_tree(&vertices, &triangles, &[0; 3], &[0; 3]).unwrap();
        assert_eq!(found.iter().map(|face| face[3]).collect::<Vec<_>>(), [25.0, 25.0, 33.0]);
    }

    #[test]
    fn bad_input() {
        assert!(in_tree(&VERTICES, &[[0, 1, 6]], &[0], &[0]).is_err());
        assert!(in_tree(&VERTICES, &[[0, 1, 2]], &[], &[0]).is_err());
        assert!(in_tree(&VERTICES, &[[0, 1, 2]], &[0], &[]).is_err());
        assert!(in_tree(&[], &[], &[], &[]).unwrap().is_empty());
        assert_eq!(of(&[[1, 1, 2]]), [NO_QUAD]);
        let tree = bvh::build(&VERTICES, &[[0, 1, 2]]).unwrap();
        let mut beyond = tree.nodes.clone();
        (beyond[6], beyond[7]) = (1.0, 2.0); // a leaf's height, and more triangles than there are
        for (nodes, order) in [(&tree.nodes[..8], [0]), (&tree.nodes[..], [1]), (&beyond[..], [0])] {
            assert!(faces(nodes, &order, &VERTICES, &[[0, 1, 2]], &[0], &[0]).is_err());
        }
    }
}
