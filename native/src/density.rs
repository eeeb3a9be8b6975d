// SPDX-License-Identifier: GPL-3.0-or-later
//! Density estimation as in glsl/lib/density.glsl: the photon map, gathering.

use rayon::prelude::*;

use crate::InvalidInput;
use crate::cuts::Cuts;
use crate::filter::{Filter, INNER_AREA, SAME_ORIENTATION};
use crate::lanes::{COUNTING, Lanes, Row, WIDTH, widest};
use crate::packing::unpack_direction;
use crate::photons::{self, Grid};
use crate::radius::RadiusField;
use crate::vector::from_frame;

const BLOCK: usize = 128; // groups
const POINTS_A_TASK: usize = 256;

/// Eight photons in order of their cells, a row a quantity: together in memory where they are together in
/// space. A group may span cells, and the last one is filled up with zeros.
struct Group {
    position: [Row; 3], // [scene units]
    surface: Row,       // its number plus one
    normal: [Row; 3],   // of the surface, a unit vector
    flux: [Row; 3],     // [W]
}

/// A pass's photons, sorted into the cells of a grid.
pub struct PhotonMap {
    grid: Grid,
    cell_start: Vec<u32>,
    groups: Vec<Group>,
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
        let groups = order.par_chunks(WIDTH).map(|photons| Group::of(photons, places, deposits)).collect();
        Ok(PhotonMap { grid, cell_start, groups })
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

impl Group {
    /// Photons by their numbers, eight or, at the end, fewer.
    fn of(photons: &[u32], places: &[[f32; 4]], deposits: &[[f32; 4]]) -> Group {
        let none = Row([0.0; WIDTH]);
        let mut group = Group { position: [none; 3], surface: none, normal: [none; 3], flux: [none; 3] };
        for (lane, &photon) in photons.iter().enumerate() {
            let (place, deposit) = (&places[photon as usize], &deposits[photon as usize]);
            let normal = unpack_direction(deposit[3]);
            for axis in 0..3 {
                group.position[axis].0[lane] = place[axis];
                group.normal[axis].0[lane] = normal[axis];
                group.flux[axis].0[lane] = deposit[axis];
            }
            group.surface.0[lane] = place[3];
        }
        group
    }
}

/// A visible point whose photons are summed up.
struct Point {
    position: [f32; 3],
    surface: f32,
    normal: [f32; 3],
    cuts: Cuts,
    radius: f32,
    /// The first and last cell along each axis in which its photons may be.
    cells: [(usize, usize); 3],
}

/// Both cuts as vectors of the space about a normal.
#[inline(always)]
fn directions(normal: [f32; 3], [ax, ay, bx, by]: Cuts) -> [[f32; 3]; 2] {
    [from_frame(normal, [ax, ay, 0.0]), from_frame(normal, [bx, by, 0.0])]
}

#[inline(always)]
fn dot<L: Lanes>(a: [L; 3], b: [L; 3]) -> L {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Over the photons about a point, the filter times flux, and the inner filter times the channels' sum, but
/// for constants. The filter is a constant where this is called: to ask for it at each group of photons takes
/// longer.
#[inline(always)]
fn sums_about<L: Lanes>(map: &PhotonMap, point: &Point, filter: Filter) -> [f32; 4] {
    let is_cut = point.cuts != [0.0; 4];
    let [in_x, in_y, in_z] = point.cells;
    let r2 = point.radius * point.radius;
    let (square, inverse) = (L::splat(r2), L::splat(1.0 / r2));
    let (position, normal) = (L::splat3(point.position), L::splat3(point.normal));
    let [a, b] = directions(point.normal, point.cuts);
    let (first, second) = (L::splat3(a), L::splat3(b));
    let (none, one) = (L::splat(0.0), L::splat(1.0));
    let (mut red, mut green, mut blue, mut inner) = (none, none, none, none);
    for row_z in in_z.0..=in_z.1 {
        for row_y in in_y.0..=in_y.1 {
            let row = (row_z * map.grid.cells[1] + row_y) * map.grid.cells[0];
            let begin = map.cell_start[row + in_x.0] as usize;
            let end = map.cell_start[row + in_x.1 + 1] as usize;
            let first_group = begin / WIDTH;
            let groups = &map.groups[first_group..end.div_ceil(WIDTH)];
            let mut next = first_group * WIDTH;
            // Sums of sums: millions of equal numbers, added up one by one, are all rounded to
            // the same side.
            for block in groups.chunks(BLOCK) {
                let (mut r, mut g, mut b, mut i) = (none, none, none, none);
                for photons in block {
                    let number = next; // of its first photon
                    next += WIDTH;
                    let [x, y, z] = L::load3(&photons.position);
                    let offset = [x - position[0], y - position[1], z - position[2]];
                    let d2 = dot(offset, offset);
                    let mut near = d2.less_equal(square);
                    if L::bits(near) == 0 {
                        continue;
                    }
                    if number < begin || next > end {
                        // The row of cells begins or ends within the group.
                        let [from, to] = [begin, end].map(|x| (x as isize - number as isize) as f32);
                        let lane = L::load(&COUNTING);
                        near = near & L::splat(from).less_equal(lane) & lane.less(L::splat(to));
                    }
                    if is_cut {
                        near = near & !(one.less(dot(offset, first)) | one.less(dot(offset, second)));
                    }
                    near = near
                        & L::load(&photons.surface).equal(L::splat(point.surface))
                        & L::splat(SAME_ORIENTATION).less_equal(dot(L::load3(&photons.normal), normal));
                    let x2 = d2 * inverse;
                    let weight = filter.shapes(x2).keep(near);
                    let flux = L::load3(&photons.flux);
                    r = r + flux[0] * weight;
                    g = g + flux[1] * weight;
                    b = b + flux[2] * weight;
                    let inside = near & x2.less_equal(L::splat(INNER_AREA));
                    let weight = filter.shapes(x2 * L::splat(1.0 / INNER_AREA)).keep(inside);
                    i = i + (flux[0] + flux[1] + flux[2]) * weight;
                }
                (red, green, blue, inner) = (red + r, green + g, blue + b, inner + i);
            }
        }
    }
    [red.sum(), green.sum(), blue.sum(), inner.sum()]
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
        let points = places.iter().zip(facings).zip(cuts);
        for (((&[x, y, z, surface], facing), &cuts), out) in points.zip(out) {
            *out = [0.0; 4];
            if surface == 0.0 {
                continue;
            }
            let normal = [facing[0], facing[1], facing[2]];
            let radius = radii.at([x, y, z], normal) * shrink;
            if radius <= 0.0 {
                continue; // no normal
            }
            let reach = (map.reach(x, 0, radius), map.reach(y, 1, radius), map.reach(z, 2, radius));
            let (Some(in_x), Some(in_y), Some(in_z)) = reach else { continue };
            let cells = [in_x, in_y, in_z];
            let point = Point { position: [x, y, z], surface, normal, cuts, radius, cells };
            let sums = match filter {
                Filter::Constant => sums_about::<L>(map, &point, Filter::Constant),
                Filter::Cone => sums_about::<L>(map, &point, Filter::Cone),
                Filter::Gaussian => sums_about::<L>(map, &point, Filter::Gaussian),
                Filter::Epanechnikov => sums_about::<L>(map, &point, Filter::Epanechnikov),
            };
            let peak = filter.peak(radius * radius);
            let inner = sums[3] * (peak / INNER_AREA / 3.0);
            *out = [sums[0] * peak, sums[1] * peak, sums[2] * peak, inner];
        }
    }
}
