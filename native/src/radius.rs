// SPDX-License-Identifier: GPL-3.0-or-later
//! The gather radius of the first pass at every place: where photons are dense it is small.

use rayon::prelude::*;

use crate::InvalidInput;
use crate::photons::Grid;

/// How much a radius may change a step along an axis, in steps: a photon's splat of 1.78 times its
/// radius (splat.glsl) then reaches every point whose own radius reaches the photon (see [`RadiusField::new`]).
const STEEPEST: f32 = 0.25;

/// Cells along an axis of the grid that counts photons, in one of the radii's.
const FINE: usize = 2;
/// Photons in a box about a place of a plane, over those in the disc that touches its sides.
const BOX: f32 = 4.0 / std::f32::consts::PI;
/// As many photons tell a density to a seventh.
const TELLING: f32 = 50.0;
/// After about so many passes shall noise and blur be equal, where light is more uneven than UNEVEN,
/// a square. Measured on scenes of blend_scenes at 16 passes: relMSE falls by 42 % (mirror_caustic),
/// 26 % (door_ajar) and 13 % (many_lights), and stays where light is even.
const PASSES: f32 = 16.0;
const UNEVEN: f32 = 0.2;

/// Radii at the nodes of a grid, between which they are interpolated.
pub struct RadiusField {
    grid: Grid,
    /// Of each cell, x fastest: its corners' radii, x fastest, then y, then z.
    corners: Vec<[f32; 8]>,
}

impl RadiusField {
    /// The radii of discs that hold about `wanted` photons, if photons fell as they do at `places`;
    /// those beyond the grid don't count, and radii there are those at its border. At each node no
    /// less than `least`, and no more than `most` unless `least` is.
    ///
    /// The count in a box of half size h about a node stands for a plane's, (2 h)^2 times the
    /// photons a unit area. Where the closest photons are denser or less dense than those in the
    /// box, light is uneven and a disc blurs it: by a share that goes with the radius squared. Noise
    /// goes with 1 / (photons in the disc), and the radius is the one of least mean square error.
    ///
    /// Radii are then lowered until no step along an axis changes them by more than a quarter of it:
    /// |r(x) - r(y)| <= sqrt(3) / 4 |x - y|, so that r(y) <= 1.77 r(x) wherever |x - y| <= r(y).
    ///
    /// # Errors
    /// As [`crate::photons::sort`]; `least` not one number a node.
    pub fn new(
        places: &[[f32; 4]],
        grid: Grid,
        wanted: f32,
        least: &[f32],
        most: f32,
    ) -> Result<RadiusField, InvalidInput> {
        let [nx, ny, nz] = grid.cells;
        let cell_count = grid.check()?;
        for (name, value) in [("wanted", wanted), ("most", most)] {
            if !value.is_finite() {
                return Err(InvalidInput(format!("{name} = {value} is not finite")));
            }
        }
        let nodes = [nx + 1, ny + 1, nz + 1];
        if least.len() != nodes.iter().product::<usize>() {
            return Err(InvalidInput(format!(
                "least has {} numbers, the grid has {nodes:?} nodes",
                least.len()
            )));
        }
        let fine = Grid {
            origin: grid.origin,
            cell_size: grid.cell_size / FINE as f32,
            cells: grid.cells.map(|n| n * FINE),
        };
        let below = sums(places, &fine)?;
        let [fx, fy, fz] = fine.cells;
        let sum = |x: usize, y: usize, z: usize| i64::from(below[(z * (fy + 1) + y) * (fx + 1) + x]);
        // Photons in the box of half size `half` about a node, in fine cells.
        let count = |at: [usize; 3], half: usize| {
            let low = at.map(|i| i.saturating_sub(half));
            let high = [(at[0] + half).min(fx), (at[1] + half).min(fy), (at[2] + half).min(fz)];
            let slab = |x: usize| {
                sum(x, high[1], high[2]) + sum(x, low[1], low[2])
                    - sum(x, low[1], high[2])
                    - sum(x, high[1], low[2])
            };
            (slab(high[0]) - slab(low[0])) as f32 // a sum of floats would round beyond 2^24
        };
        let needed = wanted * BOX;
        let node = |x: usize, y: usize, z: usize| (z * nodes[1] + y) * nodes[0] + x;
        let mut radii = vec![0.0f32; least.len()];
        radii.par_iter_mut().enumerate().for_each(|(i, radius)| {
            let at = [i % nodes[0], i / nodes[0] % nodes[1], i / (nodes[0] * nodes[1])].map(|n| n * FINE);
            let (mut half, mut inner) = (1, None);
            let found = loop {
                let found = count(at, half);
                if inner.is_none() && found >= TELLING {
                    inner = Some((half, found));
                }
                let size = half as f32 * fine.cell_size;
                if found >= needed || size >= most || half >= fx.max(fy).max(fz) {
                    break found;
                }
                half *= 2;
            };
            let size = half as f32 * fine.cell_size;
            let mut best = size * (needed / found.max(1e-6)).sqrt();
            if let Some((inner_half, inner_found)) = inner.filter(|&(inner_half, _)| inner_half < half) {
                // The share by which photons are denser, or less dense, close by than in the whole box,
                // and what of its square is chance.
                let scale = (half / inner_half) as f32;
                let ratio = inner_found * scale * scale / found;
                let uneven = (ratio - 1.0) * (1.0 / ratio).min(1.0);
                // Continuous: a photon more or less must not change the picture.
                let square = uneven * uneven - 1.0 / inner_found - 1.0 / found - UNEVEN;
                if square > 0.0 {
                    let density = inner_found / (4.0 * (inner_half as f32 * fine.cell_size).powi(2));
                    let balanced = size.powi(4) / (2.0 * square * std::f32::consts::PI * density * PASSES);
                    best = best.min(balanced.powf(1.0 / 6.0));
                }
            }
            *radius = best.min(most).max(least[i]);
        });
        flatten(&mut radii, nodes, STEEPEST * grid.cell_size);
        let mut corners = Vec::with_capacity(cell_count);
        for z in 0..nz {
            for y in 0..ny {
                for x in 0..nx {
                    corners.push(std::array::from_fn(|i| {
                        radii[node(x + (i & 1), y + (i >> 1 & 1), z + (i >> 2))]
                    }));
                }
            }
        }
        Ok(RadiusField { grid, corners })
    }

