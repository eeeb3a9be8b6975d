// SPDX-License-Identifier: GPL-3.0-or-later
//! Density estimation as in glsl/lib/density.glsl: photons are gathered about visible points.

use rayon::prelude::*;

use crate::bent::Bent;
use crate::cuts::{Cuts, cut_radius};
use crate::filter::{Filter, INNER_AREA, ROUNDED2, SAME_ORIENTATION};
use crate::lanes::{COUNTING, Lanes, WIDTH, widest};
use crate::microfacets::Microfacets;
use crate::phong::PhongLobe;
use crate::photon_map::PhotonMap;
use crate::radius::RadiusField;
use crate::vector::from_frame;

const BLOCK: usize = 128; // groups
const POINTS_A_TASK: usize = 256;

/// Visible points as streams: positions and surfaces (0: no point), normals, cuts as [`crate::cuts::cuts`]
/// writes them, and what [`crate::coverage::coverage`] does.
#[derive(Clone, Copy)]
pub struct Points<'a> {
    pub places: &'a [[f32; 4]],
    pub facings: &'a [[f32; 4]],
    pub cuts: &'a [[f32; 4]],
    pub coverages: &'a [[f32; 4]],
    pub tilts: &'a [[f32; 4]],
    /// Shading and Base (layouts.rs), where normals are bent.
    pub bent: Option<[&'a [[f32; 4]]; 2]>,
}

