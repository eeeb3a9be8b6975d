// SPDX-License-Identifier: GPL-3.0-or-later
//! Traces rays through the node array of [`crate::bvh::build`], as the GLSL does.

use rayon::prelude::*;

use crate::InvalidInput;
use crate::bvh::{MAX_DEPTH, NODE_FLOATS};
use crate::watertight::{BoxPair, Hit, Ray, Slabs};

/// Entries on the traversal stack; at most one is pushed a level.
pub const STACK: usize = 64;

const RAYS_A_TASK: usize = 512;

pub type Triangle = [[f32; 3]; 3];

/// Rays as parallel arrays of one length.
#[derive(Clone, Copy)]
pub struct Rays<'a> {
    pub origins: &'a [[f32; 3]],
    /// Need not be unit vectors; distances are in lengths of the direction.
    pub directions: &'a [[f32; 3]],
    /// A hit lies in 0 < t < t_max.
    pub t_max: &'a [f32],
    /// Position of a triangle that the ray passes through, -1 for none.
    pub skip: &'a [i32],
}

impl Rays<'_> {
    /// # Errors
    /// Arrays of different lengths, a `skip` that is neither -1 nor a triangle.
    pub fn check(&self, triangle_count: usize) -> Result<(), InvalidInput> {
        let count = self.origins.len();
        for (name, length) in
            [("directions", self.directions.len()), ("t_max", self.t_max.len()), ("skip", self.skip.len())]
        {
            if length != count {
                return Err(InvalidInput(format!("{name} has {length} rows, but origins has {count}")));
            }
        }
        let bad = |&skip: &i32| skip < -1 || skip as i64 >= triangle_count as i64;
        match self.skip.par_iter().with_min_len(1 << 14).position_first(bad) {
            None => Ok(()),
            Some(row) => {
                let value = self.skip[row];
                Err(InvalidInput(format!("skip[{row}] = {value} is outside [-1, {triangle_count})")))
            }
        }
    }

    /// Calls `trace(ray, t_max, skip)` for every ray that can hit anything.
    pub(crate) fn map<T: Send + Sync + Clone>(
        &self,
        miss: T,
        trace: impl Fn(&Ray, f32, i32) -> Option<T> + Sync,
    ) -> Vec<T> {
        (0..self.origins.len())
            .into_par_iter()
            .with_min_len(RAYS_A_TASK)
            .map(|i| {
                // False for NaN.
                let ray =
                    if self.t_max[i] > 0.0 { Ray::new(self.origins[i], self.directions[i]) } else { None };
                ray.and_then(|ray| trace(&ray, self.t_max[i], self.skip[i])).unwrap_or_else(|| miss.clone())
            })
            .collect()
    }
}

#[derive(Debug, Clone, Copy)]
struct Child {
    /// First triangle of a leaf, or a node.
    reference: u32,
    /// Triangles of a leaf; 0 for an inner node.
    count: u32,
}

#[derive(Debug, Clone, Copy)]
struct Node {
    boxes: BoxPair,
    children: [Child; 2],
}

/// A node array that has been checked: every reference is in range, and a traversal ends and
/// needs no more than [`STACK`] entries.
pub struct Tree<'a> {
    nodes: Vec<Node>,
    corners: &'a [Triangle],
    min: [f32; 3],
    max: [f32; 3],
}

