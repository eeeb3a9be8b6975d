// SPDX-License-Identifier: GPL-3.0-or-later
//! Which triangles something lies on, as a rug on a floor or a sheet on a wall: coverage then can't know without a ray
//! where light falls on them.

use rayon::prelude::*;

use crate::InvalidInput;
use crate::bvh::NODE_FLOATS;
use crate::edges::Edges;
use crate::solid::Pieces;
use crate::trace::child_of;
use crate::vector::{Vector64, cross64, dot64, minus64};

/// What is nearer to a triangle is one layer with it [scene units].
const LEAST: f64 = 4.0e-6;
/// An overlap of less than so much of the smaller of two triangles is a touch.
const TOUCH: f64 = 1.0e-3;

/// A triangle's corners, unit normal and doubled area.
pub(crate) struct Shape {
    pub(crate) corners: [Vector64; 3],
    pub(crate) normal: Vector64,
    pub(crate) area: f64,
}

impl Shape {
    pub(crate) fn of(vertices: &[[f32; 3]], corners: &[u32; 3]) -> Shape {
        let corners = corners.map(|vertex| vertices[vertex as usize].map(f64::from));
        let [a, b, c] = corners;
        let normal = cross64(minus64(b, a), minus64(c, a));
        let area = dot64(normal, normal).sqrt();
        Shape { corners, normal: normal.map(|x| x / area), area }
    }

    fn height(&self, place: Vector64) -> f64 {
        dot64(minus64(place, self.corners[0]), self.normal)
    }
}

/// The pieces that triangles join to, each with the vertices that it is of.
pub(crate) struct Sheets {
    /// Of each triangle where the vertices of its piece begin and end.
    ranges: Vec<(u32, u32)>,
    vertices: Vec<u32>,
}

impl Sheets {
    pub(crate) fn of(edges: &Edges, mut pieces: Pieces) -> Sheets {
        let mut vertices: Vec<(u32, u32)> =
            edges.corners.iter().flatten().map(|&vertex| (pieces.of(vertex), vertex)).collect();
        vertices.par_sort_unstable();
        vertices.dedup();
        let range = |&[corner, ..]: &[u32; 3]| {
            let piece = pieces.of(corner);
            let [begin, end] =
                [piece, piece + 1].map(|piece| vertices.partition_point(|&(other, _)| other < piece) as u32);
            (begin, end)
        };
        let ranges = edges.corners.iter().map(range).collect();
        Sheets { ranges, vertices: vertices.into_iter().map(|(_, vertex)| vertex).collect() }
    }

    /// Of a triangle's piece.
    fn vertices(&self, triangle: usize) -> &[u32] {
        let (begin, end) = self.ranges[triangle];
        &self.vertices[begin as usize..end as usize]
    }
}

/// Triangles, of which `corners` are indices into vertices, in the tree of [`crate::bvh::build`] or
/// [`crate::refit::refit`].
pub(crate) struct Triangles<'a> {
    pub(crate) nodes: &'a [[f32; NODE_FLOATS]],
    pub(crate) order: &'a [i32],
    pub(crate) vertices: &'a [[f32; 3]],
    pub(crate) corners: &'a [[u32; 3]],
    pub(crate) sheets: &'a Sheets,
}

