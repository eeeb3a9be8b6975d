// SPDX-License-Identifier: GPL-3.0-or-later
//! Which triangles something lies on, as a rug on a floor or a sheet on a wall: coverage then can't know without a ray
//! where light falls on them.

use rayon::prelude::*;

use crate::InvalidInput;
use crate::bvh::{CHILDREN, NODE_FLOATS};
use crate::coverage::ONE_LAYER;
use crate::edges::Edges;
use crate::solid::Pieces;
use crate::trace::child_of;
use crate::vector::{Vector64, cross64, dot64, minus64};

/// What is nearer to a triangle is one layer with it [scene units].
const LEAST: f64 = ONE_LAYER as f64;
/// All vertices of a piece are looked at up to so many, for that is done again for each triangle below it.
const MOST_VERTICES: usize = 4096;
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

    /// The box about it, so much wider.
    fn bounds(&self, more: f64) -> [[f32; 3]; 2] {
        let along = |k: usize| self.corners.map(|corner| corner[k]).into_iter();
        [
            std::array::from_fn(|k| (along(k).fold(f64::INFINITY, f64::min) - more) as f32),
            std::array::from_fn(|k| (along(k).fold(f64::NEG_INFINITY, f64::max) + more) as f32),
        ]
    }

    /// How far a box is from the plane at least, below zero where it is cut, and at most.
    fn distances(&self, corners: [[f32; 3]; 2]) -> [f64; 2] {
        let [low, high] = corners.map(|corner| corner.map(f64::from));
        let middle = std::array::from_fn(|k| 0.5 * (low[k] + high[k]));
        let reach: f64 = (0..3).map(|k| 0.5 * (high[k] - low[k]) * self.normal[k].abs()).sum();
        let away = self.height(middle).abs();
        [away - reach, away + reach]
    }
}

/// What triangles join to, each piece with its box and the vertices that it is of.
pub(crate) struct Bodies {
    /// Of each triangle the number of its piece.
    of: Vec<u32>,
    boxes: Vec<[[f32; 3]; 2]>,
    /// Where each piece's vertices begin, and the end.
    begins: Vec<u32>,
    vertices: Vec<u32>,
}

impl Bodies {
    pub(crate) fn new(places: &[[f32; 3]], edges: &Edges, mut pieces: Pieces) -> Bodies {
        let mut is_used = vec![false; places.len()];
        edges.corners.iter().flatten().for_each(|&vertex| is_used[vertex as usize] = true);
        let used = (0..places.len() as u32).filter(|&vertex| is_used[vertex as usize]);
        let mut members: Vec<(u32, u32)> = used.map(|vertex| (pieces.of(vertex), vertex)).collect();
        members.par_sort_unstable();
        let (mut numbers, mut boxes, mut begins) = (vec![0; places.len()], Vec::new(), vec![0]);
        for piece in members.chunk_by(|one, other| one.0 == other.0) {
            numbers[piece[0].0 as usize] = boxes.len() as u32;
            let of_all = |k: usize, pick: fn(f32, f32) -> f32, from: f32| {
                piece.iter().fold(from, |found, &(_, vertex)| pick(found, places[vertex as usize][k]))
            };
            boxes.push([
                std::array::from_fn(|k| of_all(k, f32::min, f32::INFINITY)),
                std::array::from_fn(|k| of_all(k, f32::max, f32::NEG_INFINITY)),
            ]);
            begins.push(begins[boxes.len() - 1] + piece.len() as u32);
        }
        let of = edges.corners.iter().map(|[corner, ..]| numbers[pieces.of(*corner) as usize]).collect();
        Bodies { of, boxes, begins, vertices: members.into_iter().map(|(_, vertex)| vertex).collect() }
    }

    fn vertices(&self, body: u32) -> &[u32] {
        let [begin, end] = [0, 1].map(|k| self.begins[body as usize + k] as usize);
        &self.vertices[begin..end]
    }
}

/// Triangles, of which `corners` are indices into vertices, in the tree of [`crate::bvh::build`] or
/// [`crate::refit::refit`].
pub(crate) struct Triangles<'a> {
    pub(crate) nodes: &'a [[f32; NODE_FLOATS]],
    pub(crate) order: &'a [i32],
    pub(crate) vertices: &'a [[f32; 3]],
    pub(crate) corners: &'a [[u32; 3]],
    pub(crate) bodies: &'a Bodies,
}