/// Their lobes as streams of records (layouts.rs).
#[derive(Clone, Copy)]
pub enum Lobes<'a> {
    /// Gathered, PlainLobe and PlainPeak.
    Phong([&'a [[f32; 4]]; 3]),
    /// Gathered, RayDirection, and of each of two lobes Scaled, Based and Dipped.
    Microfacets([&'a [[f32; 4]]; 8]),
}

/// What gathers photons at a point besides Lambert's lobe.
enum Gatherer {
    Phong(PhongLobe),
    Microfacets(Microfacets),
}

impl Gatherer {
    /// None: nothing is gathered.
    fn of(lobes: &Lobes, at: usize, geometric: [f32; 3]) -> Option<Gatherer> {
        match lobes {
            Lobes::Phong(streams) => {
                let [gathered, lobe, peak] = streams.map(|stream| stream[at]);
                PhongLobe::of(gathered, lobe, peak, geometric).map(Gatherer::Phong)
            }
            Lobes::Microfacets(streams) => {
                let [gathered, [x, y, z, _], a, b, c, d, e, f] = streams.map(|stream| stream[at]);
                let records = [[a, b, c], [d, e, f]];
                Microfacets::of(gathered, &records, [-x, -y, -z], geometric).map(Gatherer::Microfacets)
            }
        }
    }

    /// The BSDF [1/sr] for light along unit vectors.
    #[inline(always)]
    fn value<L: Lanes>(&self, to_light: [L; 3]) -> [L; 3] {
        match self {
            Gatherer::Phong(lobe) => lobe.value(to_light),
            Gatherer::Microfacets(lobes) => lobes.value(to_light),
        }
    }
}

/// How far points look, and how much photons count for them.
#[derive(Clone, Copy)]
pub struct Discs<'a> {
    pub radii: &'a RadiusField,
    pub radius_scale: f32,
    pub filter: Filter,
}

/// The irradiance at visible points, and the channels' mean within the inner radius; zeros where
/// there is none (glsl/kernels/gather.glsl).
pub fn gather(map: &PhotonMap, points: &Points, discs: &Discs, out: &mut [[f32; 4]]) {
    let indices = out.par_chunks_mut(POINTS_A_TASK).enumerate();
    indices.for_each(|(chunk, out)| gather_chunk(map, points, discs, chunk * POINTS_A_TASK, out));
}

/// The same, and the radiance that the points' lobes reflect of the photons, likewise. The map has directions.
pub fn gather_lobes(
    map: &PhotonMap,
    points: &Points,
    lobes: &Lobes,
    discs: &Discs,
    out: &mut [[f32; 4]],
    reflected: &mut [[f32; 4]],
) {
    let both = out.par_chunks_mut(POINTS_A_TASK).zip(reflected.par_chunks_mut(POINTS_A_TASK)).enumerate();
    both.for_each(|(chunk, (out, reflected))| {
        gather_lobes_chunk(map, points, lobes, discs, chunk * POINTS_A_TASK, out, reflected);
    });
}

/// A visible point whose photons are summed up.
struct Point {
    position: [f32; 3],
    surface: f32,
    normal: [f32; 3],
    cuts: Cuts,
    /// Of the filter and of the inner one; what scales either.
    tilts: [f32; 4],
    scales: [f32; 2],
    radius: f32,
    /// The first and last cell along each axis in which its photons may be.
    cells: [(usize, usize); 3],
    /// Its normal, if it is not the surface's.
    bent: Option<Bent>,
}

/// Two cuts or tilts as vectors of the space about a normal.
#[inline(always)]
fn directions(normal: [f32; 3], [ax, ay, bx, by]: Cuts) -> [[f32; 3]; 2] {
    [from_frame(normal, [ax, ay, 0.0]), from_frame(normal, [bx, by, 0.0])]
}

/// Sums over the photons about a point: flux weighted by the filter, and the channels' sum weighted by the inner
/// filter, both without their constant factors; then the same of what the other lobes reflect. Called with a
/// constant filter, so that no group of photons has to branch on it. One long function: split, it took a fifth longer.
#[inline(always)]
fn sums_about<L: Lanes>(
    map: &PhotonMap,
    point: &Point,
    filter: Filter,
    lobes: Option<&Gatherer>,
) -> [[f32; 4]; 2] {
    let is_cut = point.cuts != [0.0; 4];
    let [in_x, in_y, in_z] = point.cells;
    let r2 = point.radius * point.radius;
    let (square, inverse) = (L::splat(r2), L::splat(1.0 / r2));
    let (position, normal) = (L::splat3(point.position), L::splat3(point.normal));
    let [a, b] = directions(point.normal, point.cuts);
    let (first, second) = (L::splat3(a), L::splat3(b));
    let [a, b] = directions(point.normal, point.tilts);
    let (tilt, inner_tilt) = (L::splat3(a), L::splat3(b));
    let (none, one) = (L::splat(0.0), L::splat(1.0));
    let (mut red, mut green, mut blue, mut inner) = (none, none, none, none);
    let mut reflected = [none; 4];
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
                let mut on = [none; 4];
                for photons in block {
                    let number = next; // of its first photon
                    next += WIDTH;
                    let [x, y, z] = L::load3(&photons.position);
                    let offset = [x - position[0], y - position[1], z - position[2]];
                    let d2 = L::dot(offset, offset);
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
                        near = near & !(one.less(L::dot(offset, first)) | one.less(L::dot(offset, second)));
                    }
                    let height = L::dot(offset, normal);
                    near = near
                        & (height * height * L::splat(2.0)).less_equal(d2 + L::splat(ROUNDED2))
                        & L::load(&photons.surface).equal(L::splat(point.surface))
                        & L::splat(SAME_ORIENTATION).less_equal(L::dot(L::load3(&photons.normal), normal));
                    let x2 = d2 * inverse;
                    let mut weight = filter.shapes(x2).keep(near);
                    let flux = L::load3(&photons.flux);
                    if is_cut {
                        weight = weight * (one + L::dot(offset, tilt));
                    }
                    let mut kept = one;
                    if let Some(bent) = &point.bent {
                        kept = bent.share(L::load3(&map.directions[number / WIDTH]));
                    }
                    let diffuse = weight * kept;
                    r = r + flux[0] * diffuse;
                    g = g + flux[1] * diffuse;
                    b = b + flux[2] * diffuse;
                    let inside = near & x2.less_equal(L::splat(INNER_AREA));
                    let mut inner_weight = filter.shapes(x2 * L::splat(1.0 / INNER_AREA)).keep(inside);
                    if is_cut {
                        inner_weight = inner_weight * (one + L::dot(offset, inner_tilt));
                    }
                    i = i + (flux[0] + flux[1] + flux[2]) * (inner_weight * kept);
                    if let Some(lobes) = lobes {
                        let value = lobes.value(L::load3(&map.directions[number / WIDTH]));
                        let [r, g, b] = [flux[0] * value[0], flux[1] * value[1], flux[2] * value[2]];
                        on[0] = on[0] + r * weight;
                        on[1] = on[1] + g * weight;
                        on[2] = on[2] + b * weight;
                        on[3] = on[3] + (r + g + b) * inner_weight;
                    }
                }
                (red, green, blue, inner) = (red + r, green + g, blue + b, inner + i);
                if lobes.is_some() {
                    for (sum, part) in reflected.iter_mut().zip(on) {
                        *sum = *sum + part;
                    }
                }
            }
        }
    }
    let [r, g, b, i] = reflected;
    let reflected = [r.sum(), g.sum(), b.sum(), i.sum()];
    let [outer_scale, inner_scale] = point.scales;
    let scale = [outer_scale, outer_scale, outer_scale, inner_scale];
    [[red.sum(), green.sum(), blue.sum(), inner.sum()], reflected]
        .map(|sums| std::array::from_fn(|k| sums[k] * scale[k]))
}