impl Triangles<'_> {
    /// Whether something lies before a triangle, from where its corners go round to the left, and behind it: with all
    /// that it is joined to no higher than `most`, and over more than a touch. What rises higher cuts discs off. `stack`
    /// is for use.
    ///
    /// # Errors
    /// References of `nodes` out of range or not to a later node.
    pub(crate) fn lies_on(
        &self,
        shape: &Shape,
        most: f64,
        stack: &mut Vec<usize>,
    ) -> Result<[bool; 2], InvalidInput> {
        let mut found = [false; 2];
        if !(most > 2.0 * LEAST && shape.area > 0.0) {
            return Ok(found);
        }
        let along = |k: usize| shape.corners.map(|corner| corner[k]);
        let low: [f32; 3] =
            std::array::from_fn(|k| (along(k).into_iter().fold(f64::INFINITY, f64::min) - most) as f32);
        let high: [f32; 3] =
            std::array::from_fn(|k| (along(k).into_iter().fold(f64::NEG_INFINITY, f64::max) + most) as f32);
        stack.clear();
        stack.push(0);
        while let Some(row) = stack.pop() {
            let node = &self.nodes[row];
            for at in [0, 8] {
                let (box_low, box_high) = (&node[at..at + 3], &node[at + 4..at + 7]);
                if (0..3).any(|k| box_low[k] > high[k] || box_high[k] < low[k]) {
                    continue;
                }
                let both = |k: usize| (f64::from(box_low[k]), f64::from(box_high[k]));
                let middle = std::array::from_fn(|k| 0.5 * (both(k).0 + both(k).1));
                let reach: f64 = (0..3).map(|k| 0.5 * (both(k).1 - both(k).0) * shape.normal[k].abs()).sum();
                let height = shape.height(middle).abs();
                if height - reach > most || height + reach < LEAST {
                    continue;
                }
                let Some((first, count)) = child_of(row, at, node, self.nodes.len(), self.order.len())?
                else {
                    continue;
                };
                if count == 0 {
                    stack.push(first);
                }
                for &triangle in &self.order[first..first + count] {
                    for (found, side) in found.iter_mut().zip([1.0, -1.0]) {
                        *found = *found || self.lies(triangle as usize, shape, side, most);
                    }
                }
                if found == [true; 2] {
                    return Ok(found);
                }
            }
        }
        Ok(found)
    }

    /// Whether a triangle lies on one side of another, 1 or -1.
    fn lies(&self, triangle: usize, on: &Shape, side: f64, most: f64) -> bool {
        let place = |vertex: &u32| self.vertices[*vertex as usize].map(f64::from);
        let height = |vertex: &u32| side * on.height(place(vertex));
        if self.corners[triangle].iter().all(|vertex| height(vertex) < LEAST) {
            return false;
        }
        let mut left = self.corners[triangle].iter().map(place).collect::<Vec<_>>();
        for k in 0..3 {
            let [a, b] = [on.corners[k], on.corners[(k + 1) % 3]];
            let inwards = cross64(on.normal, minus64(b, a));
            left = clip(&left, |place| dot64(minus64(place, a), inwards));
        }
        let own = Shape::of(self.vertices, &self.corners[triangle]);
        doubled_area(&left, on.normal) > TOUCH * own.area.min(on.area)
            && self.sheets.vertices(triangle).iter().all(|vertex| (-LEAST..=most).contains(&height(vertex)))
    }
}

/// What of a convex polygon is where something is not below zero, which changes evenly in space.
fn clip(polygon: &[Vector64], inside: impl Fn(Vector64) -> f64) -> Vec<Vector64> {
    let mut left = Vec::with_capacity(polygon.len() + 1);
    for (k, &from) in polygon.iter().enumerate() {
        let to = polygon[(k + 1) % polygon.len()];
        let (at_from, at_to) = (inside(from), inside(to));
        if at_from >= 0.0 {
            left.push(from);
        }
        if (at_from >= 0.0) != (at_to >= 0.0) {
            let share = at_from / (at_from - at_to);
            left.push(std::array::from_fn(|k| from[k] + (to[k] - from[k]) * share));
        }
    }
    left
}