    /// The radius at a position (glsl/lib/radius.glsl).
    #[inline]
    pub fn at(&self, position: [f32; 3]) -> f32 {
        let mut cell = [0; 3];
        let mut share = [0.0; 3];
        for k in 0..3 {
            let at = (position[k] - self.grid.origin[k]) / self.grid.cell_size;
            let at = at.max(0.0).min(self.grid.cells[k] as f32); // a NaN becomes 0
            cell[k] = (at as usize).min(self.grid.cells[k] - 1);
            share[k] = at - cell[k] as f32;
        }
        let corners = &self.corners[(cell[2] * self.grid.cells[1] + cell[1]) * self.grid.cells[0] + cell[0]];
        let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
        let z: [f32; 4] = std::array::from_fn(|i| mix(corners[i], corners[i + 4], share[2]));
        mix(mix(z[0], z[2], share[1]), mix(z[1], z[3], share[1]), share[0])
    }

    /// What the GLSL reads: eight floats a cell.
    pub fn corners(&self) -> &[[f32; 8]] {
        &self.corners
    }
}

/// Photons in the fine cells below each of their corners, along all axes.
fn sums(places: &[[f32; 4]], grid: &Grid) -> Result<Vec<u32>, InvalidInput> {
    let [nx, ny, nz] = grid.cells;
    let mut counts = vec![0u32; grid.check()?];
    for (row, place) in places.iter().enumerate() {
        if let Some(k) = place[..3].iter().position(|x| !x.is_finite()) {
            return Err(InvalidInput(format!("place[{row}, {k}] = {} is not finite", place[k])));
        }
        let inside =
            |k: usize| (0.0..=grid.cells[k] as f32).contains(&((place[k] - grid.origin[k]) / grid.cell_size));
        if (0..3).all(inside) {
            counts[grid.cell(place) as usize] += 1;
        }
    }
    let corner = |x: usize, y: usize, z: usize| (z * (ny + 1) + y) * (nx + 1) + x;
    let mut below = vec![0u32; corner(nx, ny, nz) + 1];
    for z in 0..nz {
        for y in 0..ny {
            let mut row = 0;
            for x in 0..nx {
                row += counts[(z * ny + y) * nx + x];
                below[corner(x + 1, y + 1, z + 1)] =
                    row + below[corner(x + 1, y, z + 1)] + below[corner(x + 1, y + 1, z)]
                        - below[corner(x + 1, y, z)];
            }
        }
    }
    Ok(below)
}

