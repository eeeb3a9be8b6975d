// SPDX-License-Identifier: GPL-3.0-or-later
//! Builds a binary BVH by binned SAH (Wald 2007, "On fast Construction of SAH-based Bounding
//! Volume Hierarchies"), top down and in parallel, with the same result on any thread count.

use rayon::prelude::*;

use crate::InvalidInput;
use crate::bounds::Bounds;
pub use crate::bounds::EMPTY;

/// Float32 holds every integer below 2^24, and the nodes store references as float32.
pub const MAX_TRIANGLES: usize = (1 << 24) - 1;
/// Most inner nodes on a path from the root; a traversal pushes at most one entry a level.
pub const MAX_DEPTH: u32 = 62;
pub const MAX_LEAF: usize = 4;
/// Larger coordinates are taken for garbage: their squares would overflow in the shaders.
pub const MAX_COORDINATE: f32 = 1e30;

/// Floats a node: 4 RGBA32F texels.
pub const NODE_FLOATS: usize = 16;

const BINS: usize = 16;
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
    /// grows where a refitted tree gets worse than one that was built there: in 27 deformations of two balls
    /// in a room rays took about 1.1 times as long where it was 1.1 times as large, and 1.2 to 1.45 times at
    /// 1.2. Relative to the area of the root, cost also grows with the triangles, for every tree.
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

#[derive(Debug, Clone, Copy)]
struct Item {
    bounds: Bounds,
    index: u32,
}