/// A point and what it looks for; None: no photon can be there.
#[inline(always)]
fn point_at(map: &PhotonMap, points: &Points, discs: &Discs, at: usize) -> Option<Point> {
    let [x, y, z, surface] = points.places[at];
    let [nx, ny, nz, _] = points.facings[at];
    let [_, _, scale, inner_scale] = points.coverages[at];
    let photons_land = surface != 0.0 && scale > 0.0; // not on glass, say
    if !photons_land {
        return None;
    }
    let normal = [nx, ny, nz];
    let radius = discs.radii.at([x, y, z], normal) * discs.radius_scale;
    if radius <= 0.0 {
        return None; // no normal
    }
    let cuts = points.cuts[at];
    let radius = cut_radius(radius, discs.radius_scale, cuts);
    let cells = [map.reach(x, 0, radius)?, map.reach(y, 1, radius)?, map.reach(z, 2, radius)?];
    Some(Point {
        position: [x, y, z],
        surface,
        normal,
        cuts,
        tilts: points.tilts[at],
        scales: [scale, inner_scale],
        radius,
        cells,
        bent: points.bent.and_then(|[shading, base]| Bent::of(shading[at], base[at], normal)),
    })
}

#[inline(always)]
fn sums_by_filter<L: Lanes>(
    map: &PhotonMap,
    point: &Point,
    filter: Filter,
    lobes: Option<&Gatherer>,
) -> [[f32; 4]; 2] {
    match filter {
        Filter::Constant => sums_about::<L>(map, point, Filter::Constant, lobes),
        Filter::Cone => sums_about::<L>(map, point, Filter::Cone, lobes),
        Filter::Gaussian => sums_about::<L>(map, point, Filter::Gaussian, lobes),
        Filter::Epanechnikov => sums_about::<L>(map, point, Filter::Epanechnikov, lobes),
    }
}

/// Sums times what they lack: the filter's peak.
#[inline(always)]
fn scaled([red, green, blue, inner]: [f32; 4], peak: f32) -> [f32; 4] {
    [red * peak, green * peak, blue * peak, inner * (peak / INNER_AREA / 3.0)]
}

widest! {
    fn gather_chunk<L>(map: &PhotonMap, points: &Points, discs: &Discs, first: usize, out: &mut [[f32; 4]]) {
        for (i, out) in out.iter_mut().enumerate() {
            *out = [0.0; 4];
            let Some(point) = point_at(map, points, discs, first + i) else { continue };
            let [sums, _] = sums_by_filter::<L>(map, &point, discs.filter, None);
            *out = scaled(sums, discs.filter.peak(point.radius * point.radius));
        }
    }
}

widest! {
    fn gather_lobes_chunk<L>(
        map: &PhotonMap,
        points: &Points,
        lobes: &Lobes,
        discs: &Discs,
        first: usize,
        out: &mut [[f32; 4]],
        reflected: &mut [[f32; 4]],
    ) {
        for (i, (out, reflected)) in out.iter_mut().zip(reflected).enumerate() {
            (*out, *reflected) = ([0.0; 4], [0.0; 4]);
            let at = first + i;
            let Some(point) = point_at(map, points, discs, at) else { continue };
            let peak = discs.filter.peak(point.radius * point.radius);
            if let Some(lobes) = Gatherer::of(lobes, at, point.normal) {
                let [sums, of_lobes] = sums_by_filter::<L>(map, &point, discs.filter, Some(&lobes));
                *out = scaled(sums, peak);
                *reflected = scaled(of_lobes, peak);
            } else {
                let [sums, _] = sums_by_filter::<L>(map, &point, discs.filter, None);
                *out = scaled(sums, peak);
            }
        }
    }
}
