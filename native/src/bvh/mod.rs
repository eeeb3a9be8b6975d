// SPDX-License-Identifier: GPL-3.0-or-later
//! Builds a binary BVH by binned SAH (Wald 2007, "On fast Construction of SAH-based Bounding
//! Volume Hierarchies"), top down and in parallel, with the same result on any thread count.

mod items;
mod split;

use rayon::prelude::*;

use crate::InvalidInput;
use crate::bounds::Bounds;
pub use crate::bounds::EMPTY;
use items::{Item, Kept, keep};
pub(crate) use items::{Skip, box_of, check_indices};
use split::{best_split, partition, split_at_median};

/// Float32 holds every integer below 2^24, and the nodes store references as float32.
pub const MAX_TRIANGLES: usize = (1 << 24) - 1;
/// Most inner nodes on a path from the root; a traversal pushes at most one entry a level.
pub const MAX_DEPTH: u32 = 62;
pub const MAX_LEAF: usize = 4;
/// Larger coordinates are taken for garbage: their squares would overflow in the shaders.
pub const MAX_COORDINATE: f32 = 1e30;

/// Floats a node: 4 RGBA32F texels.
pub const NODE_FLOATS: usize = 16;
/// Columns of a node at which its children begin.
pub(crate) const CHILDREN: [usize; 2] = [0, 8];

/// The box about the child that begins at a column of a node.
pub(crate) fn box_at(node: &[f32; NODE_FLOATS], at: usize) -> Bounds {
    let corner = |k: usize| [node[k], node[k + 1], node[k + 2], 0.0];
    Bounds { min: corner(at), max: corner(at + 4) }
}

/// Cost of visiting an inner node, in ray/triangle tests.
const TRAVERSAL_COST: f64 = 1.0;
/// Below this many triangles a task costs more than it gains.
const PARALLEL_SUBTREE: usize = 2048;
const PARALLEL_PASS: usize = 1 << 15;
pub(crate) const PASS_CHUNK: usize = 1 << 13;

/// A BVH as arrays; see [`build`] for the layout.
#[derive(Debug, Clone, PartialEq)]
pub struct Bvh {
    pub nodes: Vec<f32>,
    pub order: Vec<u32>,
    pub skipped_not_finite: usize,
    pub skipped_degenerate: usize,
    /// SAH cost over the areas of the triangles' own boxes: how much the tree adds to what it is about. It
    /// grows where a refitted tree gets worse than one that was built there, about as much as rays take
    /// longer in it. Relative to the area of the root, cost also grows with the triangles, for every tree.
    pub cost: f64,
}

/// Build a BVH over triangles.
///
/// A node is 16 floats, i.e. 4 texels: left.min.xyz, left_ref | left.max.xyz, left_count |
/// right.min.xyz, right_ref | right.max.xyz, right_count. `count == 0`: `ref` is the index of an
/// inner node, greater than this node's own. `count > 0`: a leaf, the triangles
/// `order[ref .. ref + count]`, at most [`MAX_LEAF`]. A missing child, which only the root can
/// have, holds [`EMPTY`] bounds, ref -1 and count 0. References and counts are float values.
///
/// `order` lists the kept triangles in leaf order. Skipped and counted are triangles with a
/// coordinate that is not finite or beyond [`MAX_COORDINATE`], and triangles of exactly zero area.
///
/// # Errors
/// A vertex index outside `vertices`; more than [`MAX_TRIANGLES`] triangles.
pub fn build(vertices: &[[f32; 3]], triangles: &[[i32; 3]]) -> Result<Bvh, InvalidInput> {
    if triangles.len() > MAX_TRIANGLES {
        return Err(InvalidInput(format!(
            "triangles: {} are more than {MAX_TRIANGLES}, the most that float32 references can count",
            triangles.len()
        )));
    }
    check_indices(triangles, vertices.len())?;

    let parts: Vec<Kept> = triangles
        .par_chunks(PASS_CHUNK)
        .enumerate()
        .map(|(chunk, triangles)| keep(vertices, triangles, chunk * PASS_CHUNK))
        .collect();
    let mut items = Vec::with_capacity(parts.iter().map(|part| part.items.len()).sum());
    for part in &parts {
        items.extend_from_slice(&part.items);
    }

    let mut slots = vec![Node::default(); items.len().max(1)];
    if items.len() <= MAX_LEAF {
        let bounds = items.iter().fold(Bounds::EMPTY, |b, item| b.union(&item.bounds));
        if !items.is_empty() {
            slots[0].left = Child { bounds, reference: 0, count: items.len() as i32 };
        }
    } else {
        subtree(&mut items, &mut slots, 0, 0, 1);
    }

    let nodes = compact(&slots);
    let areas = sum(&items, |item| item.bounds.half_area());
    Ok(Bvh {
        cost: cost(&nodes) / areas,
        nodes,
        order: items.par_iter().map(|item| item.index).collect(),
        skipped_not_finite: parts.iter().map(|part| part.not_finite).sum(),
        skipped_degenerate: parts.iter().map(|part| part.degenerate).sum(),
    })
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Child {
    bounds: Bounds,
    reference: i32,
    count: i32,
}

impl Child {
    const MISSING: Child = Child { bounds: Bounds::EMPTY, reference: -1, count: 0 };
}

/// A slot of the array that the tree is built in; unused if both children are missing.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Node {
    left: Child,
    right: Child,
}