impl Item {
    /// Twice the centre of the bounds.
    #[inline]
    fn centre(&self) -> [f32; 4] {
        let Bounds { min, max } = &self.bounds;
        [min[0] + max[0], min[1] + max[1], min[2] + max[2], 0.0]
    }
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

pub(crate) fn check_indices(triangles: &[[i32; 3]], vertex_count: usize) -> Result<(), InvalidInput> {
    let bad = |index: i32| usize::try_from(index).map_or(true, |index| index >= vertex_count);
    let found = triangles
        .par_iter()
        .enumerate()
        .with_min_len(PASS_CHUNK)
        .find_first(|(_, triangle)| triangle.iter().any(|&index| bad(index)));
    match found {
        None => Ok(()),
        Some((row, triangle)) => {
            let column = triangle.iter().position(|&index| bad(index)).unwrap_or(0);
            Err(InvalidInput(format!(
                "triangles[{row}, {column}] = {} is outside [0, {vertex_count})",
                triangle[column]
            )))
        }
    }
}

#[derive(Default)]
struct Kept {
    items: Vec<Item>,
    not_finite: usize,
    degenerate: usize,
}

fn keep(vertices: &[[f32; 3]], triangles: &[[i32; 3]], first: usize) -> Kept {
    let mut kept = Kept { items: Vec::with_capacity(triangles.len()), ..Kept::default() };
    for (offset, triangle) in triangles.iter().enumerate() {
        let corners = triangle.map(|index| vertices[index as usize]);
        match box_of(&corners) {
            Ok(bounds) => kept.items.push(Item { bounds, index: (first + offset) as u32 }),
            Err(Skip::NotFinite) => kept.not_finite += 1,
            Err(Skip::Degenerate) => kept.degenerate += 1,
        }
    }
    kept
}

/// Why a triangle is not in the tree.
pub(crate) enum Skip {
    NotFinite,
    Degenerate,
}

pub(crate) fn box_of(corners: &[[f32; 3]; 3]) -> Result<Bounds, Skip> {
    // The comparison is false for NaN.
    if !corners.iter().flatten().all(|x| x.abs() <= MAX_COORDINATE) {
        return Err(Skip::NotFinite);
    }
    if has_no_area(corners) {
        return Err(Skip::Degenerate);
    }
    let [a, b, c] = corners.map(|[x, y, z]| Bounds { min: [x, y, z, 0.0], max: [x, y, z, 0.0] });
    Ok(a.union(&b).union(&c))
}

/// In float64 the edges and their products are exact unless magnitudes differ wildly.
fn has_no_area(corners: &[[f32; 3]; 3]) -> bool {
    let [a, b, c] = corners.map(|p| p.map(f64::from));
    let e: [f64; 3] = std::array::from_fn(|k| b[k] - a[k]);
    let f: [f64; 3] = std::array::from_fn(|k| c[k] - a[k]);
    (0..3).all(|k| {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        e[i] * f[j] == e[j] * f[i]
    })
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

/// Bins along the three axes of the bounds of the centres.
#[derive(Clone, Copy)]
struct Grid {
    min: [f64; 3],
    /// Bins per unit; 0 on an axis without extent.
    scale: [f64; 3],
}

impl Grid {
    fn new(centres: &Bounds) -> Grid {
        // Float64: the reciprocal of a denormal extent overflows float32.
        let extent = |k: usize| centres.max[k] as f64 - centres.min[k] as f64;
        Grid {
            min: [0, 1, 2].map(|k| centres.min[k] as f64),
            scale: [0, 1, 2].map(|k| if extent(k) > 0.0 { BINS as f64 / extent(k) } else { 0.0 }),
        }
    }

    #[inline]
    fn bin(&self, centre: f32, axis: usize) -> usize {
        (((centre as f64 - self.min[axis]) * self.scale[axis]) as usize).min(BINS - 1)
    }
}

#[derive(Clone, Copy)]
struct Bin {
    bounds: Bounds,
    count: usize,
}

impl Bin {
    const EMPTY: Bin = Bin { bounds: Bounds::EMPTY, count: 0 };

    #[inline]
    fn union(&self, other: &Bin) -> Bin {
        Bin { bounds: self.bounds.union(&other.bounds), count: self.count + other.count }
    }

    fn cost(&self) -> f64 {
        self.bounds.half_area() * self.count as f64
    }
}

type Bins = [[Bin; BINS]; 3];
const NO_BINS: Bins = [[Bin::EMPTY; BINS]; 3];

struct Split {
    grid: Grid,
    axis: usize,
    /// First bin on the right.
    bin: usize,
    /// Sum over both sides of half area times count.
    cost: f64,
}

impl Split {
    #[inline]
    fn is_left(&self, item: &Item) -> bool {
        self.grid.bin(item.centre()[self.axis], self.axis) < self.bin
    }
}

/// The cheapest split between two bins; None if all centres coincide.
fn best_split(items: &[Item], centres: &Bounds) -> Option<Split> {
    let grid = Grid::new(centres);
    let bins = fill_bins(items, &grid);
    let mut best: Option<Split> = None;
    for axis in (0..3).filter(|&axis| grid.scale[axis] > 0.0) {
        let mut right_cost = [0.0; BINS];
        let mut right = Bin::EMPTY;
        for bin in (1..BINS).rev() {
            right = right.union(&bins[axis][bin]);
            right_cost[bin] = right.cost();
        }
        let mut left = Bin::EMPTY;
        for bin in 1..BINS {
            left = left.union(&bins[axis][bin - 1]);
            let cost = left.cost() + right_cost[bin];
            let splits = left.count > 0 && left.count < items.len();
            if splits && best.as_ref().is_none_or(|best| cost < best.cost) {
                best = Some(Split { grid, axis, bin, cost });
            }
        }
    }
    best
}

fn fill_bins(items: &[Item], grid: &Grid) -> Bins {
    let pass = |items: &[Item]| {
        let mut bins = NO_BINS;
        for item in items {
            let centre = item.centre();
            for (axis, bins) in bins.iter_mut().enumerate() {
                let bin = &mut bins[grid.bin(centre[axis], axis)];
                bin.bounds = bin.bounds.union(&item.bounds);
                bin.count += 1;
            }
        }
        bins
    };
    if items.len() < PARALLEL_PASS {
        return pass(items);
    }
    items.par_chunks(PASS_CHUNK).map(pass).reduce(
        || NO_BINS,
        |a, b| std::array::from_fn(|axis| std::array::from_fn(|bin| a[axis][bin].union(&b[axis][bin]))),
    )
}

/// Move the items for which `is_left` holds to the front and return their number.
fn partition(items: &mut [Item], is_left: impl Fn(&Item) -> bool) -> usize {
    let (mut begin, mut end) = (0, items.len());
    loop {
        while begin < end && is_left(&items[begin]) {
            begin += 1;
        }
        while begin < end && !is_left(&items[end - 1]) {
            end -= 1;
        }
        if begin == end {
            return begin;
        }
        items.swap(begin, end - 1);
    }
}

/// Halve the items at the median centre of the longest axis, equal centres by their index.
fn split_at_median(items: &mut [Item], centres: &Bounds) -> usize {
    let extent = |k: &usize| centres.max[*k] as f64 - centres.min[*k] as f64;
    let axis = (0..3).max_by(|a, b| extent(a).total_cmp(&extent(b))).unwrap_or(0);
    let middle = items.len() / 2;
    items.select_nth_unstable_by(middle, |a, b| {
        let by_centre = a.centre()[axis].total_cmp(&b.centre()[axis]);
        by_centre.then(a.index.cmp(&b.index))
    });
    middle
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