impl<'a> Tree<'a> {
    /// Read `nodes` as laid out by [`crate::bvh::build`]; `corners` are the triangles in leaf order.
    ///
    /// # Errors
    /// No node; a reference or count that is out of range or not an integer; an inner node that
    /// does not follow its parent or has two; more than [`MAX_DEPTH`] levels.
    pub fn new(nodes: &[f32], corners: &'a [Triangle]) -> Result<Tree<'a>, InvalidInput> {
        let (nodes, rest) = nodes.as_chunks::<NODE_FLOATS>();
        if nodes.is_empty() || !rest.is_empty() {
            return Err(InvalidInput(format!("nodes: expected rows of {NODE_FLOATS} floats, at least one")));
        }
        // Of a node that has a parent, or is the root; else 0.
        let mut depths = vec![0u32; nodes.len()];
        depths[0] = 1;
        let mut parsed = Vec::with_capacity(nodes.len());
        for (row, node) in nodes.iter().enumerate() {
            let mut boxes = [0, 1, 2].map(|k| [node[k], node[k + 8], node[k + 4], node[k + 12]]);
            let mut children = [Child { reference: 0, count: 0 }; 2];
            for (side, child) in children.iter_mut().enumerate() {
                let at = 8 * side;
                let (reference, count) = (node[at + 3], node[at + 7]);
                if (reference, count) == (-1.0, 0.0) {
                    // A point at infinity, which no ray enters.
                    for axis in &mut boxes {
                        (axis[side], axis[side + 2]) = (f32::INFINITY, f32::INFINITY);
                    }
                    continue;
                }
                *child = read_child(reference, count, nodes.len(), corners.len())
                    .ok_or_else(|| bad_child(row, at, node))?;
                if child.count == 0 {
                    // Nodes that follow their only parent form a tree: a traversal ends.
                    let depth = depths[row] + 1;
                    let inner = child.reference as usize;
                    if inner <= row || depths[inner] > 0 || depth > MAX_DEPTH {
                        return Err(bad_child(row, at, node));
                    }
                    depths[inner] = depth;
                }
            }
            parsed.push(Node { boxes, children });
        }
        let root = parsed[0];
        let mut tree = Tree { nodes: parsed, corners, min: [0.0; 3], max: [0.0; 3] };
        for (k, [left_min, right_min, left_max, right_max]) in root.boxes.into_iter().enumerate() {
            // 0 instead of a missing child's infinity: any finite bounds do if both are missing,
            // and larger bounds do no harm.
            let finite = |bound: f32| if bound.is_finite() { bound } else { 0.0 };
            tree.min[k] = finite(left_min).min(finite(right_min));
            tree.max[k] = finite(left_max).max(finite(right_max));
        }
        Ok(tree)
    }

    /// Calls `visit(triangle, hit, limit)` for the triangles that a ray may hit before `limit`,
    /// roughly near ones first; `visit` returns the new limit, or None to stop.
    #[inline]
    fn traverse(
        &self,
        ray: &Ray,
        t_max: f32,
        skip: i32,
        mut visit: impl FnMut(i32, Hit, f32) -> Option<f32>,
    ) {
        let slabs = Slabs::new(ray, &self.min, &self.max);
        let mut limit = t_max;
        let mut stack = [(Child { reference: 0, count: 0 }, 0.0f32); STACK];
        let mut size = 1;
        while size > 0 {
            size -= 1;
            let (Child { reference, count }, t) = stack[size];
            if t > limit {
                continue;
            }
            if count > 0 {
                for position in reference..reference + count {
                    if position as i32 == skip {
                        continue;
                    }
                    if let Some(hit) = ray.intersect(&self.corners[position as usize]) {
                        match visit(position as i32, hit, limit) {
                            Some(new_limit) => limit = new_limit,
                            None => return,
                        }
                    }
                }
                continue;
            }
            let node = &self.nodes[reference as usize];
            let [mut near, mut far] = node.children;
            let (mut near_t, mut far_t) = slabs.enter(&node.boxes, limit);
            if far_t < near_t {
                (near, far, near_t, far_t) = (far, near, far_t, near_t);
            }
            // Written whether or not it is entered: which one is, no processor can predict.
            stack[size] = (far, far_t);
            size += usize::from(far_t < f32::INFINITY);
            stack[size] = (near, near_t);
            size += usize::from(near_t < f32::INFINITY);
        }
    }

    /// The closest hit of a ray: the triangle's position in leaf order and where it is hit. Of
    /// triangles at the same distance, the one of the smallest position.
    pub fn closest(&self, ray: &Ray, t_max: f32, skip: i32) -> Option<(i32, Hit)> {
        let mut best: Option<(i32, Hit)> = None;
        self.traverse(ray, t_max, skip, |position, hit, limit| {
            let closer = match best {
                None => hit.t < limit,
                Some((other, _)) => hit.t < limit || (hit.t == limit && position < other),
            };
            if closer {
                best = Some((position, hit));
            }
            Some(if closer { hit.t } else { limit })
        });
        best
    }

    /// Whether a ray hits anything.
    pub fn is_occluded(&self, ray: &Ray, t_max: f32, skip: i32) -> bool {
        let mut occluded = false;
        self.traverse(ray, t_max, skip, |_, hit, limit| {
            occluded = hit.t < limit;
            (!occluded).then_some(limit)
        });
        occluded
    }

    /// [`Tree::closest`] of many rays. The caller has checked them.
    pub fn trace(&self, rays: &Rays) -> Vec<Option<(i32, Hit)>> {
        rays.map(None, |ray, t_max, skip| self.closest(ray, t_max, skip).map(Some))
    }

    /// [`Tree::is_occluded`] of many rays. The caller has checked them.
    pub fn occluded(&self, rays: &Rays) -> Vec<bool> {
        rays.map(false, |ray, t_max, skip| Some(self.is_occluded(ray, t_max, skip)))
    }
}

fn read_child(reference: f32, count: f32, node_count: usize, triangle_count: usize) -> Option<Child> {
    let integer = |x: f32| (x.fract() == 0.0 && x.abs() < 16_777_216.0).then_some(x as i64);
    let (reference, count) = (integer(reference)?, integer(count)?);
    let child = Child { reference: reference as u32, count: count as u32 };
    let in_range = match count {
        0 => reference < node_count as i64,
        _ => count > 0 && reference + count <= triangle_count as i64,
    };
    (reference >= 0 && in_range).then_some(child)
}

fn bad_child(row: usize, column: usize, node: &[f32; NODE_FLOATS]) -> InvalidInput {
    InvalidInput(format!(
        "nodes[{row}, {}] = {}, nodes[{row}, {}] = {} do not refer to triangles, nor to a later node that has no other parent and is at most \
         {MAX_DEPTH} levels deep",
        column + 3,
        node[column + 3],
        column + 7,
        node[column + 7]
    ))
}