/// Lower radii until none exceeds a neighbour's by more than `step`: one sweep up and one down
/// suffice, since what a node may have falls off along any path of axis-parallel steps.
fn flatten(radii: &mut [f32], nodes: [usize; 3], step: f32) {
    let strides = [1, nodes[0], nodes[0] * nodes[1]];
    let place = |i: usize| [i % nodes[0], i / nodes[0] % nodes[1], i / strides[2]];
    for i in 0..radii.len() {
        for (k, at) in place(i).into_iter().enumerate() {
            if at > 0 {
                radii[i] = radii[i].min(radii[i - strides[k]] + step);
            }
        }
    }
    for i in (0..radii.len()).rev() {
        for (k, at) in place(i).into_iter().enumerate() {
            if at + 1 < nodes[k] {
                radii[i] = radii[i].min(radii[i + strides[k]] + step);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid() -> Grid {
        Grid { origin: [-1.0; 3], cell_size: 0.125, cells: [16; 3] }
    }

    /// A plane of even photons: every radius holds the number wanted.
    #[test]
    fn an_even_plane() {
        let places: Vec<[f32; 4]> = (0..256 * 256)
            .map(|i| [(i % 256) as f32 / 128.0 - 0.996, (i / 256) as f32 / 128.0 - 0.996, 0.0, 1.0])
            .collect();
        let field = RadiusField::new(&places, grid(), 300.0, &[0.0; 17 * 17 * 17], 1.0).unwrap();
        let expected = (300.0 / (std::f32::consts::PI * 128.0 * 128.0)).sqrt();
        assert!((field.at([0.1, 0.2, 0.0]) / expected - 1.0).abs() < 0.02, "{}", field.at([0.1, 0.2, 0.0]));
    }

    /// Nowhere does the radius change faster than half the way moved; `least` and `most` hold.
    #[test]
    fn changes_slowly_within_its_bounds() {
        let places: Vec<[f32; 4]> = (0..4000).map(|i| [0.5 + 1e-5 * i as f32, 0.3, -0.4, 1.0]).collect();
        let field = RadiusField::new(&places, grid(), 50.0, &[0.01; 17 * 17 * 17], 0.6).unwrap();
        let mut last = field.at([-1.0, 0.3, -0.4]);
        let (mut smallest, mut largest) = (last, last);
        for i in 1..2000 {
            let radius = field.at([-1.0 + 0.001 * i as f32, 0.3, -0.4]);
            assert!((radius - last).abs() <= 0.0005, "{last} {radius}");
            (smallest, largest, last) = (smallest.min(radius), largest.max(radius), radius);
        }
        assert!((0.01..0.05).contains(&smallest) && (0.25..0.6).contains(&largest), "{smallest} {largest}");
        assert!(field.at([f32::NAN; 3]).is_finite() && field.at([1e9; 3]).is_finite());
    }

    #[test]
    fn bad_input() {
        assert!(
            RadiusField::new(&[[f32::NAN, 0.0, 0.0, 1.0]], grid(), 1.0, &[0.0; 17 * 17 * 17], 1.0).is_err()
        );
        assert!(RadiusField::new(&[], grid(), 1.0, &[0.0; 3], 1.0).is_err());
        let none = RadiusField::new(&[], grid(), 1.0, &[0.0; 17 * 17 * 17], 0.7).unwrap();
        assert_eq!(none.at([0.0; 3]), 0.7);
    }
}
