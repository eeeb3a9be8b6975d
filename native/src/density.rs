// SPDX-License-Identifier: GPL-3.0-or-later
//! Density estimation as in glsl/lib/density.glsl: the photon map, gathering.

use rayon::prelude::*;

use crate::InvalidInput;
use crate::cuts::Cuts;
use crate::filter::{Filter, INNER_AREA, SAME_ORIENTATION};
use crate::lanes::{COUNTING, Lanes, WIDTH, widest};
use crate::packing::unpack_direction;
use crate::photons::{self, Grid};
use crate::radius::RadiusField;
use crate::vector::from_frame;

const BLOCK: usize = 1024; // photons
const POINTS_A_TASK: usize = 256;

/// A pass's photons, sorted into the cells of a grid, a column a quantity.
pub struct PhotonMap {
    grid: Grid,
    cell_start: Vec<u32>,
    /// x, y, z, surface, normal's x, y, z, flux in three channels; each with WIDTH floats to spare.
    columns: [Vec<f32>; 10],
}

impl PhotonMap {
    /// `places` are positions and surfaces, `deposits` fluxes and packed normals.
    ///
    /// # Errors
    /// As [`photons::sort`]; arrays of different lengths.
    pub fn new(places: &[[f32; 4]], deposits: &[[f32; 4]], grid: Grid) -> Result<PhotonMap, InvalidInput> {
        if places.len() != deposits.len() {
            return Err(InvalidInput(format!(
                "deposits has {} rows, but places has {}",
                deposits.len(),
                places.len()
            )));
        }
        let (cell_start, order) = photons::sort(places.as_flattened(), 4, &grid)?;
        let mut columns: [Vec<f32>; 10] = std::array::from_fn(|_| vec![0.0; order.len() + WIDTH]);
        columns.par_iter_mut().enumerate().for_each(|(column, values)| {
            for (value, &photon) in values.iter_mut().zip(&order) {
                let (place, deposit) = (&places[photon as usize], &deposits[photon as usize]);
                *value = match column {
                    0..4 => place[column],
                    4..7 => unpack_direction(deposit[3])[column - 4],
                    _ => deposit[column - 7],
                };
            }
        });
        Ok(PhotonMap { grid, cell_start, columns })
    }

    /// The irradiance at visible points, and the channels' mean within the inner radius; zeros where
    /// there is none (glsl/kernels/gather.glsl).
    /// `places` are positions and surfaces (0: no point), `facings` normals, `cuts` as
    /// [`crate::cuts::cuts`] writes them; a point's radius is what `radii` says, times `shrink`.
    #[allow(clippy::too_many_arguments)]
    pub fn gather(
        &self,
        places: &[[f32; 4]],
        facings: &[[f32; 4]],
        cuts: &[[f32; 4]],
        radii: &RadiusField,
        shrink: f32,
        filter: Filter,
        out: &mut [[f32; 4]],
    ) {
        out.par_chunks_mut(POINTS_A_TASK)
            .zip(places.par_chunks(POINTS_A_TASK))
            .zip(facings.par_chunks(POINTS_A_TASK))
            .zip(cuts.par_chunks(POINTS_A_TASK))
            .for_each(|(((out, places), facings), cuts)| {
                gather_chunk(self, places, facings, cuts, radii, shrink, filter, out);
            });
    }

    /// Eight photons' entries of a column, from `at`.
    #[inline(always)]
    fn column<L: Lanes>(&self, column: usize, at: usize) -> L {
        L::load_slice(self.columns[column][at..at + WIDTH].try_into().expect("WIDTH to spare"))
    }

    /// The first and last cell along an axis that `radius` around a position may touch.
    fn reach(&self, position: f32, axis: usize, radius: f32) -> Option<(usize, usize)> {
        // The margin covers the rounding of photons to cells.
        let reach = radius * 1.00001 + 1.0e-7;
        let cell = |x: f32| ((x - self.grid.origin[axis]) / self.grid.cell_size).floor();
        let (low, high) = (cell(position - reach), cell(position + reach));
        let last = self.grid.cells[axis] - 1;
        // False for NaN.
        (low <= last as f32 && high >= 0.0).then(|| (low.max(0.0) as usize, (high as usize).min(last)))
    }
}

/// Both cuts as vectors of the space about a normal.
#[inline(always)]
fn directions(normal: [f32; 3], [ax, ay, bx, by]: Cuts) -> [[f32; 3]; 2] {
    [from_frame(normal, [ax, ay, 0.0]), from_frame(normal, [bx, by, 0.0])]
}

