// SPDX-License-Identifier: GPL-3.0-or-later
//! Sorts photons into the cells of a grid.

use rayon::prelude::*;

use crate::InvalidInput;

pub const MAX_CELLS: usize = 1 << 27;

/// Photons go to at most 2^BUCKET_BITS runs of cells first, so that the counters of one run, and
/// the places that it is scattered to, stay in the cache.
const BUCKET_BITS: u32 = 10;
const CHUNK: usize = 1 << 16;

/// A uniform grid; cells are numbered with x fastest.
#[derive(Debug, Clone, Copy)]
pub struct Grid {
    /// The lowest corner [scene units].
    pub origin: [f32; 3],
    /// Edge length of a cell [scene units], > 0.
    pub cell_size: f32,
    /// Cells along x, y and z, at least 1 each and at most [`MAX_CELLS`] in all.
    pub cells: [usize; 3],
}

impl Grid {
    pub(crate) fn check(&self) -> Result<usize, InvalidInput> {
        if let Some(k) = self.origin.iter().position(|x| !x.is_finite()) {
            return Err(InvalidInput(format!("origin[{k}] = {} is not finite", self.origin[k])));
        }
        if !(self.cell_size > 0.0 && self.cell_size.is_finite()) {
            return Err(InvalidInput(format!("cell_size = {} is not a positive number", self.cell_size)));
        }
        if let Some(k) = self.cells.iter().position(|&n| n == 0) {
            return Err(InvalidInput(format!("cells[{k}] = 0 is not positive")));
        }
        let total = self.cells.iter().try_fold(1usize, |product, &n| product.checked_mul(n));
        total.filter(|&total| total <= MAX_CELLS).ok_or_else(|| {
            InvalidInput(format!("cells = {:?} are more than {MAX_CELLS} cells in all", self.cells))
        })
    }

    /// The cell of a finite position along each axis: floor((p - origin) / cell_size) in float32,
    /// clamped to the grid.
    #[inline]
    pub(crate) fn cell_of(&self, position: &[f32]) -> [u32; 3] {
        [0, 1, 2].map(|k| {
            // The cast truncates, saturates, and equals floor once negative values are clamped.
            let i = ((position[k] - self.origin[k]) / self.cell_size) as i32;
            (i.max(0) as u32).min(self.cells[k] as u32 - 1)
        })
    }

    /// Its number.
    #[inline]
    pub(crate) fn cell(&self, position: &[f32]) -> u32 {
        let [x, y, z] = self.cell_of(position);
        (z * self.cells[1] as u32 + y) * self.cells[0] as u32 + x
    }
}

/// Sort photons by cell with a stable counting sort: `order[cell_start[c] .. cell_start[c + 1]]`
/// are the photons of cell c, in ascending order.
///
/// `positions` holds `stride` floats a photon (at least 3), x, y and z first [scene units].
///
/// # Errors
/// A position that is not finite; a grid that is empty, too large or not finite; more photons
/// than uint32 can count.
pub fn sort(positions: &[f32], stride: usize, grid: &Grid) -> Result<(Vec<u32>, Vec<u32>), InvalidInput> {
    let cell_count = grid.check()?;
    if stride < 3 || !positions.len().is_multiple_of(stride) {
        return Err(InvalidInput(format!("positions: expected rows of at least 3 floats, got {stride}")));
    }
    let photon_count = positions.len() / stride;
    if photon_count > u32::MAX as usize {
        return Err(InvalidInput(format!("positions: {photon_count} photons do not fit uint32")));
    }

    let cell_bits = usize::BITS - (cell_count - 1).leading_zeros();
    let shift = cell_bits.saturating_sub(BUCKET_BITS);
    let bucket_count = ((cell_count - 1) >> shift) + 1;

    let mut keys = vec![0u32; photon_count];
    let counts = keys
        .par_chunks_mut(CHUNK)
        .zip(positions.par_chunks(CHUNK * stride))
        .enumerate()
        .map(|(chunk, (keys, positions))| {
            let mut counts = vec![0u32; bucket_count];
            for (i, (key, position)) in keys.iter_mut().zip(positions.chunks_exact(stride)).enumerate() {
                if let Some(k) = position[..3].iter().position(|x| !x.is_finite()) {
                    let row = chunk * CHUNK + i;
                    return Err(InvalidInput(format!(
                        "positions[{row}, {k}] = {} is not finite",
                        position[k]
                    )));
                }
                *key = grid.cell(position);
                counts[(*key >> shift) as usize] += 1;
            }
            Ok(counts)
        })
        .collect::<Vec<_>>()
        .into_iter()
        .collect::<Result<Vec<_>, _>>()?;

    let (pairs, bucket_starts) = scatter_to_buckets(&keys, &counts, bucket_count, shift);
    drop(keys);
    Ok(sort_buckets(&pairs, &bucket_starts, cell_count, shift))
}