/// Of a polygon seen along a unit normal.
fn doubled_area(polygon: &[Vector64], normal: Vector64) -> f64 {
    let Some(&first) = polygon.first() else { return 0.0 };
    let double = |pair: &[Vector64]| dot64(cross64(minus64(pair[0], first), minus64(pair[1], first)), normal);
    polygon.windows(2).map(double).sum::<f64>().abs()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bvh;

    const MOST: f64 = 2.0e-3;

    /// A floor's triangle, and beside it what is added.
    fn lies_on(more: &[[[f32; 3]; 3]]) -> [bool; 2] {
        let floor = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [-1.0, 1.0, 0.0]];
        let vertices: Vec<[f32; 3]> = floor.iter().chain(more.iter().flatten()).copied().collect();
        let triangles: Vec<[i32; 3]> =
            (0..vertices.len() as i32).step_by(3).map(|k| [k, k + 1, k + 2]).collect();
        let tree = bvh::build(&vertices, &triangles).unwrap();
        let order: Vec<i32> = tree.order.iter().map(|&triangle| triangle as i32).collect();
        let edges = Edges::of(&vertices, &triangles, &vec![0; triangles.len()]).unwrap();
        let all = Triangles {
            nodes: tree.nodes.as_chunks().0,
            order: &order,
            vertices: &vertices,
            corners: &edges.corners,
            sheets: &Sheets::of(&edges, Pieces::of_edges(vertices.len(), &edges)),
        };
        all.lies_on(&Shape::of(&vertices, &edges.corners[0]), MOST, &mut Vec::new()).unwrap()
    }

    /// So high at its corners; it faces up.
    fn sheet(heights: [f32; 3]) -> [[f32; 3]; 3] {
        let [a, b, c] = heights;
        [[-0.5, -0.5, a], [-0.3, -0.5, b], [-0.5, -0.3, c]]
    }

    #[test]
    fn sheets_lie_before_and_behind() {
        assert_eq!(lies_on(&[]), [false; 2]);
        assert_eq!(lies_on(&[sheet([1.0e-3; 3])]), [true, false]);
        assert_eq!(lies_on(&[sheet([0.0, 0.0, 1.0e-3])]), [true, false]);
        assert_eq!(lies_on(&[sheet([-1.0e-3; 3])]), [false, true]);
        assert_eq!(lies_on(&[sheet([1.0e-3; 3]), sheet([-1.0e-3; 3])]), [true; 2]);
    }

    /// In the plane; higher; rising; through it; a wall; beside it; beyond an edge by a touch.
    #[test]
    fn what_does_not_lie_on_it() {
        for heights in [[0.0; 3], [3.0e-3; 3], [0.0, 0.4, 0.0], [0.0, 0.0, 4.0e-3], [1.0e-3, 1.0e-3, -1.0e-3]]
        {
            assert_eq!(lies_on(&[sheet(heights)]), [false; 2], "{heights:?}");
        }
        let wall = [[-0.5, -0.5, 0.0], [-0.3, -0.5, 0.0], [-0.5, -0.5, 1.0e-3]];
        let beside = [[0.5, 0.5, 1.0e-3], [0.7, 0.5, 1.0e-3], [0.5, 0.7, 1.0e-3]];
        let touching = [[-1.2, -0.5, 1.0e-3], [-0.9999, -0.5, 1.0e-3], [-1.2, -0.3, 1.0e-3]];
        for other in [wall, beside, touching] {
            assert_eq!(lies_on(&[other]), [false; 2], "{other:?}");
        }
    }

    /// A low foot with what stands on it.
    #[test]
    fn what_is_joined_to_something_higher_does_not_lie() {
        let foot = sheet([1.0e-3; 3]);
        let [a, b, _] = foot;
        assert_eq!(lies_on(&[foot, [a, b, [-0.4, -0.6, 0.5]]]), [false; 2]);
    }

    #[test]
    fn bad_nodes() {
        let shape = Shape::of(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]], &[0, 1, 2]);
        let mut node = [0.0; NODE_FLOATS];
        (node[3], node[7]) = (0.0, 2.0);
        node[4..7].fill(1.0);
        let sheets = Sheets { ranges: Vec::new(), vertices: Vec::new() };
        let all = Triangles { nodes: &[node], order: &[0], vertices: &[], corners: &[], sheets: &sheets };
        assert!(all.lies_on(&shape, MOST, &mut Vec::new()).is_err());
    }
}
