// SPDX-License-Identifier: GPL-3.0-or-later
//! Where to split a node's triangles: between bins of their centres, by the surface area heuristic (SAH), or
//! at the median.

use rayon::prelude::*;

use super::items::Item;
use super::{PARALLEL_PASS, PASS_CHUNK};
use crate::bounds::Bounds;

const BINS: usize = 16;

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

pub(super) struct Split {
    grid: Grid,
    axis: usize,
    /// First bin on the right.
    bin: usize,
    /// Sum over both sides of half area times count.
    pub(super) cost: f64,
}

impl Split {
    #[inline]
    pub(super) fn is_left(&self, item: &Item) -> bool {
        self.grid.bin(item.centre()[self.axis], self.axis) < self.bin
    }
}

/// The cheapest split between two bins; None if all centres coincide.
pub(super) fn best_split(items: &[Item], centres: &Bounds) -> Option<Split> {
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
pub(super) fn partition(items: &mut [Item], is_left: impl Fn(&Item) -> bool) -> usize {
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
pub(super) fn split_at_median(items: &mut [Item], centres: &Bounds) -> usize {
    let extent = |k: &usize| centres.max[*k] as f64 - centres.min[*k] as f64;
    let axis = (0..3).max_by(|a, b| extent(a).total_cmp(&extent(b))).unwrap_or(0);
    let middle = items.len() / 2;
    items.select_nth_unstable_by(middle, |a, b| {
        let by_centre = a.centre()[axis].total_cmp(&b.centre()[axis]);
        by_centre.then(a.index.cmp(&b.index))
    });
    middle
}