/// (cell, photon) pairs grouped by bucket, in the order of the photons, and where buckets begin.
fn scatter_to_buckets(
    keys: &[u32],
    counts: &[Vec<u32>],
    bucket_count: usize,
    shift: u32,
) -> (Vec<(u32, u32)>, Vec<usize>) {
    let mut pairs = vec![(0u32, 0u32); keys.len()];
    let mut bucket_starts = Vec::with_capacity(bucket_count + 1);
    // Each chunk of photons owns one run in each bucket.
    let mut runs: Vec<Vec<&mut [(u32, u32)]>> =
        counts.iter().map(|_| Vec::with_capacity(bucket_count)).collect();
    let mut rest = pairs.as_mut_slice();
    for bucket in 0..bucket_count {
        bucket_starts.push(keys.len() - rest.len());
        for (counts, runs) in counts.iter().zip(&mut runs) {
            let (run, tail) = rest.split_at_mut(counts[bucket] as usize);
            runs.push(run);
            rest = tail;
        }
    }
    bucket_starts.push(keys.len());

    keys.par_chunks(CHUNK).zip(runs).enumerate().for_each(|(chunk, (keys, mut runs))| {
        let mut filled = vec![0usize; bucket_count];
        for (i, &key) in keys.iter().enumerate() {
            let bucket = (key >> shift) as usize;
            runs[bucket][filled[bucket]] = (key, (chunk * CHUNK + i) as u32);
            filled[bucket] += 1;
        }
    });
    (pairs, bucket_starts)
}

fn sort_buckets(
    pairs: &[(u32, u32)],
    bucket_starts: &[usize],
    cell_count: usize,
    shift: u32,
) -> (Vec<u32>, Vec<u32>) {
    let mut order = vec![0u32; pairs.len()];
    let mut cell_start = vec![0u32; cell_count + 1];
    cell_start[cell_count] = pairs.len() as u32;
    let mut orders = Vec::with_capacity(bucket_starts.len());
    let mut rest = order.as_mut_slice();
    for run in bucket_starts.windows(2) {
        let (bucket, tail) = rest.split_at_mut(run[1] - run[0]);
        orders.push(bucket);
        rest = tail;
    }
    cell_start[..cell_count]
        .par_chunks_mut(1 << shift)
        .zip(orders)
        .zip(bucket_starts.par_windows(2))
        .for_each(|((starts, order), run)| {
            let pairs = &pairs[run[0]..run[1]];
            let local = |cell: u32| (cell & ((1 << shift) - 1)) as usize;
            let mut next = vec![0u32; starts.len()];
            for &(cell, _) in pairs {
                next[local(cell)] += 1;
            }
            let mut sum = 0;
            for (start, next) in starts.iter_mut().zip(&mut next) {
                let count = std::mem::replace(next, sum);
                *start = run[0] as u32 + sum;
                sum += count;
            }
            for &(cell, photon) in pairs {
                let next = &mut next[local(cell)];
                order[*next as usize] = photon;
                *next += 1;
            }
        });
    (cell_start, order)
}