impl Default for Node {
    fn default() -> Self {
        Node { left: Child::MISSING, right: Child::MISSING }
    }
}

/// Build the tree over `items` and return it as a child of its parent.
///
/// `slots` are the node slots reserved for it, one fewer than items (as many as a tree with one
/// triangle a leaf needs), and `base` is the index of the first; `first` is the position of
/// `items` in leaf order; `depth` counts the inner nodes from the root to this one.
///
/// `depth + ceil(log2(items))` never exceeds MAX_DEPTH: a SAH split is allowed while the sum is
/// below it, and a median split lowers the logarithm by one.
fn subtree(items: &mut [Item], slots: &mut [Node], base: usize, first: usize, depth: u32) -> Child {
    let (bounds, centres) = measure(items);
    let leaf = Child { bounds, reference: first as i32, count: items.len() as i32 };
    if items.len() == 1 {
        return leaf;
    }
    let halvings = usize::BITS - (items.len() - 1).leading_zeros();
    let split = if depth + halvings < MAX_DEPTH { best_split(items, &centres) } else { None };
    if items.len() <= MAX_LEAF {
        let whole = items.len() as f64 * bounds.half_area();
        let worth_it = split.as_ref().is_some_and(|s| s.cost + TRAVERSAL_COST * bounds.half_area() < whole);
        if !worth_it {
            return leaf;
        }
    }
    let middle = match split {
        Some(split) => partition(items, |item| split.is_left(item)),
        None => split_at_median(items, &centres),
    };

    let (left_items, right_items) = items.split_at_mut(middle);
    let (node, slots) = slots.split_first_mut().expect("a slot is reserved for each inner node");
    let (left_slots, right_slots) = slots.split_at_mut(middle - 1);
    let (left_base, right_base) = (base + 1, base + middle);
    let parallel = left_items.len() + right_items.len() >= PARALLEL_SUBTREE;
    let mut left = || subtree(left_items, left_slots, left_base, first, depth + 1);
    let mut right = || subtree(right_items, right_slots, right_base, first + middle, depth + 1);
    let (left, right) = if parallel { rayon::join(left, right) } else { (left(), right()) };
    *node = Node { left, right };
    Child { bounds, reference: base as i32, count: 0 }
}

/// The bounds of the items, and of twice their centres.
fn measure(items: &[Item]) -> (Bounds, Bounds) {
    let pass = |items: &[Item]| {
        items.iter().fold((Bounds::EMPTY, Bounds::EMPTY), |(bounds, centres), item| {
            let centre = item.centre();
            (bounds.union(&item.bounds), centres.union(&Bounds { min: centre, max: centre }))
        })
    };
    if items.len() < PARALLEL_PASS {
        return pass(items);
    }
    // Min and max are exact: the order of the reduction does not show in the result.
    items
        .par_chunks(PASS_CHUNK)
        .map(pass)
        .reduce(|| (Bounds::EMPTY, Bounds::EMPTY), |a, b| (a.0.union(&b.0), a.1.union(&b.1)))
}

/// The boxes about all children, each as often as it is visited or its triangles are tested.
pub(crate) fn cost(nodes: &[f32]) -> f64 {
    let (children, _) = nodes.as_chunks::<{ NODE_FLOATS / 2 }>();
    sum(children, |&[x, y, z, _, to_x, to_y, to_z, count]| {
        let bounds = Bounds { min: [x, y, z, 0.0], max: [to_x, to_y, to_z, 0.0] };
        bounds.half_area() * if count > 0.0 { f64::from(count) } else { TRAVERSAL_COST }
    })
}

/// The same on any number of threads.
fn sum<T: Sync>(items: &[T], term: impl Fn(&T) -> f64 + Sync) -> f64 {
    let sums: Vec<f64> = items.par_chunks(PASS_CHUNK).map(|items| items.iter().map(&term).sum()).collect();
    sums.iter().sum()
}

/// Drop the unused slots and write the nodes as floats, depth first.
fn compact(slots: &[Node]) -> Vec<f32> {
    let used = |slot: &Node| slot.left != Child::MISSING;
    let mut index = vec![0; slots.len()];
    let mut count = 0;
    for (slot, index) in slots.iter().zip(&mut index) {
        *index = count;
        count += i32::from(used(slot));
    }
    let mut nodes = Vec::with_capacity(count.max(1) as usize * NODE_FLOATS);
    for (position, slot) in slots.iter().enumerate() {
        // The root is written even when it is empty.
        if position > 0 && !used(slot) {
            continue;
        }
        for child in [&slot.left, &slot.right] {
            let is_inner = child.count == 0 && child.reference >= 0;
            let reference = if is_inner { index[child.reference as usize] } else { child.reference };
            nodes.extend_from_slice(&child.bounds.min[..3]);
            nodes.push(reference as f32);
            nodes.extend_from_slice(&child.bounds.max[..3]);
            nodes.push(child.count as f32);
        }
    }
    nodes
}