impl Triangles<'_> {
    /// Whether something lies before a triangle, from where its corners go round to the left, and behind it: with all
    /// that it is joined to no further from the triangle's plane than `most`, and over more than a touch. What rises
    /// higher cuts discs off where it does. `stack` is for use.
    ///
    /// # Errors
    /// References of `nodes` out of range, not to a later node, or to one that has another parent.
    pub(crate) fn lies_on(
        &self,
        shape: &Shape,
        most: f64,
        stack: &mut Vec<usize>,
    ) -> Result<[bool; 2], InvalidInput> {
        // The last pieces that were found to be so low, and not to be.
        let (mut found, mut low_body, mut high_body) = ([false; 2], None, None);
        if !(most > 0.0 && shape.area > 0.0) {
            return Ok(found);
        }
        let [low, high] = shape.bounds(most);
        stack.clear();
        stack.push(0);
        let mut visited = 0;
        while let Some(row) = stack.pop() {
            visited += 1;
            if visited > self.nodes.len() {
                return Err(InvalidInput("nodes: a node has two parents".into()));
            }
            let node = &self.nodes[row];
            for at in CHILDREN {
                let [box_low, box_high]: [[f32; 3]; 2] =
                    [at, at + 4].map(|at| std::array::from_fn(|k| node[at + k]));
                if (0..3).any(|k| box_low[k] > high[k] || box_high[k] < low[k]) {
                    continue;
                }
                let [nearest, furthest] = shape.distances([box_low, box_high]);
                if nearest > most || furthest < LEAST {
                    continue;
                }
                let Some((first, count)) = child_of(row, at, node, self.nodes.len(), self.order.len())?
                else {
                    continue;
                };
                if count == 0 {
                    stack.push(first);
                    continue;
                }
                for &triangle in &self.order[first..first + count] {
                    let (triangle, body) = (triangle as usize, self.bodies.of[triangle as usize]);
                    if Some(body) == high_body {
                        continue;
                    }
                    if Some(body) != low_body && !self.is_low(body, shape, most) {
                        high_body = Some(body);
                        continue;
                    }
                    low_body = Some(body);
                    for (found, side) in found.iter_mut().zip([1.0, -1.0]) {
                        *found = *found || self.overlaps(triangle, shape, side);
                    }
                }
                if found == [true; 2] {
                    return Ok(found);
                }
            }
        }
        Ok(found)
    }

    /// Whether part of a triangle is on one side of another, 1 or -1, and hides more than a touch of it.
    fn overlaps(&self, triangle: usize, on: &Shape, side: f64) -> bool {
        let place = |vertex: u32| self.vertices[vertex as usize].map(f64::from);
        let corners = self.corners[triangle];
        if corners.iter().all(|&vertex| side * on.height(place(vertex)) < LEAST) {
            return false;
        }
        let mut left = corners.map(place).to_vec();
        for k in 0..3 {
            let [a, b] = [on.corners[k], on.corners[(k + 1) % 3]];
            let inwards = cross64(on.normal, minus64(b, a));
            left = clip(&left, |place| dot64(minus64(place, a), inwards));
        }
        let own = Shape::of(self.vertices, &corners);
        doubled_area(&left, on.normal) > TOUCH * own.area.min(on.area)
    }

    /// Whether all of a piece is so near to a triangle's plane. Of many vertices its box alone tells.
    fn is_low(&self, body: u32, on: &Shape, most: f64) -> bool {
        let [_, furthest] = on.distances(self.bodies.boxes[body as usize]);
        let vertices = self.bodies.vertices(body);
        furthest <= most
            || vertices.len() <= MOST_VERTICES
                && vertices
                    .iter()
                    .all(|&vertex| on.height(self.vertices[vertex as usize].map(f64::from)).abs() <= most)
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
            bodies: &Bodies::new(&vertices, &edges, Pieces::of_edges(vertices.len(), &edges)),
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
        assert_eq!(lies_on(&[sheet([1.0e-3, 1.0e-3, -1.0e-3])]), [true; 2]); // sunk in
    }

    /// In the plane; higher; rising; a wall; beside it; beyond an edge by a touch.
    #[test]
    fn what_does_not_lie_on_it() {
        for heights in [[0.0; 3], [3.0e-3; 3], [0.0, 0.4, 0.0], [0.0, 0.0, 4.0e-3]] {
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
        let bodies = Bodies { of: vec![], boxes: vec![], begins: vec![], vertices: vec![] };
        let all = Triangles { nodes: &[node], order: &[0], vertices: &[], corners: &[], bodies: &bodies };
        assert!(all.lies_on(&shape, MOST, &mut Vec::new()).is_err());
    }
}
