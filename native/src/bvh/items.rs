// SPDX-License-Identifier: GPL-3.0-or-later
//! Which triangles a tree is built over, and their boxes.

use rayon::prelude::*;

use super::{MAX_COORDINATE, PASS_CHUNK};
use crate::InvalidInput;
use crate::bounds::Bounds;

#[derive(Debug, Clone, Copy)]
pub(super) struct Item {
    pub(super) bounds: Bounds,
    pub(super) index: u32,
}

impl Item {
    /// Twice the centre of the bounds.
    #[inline]
    pub(super) fn centre(&self) -> [f32; 4] {
        let Bounds { min, max } = &self.bounds;
        [min[0] + max[0], min[1] + max[1], min[2] + max[2], 0.0]
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
pub(super) struct Kept {
    pub(super) items: Vec<Item>,
    pub(super) not_finite: usize,
    pub(super) degenerate: usize,
}

pub(super) fn keep(vertices: &[[f32; 3]], triangles: &[[i32; 3]], first: usize) -> Kept {
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
