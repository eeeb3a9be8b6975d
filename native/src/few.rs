// SPDX-License-Identifier: GPL-3.0-or-later
//! Few rays through the binary tree as it is built: making it wide ([`crate::wide`]) takes longer than they do.

use rayon::prelude::*;

use crate::InvalidInput;
use crate::bounds::Bounds;
use crate::bvh::{CHILDREN, MAX_DEPTH, NODE_FLOATS, box_at};
use crate::lanes::{Lanes, Plain, Row, WIDTH};
use crate::trace::child_of;
use crate::watertight::{Hit, Ray, Slabs};

const RAYS_A_TASK: usize = 32;

/// A triangle's corners, as of [`crate::python`]'s Tracer: the last one's fourth number is the triangle's.
type Numbered = [[f32; 4]; 3];

/// The closest hits of rays, or with `any` some hits, each by the triangle's position in leaf order; the same as by
/// [`crate::trace::Tree::trace_records`], whose rays these are.
///
/// # Errors
/// As of [`crate::trace::Tree::new`], where a ray comes to.
pub fn trace(
    nodes: &[[f32; NODE_FLOATS]],
    corners: &[Numbered],
    origins: &[[f32; 4]],
    directions: &[[f32; 4]],
    any: bool,
) -> Result<Vec<Option<(i32, Hit)>>, InvalidInput> {
    let Some(root) = nodes.first() else {
        return Err(InvalidInput("nodes: expected at least one".into()));
    };
    let boxes = CHILDREN.map(|at| box_at(root, at));
    let tree = Binary { nodes, corners, bounds: boxes[0].union(&boxes[1]) };
    let rays = origins.par_iter().zip(directions).with_min_len(RAYS_A_TASK);
    rays.map(|(&[ox, oy, oz, skip], &[dx, dy, dz, t_max])| match Ray::new([ox, oy, oz], [dx, dy, dz]) {
        Some(ray) if t_max > 0.0 => tree.hit(&ray, t_max, skip as i32, any),
        _ => Ok(None),
    })
    .collect()
}

struct Binary<'a> {
    nodes: &'a [[f32; NODE_FLOATS]],
    corners: &'a [Numbered],
    bounds: Bounds,
}

impl Binary<'_> {
    fn hit(&self, ray: &Ray, t_max: f32, skip: i32, any: bool) -> Result<Option<(i32, Hit)>, InvalidInput> {
        let slabs = Slabs::<Plain>::new(ray, &self.bounds);
        let (mut best, mut limit, mut visited) = (None, t_max, 0);
        let mut stack = [(0usize, 0.0f32); MAX_DEPTH as usize + 2];
        let mut size = 1;
        while size > 0 {
            size -= 1;
            let (row, entry) = stack[size];
            if entry > slabs.latest_entry(limit) {
                continue;
            }
            visited += 1;
            if visited > self.nodes.len() || size + 2 > stack.len() {
                return Err(InvalidInput("nodes: one has two parents, or they are too deep".into()));
            }
            let node = &self.nodes[row];
            let (entries, entered) = entered(&slabs, node, slabs.latest_entry(limit));
            let farther_first = if entries[0] < entries[1] { [1, 0] } else { [0, 1] };
            for lane in farther_first.into_iter().filter(|lane| entered >> lane & 1 == 1) {
                let child = child_of(row, CHILDREN[lane], node, self.nodes.len(), self.corners.len())?;
                let Some((first, count)) = child else { continue };
                if count == 0 {
                    stack[size] = (first, entries[lane]);
                    size += 1;
                    continue;
                }
                for position in first..first + count {
                    let Some(hit) = self.hit_of(position, ray, skip) else { continue };
                    if hit.t < limit || (hit.t == limit && self.is_before(position, best)) {
                        (best, limit) = (Some((position as i32, hit)), hit.t);
                        if any {
                            return Ok(best);
                        }
                    }
                }
            }
        }
        Ok(best)
    }

    fn hit_of(&self, position: usize, ray: &Ray, skip: i32) -> Option<Hit> {
        let corners = self.corners[position].map(|[x, y, z, _]| [x, y, z]);
        if position as i32 == skip { None } else { ray.intersect(&corners) }
    }

    /// Of two triangles that a ray meets at one distance that of the smaller number is the closest.
    fn is_before(&self, position: usize, best: Option<(i32, Hit)>) -> bool {
        best.is_some_and(|(other, _)| self.corners[position][2][3] < self.corners[other as usize][2][3])
    }
}

/// Where a ray enters a node's children, and a bit for each that it does in time.
fn entered(slabs: &Slabs<Plain>, node: &[f32; NODE_FLOATS], latest: f32) -> ([f32; WIDTH], u32) {
    let row = |k: usize| {
        let mut row = Row([node[k]; WIDTH]);
        row.0[1] = node[k + CHILDREN[1]];
        row
    };
    let (near, entered) = slabs.enter(&[0, 1, 2].map(row), &[4, 5, 6].map(row), latest);
    (near.store().0, Plain::bits(entered) & 3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bad_trees() {
        let ray = [[0.0, 0.0, -1.0, -1.0]];
        let onward = [[0.0, 0.0, 1.0, 9.0]];
        assert!(trace(&[], &[], &ray, &onward, false).is_err());
        let inside = |reference: f32, count: f32| [-1.0, -1.0, -1.0, reference, 1.0, 1.0, 1.0, count];
        let node = |one: [f32; 8], other: [f32; 8]| {
            std::array::from_fn(|k| if k < 8 { one[k] } else { other[k - 8] })
        };
        let missing = [3.0e38, 3.0e38, 3.0e38, -1.0, -3.0e38, -3.0e38, -3.0e38, 0.0];
        assert_eq!(trace(&[node(missing, missing)], &[], &ray, &onward, false).unwrap(), [None]);
        for (reference, count) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.0)] {
            assert!(trace(&[node(inside(reference, count), missing)], &[], &ray, &onward, false).is_err());
        }
        let twice = [node(inside(1.0, 0.0), inside(1.0, 0.0)), node(inside(2.0, 0.0), inside(2.0, 0.0))];
        assert!(trace(&[twice[0], twice[1], node(missing, missing)], &[], &ray, &onward, false).is_err());
    }
}