widest! {
    #[allow(clippy::too_many_arguments)]
    fn gather_chunk<L>(
        map: &PhotonMap,
        places: &[[f32; 4]],
        facings: &[[f32; 4]],
        cuts: &[[f32; 4]],
        radii: &RadiusField,
        shrink: f32,
        filter: Filter,
        out: &mut [[f32; 4]],
    ) {
        let cells = map.grid.cells;
        let points = places.iter().zip(facings).zip(cuts);
        for (((&[x, y, z, surface], facing), &cuts), out) in points.zip(out) {
            *out = [0.0; 4];
            let direction = [facing[0], facing[1], facing[2]];
            let radius = radii.at([x, y, z], direction) * shrink;
            let r2 = radius * radius;
            let (peak, square, inverse) = (filter.peak(r2), L::splat(r2), L::splat(1.0 / r2));
            let ranges = (map.reach(x, 0, radius), map.reach(y, 1, radius), map.reach(z, 2, radius));
            let (Some(in_x), Some(in_y), Some(in_z)) = ranges else { continue };
            if surface == 0.0 {
                continue;
            }
            let position = [L::splat(x), L::splat(y), L::splat(z)];
            let normal = [L::splat(facing[0]), L::splat(facing[1]), L::splat(facing[2])];
            let is_cut = cuts != [0.0; 4];
            let [a, b] = directions(direction, cuts);
            let first = [L::splat(a[0]), L::splat(a[1]), L::splat(a[2])];
            let second = [L::splat(b[0]), L::splat(b[1]), L::splat(b[2])];
            let (none, one) = (L::splat(0.0), L::splat(1.0));
            let (mut red, mut green, mut blue, mut inner) = (none, none, none, none);
            for row_z in in_z.0..=in_z.1 {
                for row_y in in_y.0..=in_y.1 {
                    let row = (row_z * cells[1] + row_y) * cells[0];
                    let begin = map.cell_start[row + in_x.0] as usize;
                    let end = map.cell_start[row + in_x.1 + 1] as usize;
                    // Sums of sums: millions of equal numbers, added up one by one, are all rounded to
                    // the same side.
                    for block in (begin..end).step_by(BLOCK) {
                        let (mut r, mut g, mut b, mut i) = (none, none, none, none);
                        for at in (block..end.min(block + BLOCK)).step_by(WIDTH) {
                            let dx = map.column::<L>(0, at) - position[0];
                            let dy = map.column::<L>(1, at) - position[1];
                            let dz = map.column::<L>(2, at) - position[2];
                            let d2 = dx * dx + dy * dy + dz * dz;
                            let there = L::load(&COUNTING).less(L::splat((end - at) as f32));
                            let mut near = d2.less_equal(square) & there;
                            if L::bits(near) == 0 {
                                continue;
                            }
                            if is_cut {
                                let beyond = one.less(dx * first[0] + dy * first[1] + dz * first[2])
                                    | one.less(dx * second[0] + dy * second[1] + dz * second[2]);
                                near = near & !beyond;
                            }
                            let cosine = map.column::<L>(4, at) * normal[0]
                                + map.column::<L>(5, at) * normal[1]
                                + map.column::<L>(6, at) * normal[2];
                            let same = map.column::<L>(3, at).equal(L::splat(surface))
                                & L::splat(SAME_ORIENTATION).less_equal(cosine);
                            let x2 = d2 * inverse;
                            let weight = filter.shapes(x2).keep(near & same);
                            let flux =
                                [map.column::<L>(7, at), map.column::<L>(8, at), map.column::<L>(9, at)];
                            r = r + flux[0] * weight;
                            g = g + flux[1] * weight;
                            b = b + flux[2] * weight;
                            let inside = near & same & x2.less_equal(L::splat(INNER_AREA));
                            let weight = filter.shapes(x2 * L::splat(1.0 / INNER_AREA)).keep(inside);
                            i = i + (flux[0] + flux[1] + flux[2]) * weight;
                        }
                        (red, green, blue, inner) = (red + r, green + g, blue + b, inner + i);
                    }
                }
            }
            let inner = inner.sum() * (peak / INNER_AREA / 3.0);
            *out = [red.sum() * peak, green.sum() * peak, blue.sum() * peak, inner];
        }
    }
}
