// SPDX-License-Identifier: GPL-3.0-or-later
//! The share of the filter on each visible point's own surface and within its cuts, as glsl/kernels/coverage.glsl.

use rayon::prelude::*;

use crate::cuts::{self, Tilt, reach2};
use crate::filter::{Filter, SAME_ORIENTATION};
use crate::lanes::{Lanes, widest};
use crate::outline::{Disc, Flat, lacked_by, outline};
use crate::packing::{pack_direction, unpack_direction};
use crate::radius::RadiusField;
use crate::random::{DIMENSION_COVERAGE, r2_sequence, random4};
use crate::trace::{Tree, Visible};
use crate::vector::{dot, frame_about, normal_of, point_in, sin_cos_of_turns};
use crate::watertight::Ray;
use crate::watertight::SURFACE_OFFSET;
use crate::wide::Stack;

const MOST_LAYERS: usize = 4; // other surfaces that a probe may pass through
const FLAT: f32 = 0.02; // slope up to which a surface is taken for the point's own at once
/// Times as many probes where the filter is tilted, by a scale of more than this (the reason is in
/// glsl/kernels/coverage.glsl).
const TILTED: u32 = 4;
const MUCH: f32 = 1.5;
/// Probes of a point at most, that an outline is asked for.
const MOST_PLACES: u32 = 8;
const POINTS_A_TASK: usize = 128;

/// What the probes of a pass depend on.
#[derive(Debug, Clone, Copy)]
pub struct Probes {
    /// Probes of a point.
    pub count: u32,
    /// Of the radii.
    pub radius_scale: f32,
    pub filter: Filter,
    pub seed: u32,
    /// Probes that earlier passes sent.
    pub first: u32,
    pub depth: u32,
    /// Pixels a row of the frame.
    pub frame_width: usize,
}

/// Visible points as streams: the pixels of the frame that see them, positions and surfaces (0: no point), normals,
/// something unused and the position of the triangle in leaf order, albedos and flags (0: not of interest), and the
/// cuts of [`crate::cuts`].
#[derive(Clone, Copy)]
pub struct Points<'a> {
    pub pixels: &'a [[f32; 4]],
    pub places: &'a [[f32; 4]],
    pub facings: &'a [[f32; 4]],
    pub shadings: &'a [[f32; 4]],
    pub diffuses: &'a [[f32; 4]],
    pub cuts: &'a [[f32; 4]],
}

/// Write the share of the filter's mass on the surface into `out`, then the inner filter's, and what scales
/// either; into `tilt_out` how either is tilted.
///
/// `corners` are the triangles in leaf order, whose second corner's fourth number is the surface.
#[allow(clippy::too_many_arguments)]
pub fn coverage(
    tree: &Tree,
    corners: &[[[f32; 4]; 3]],
    radii: &RadiusField,
    points: &Points,
    probes: &Probes,
    out: &mut [[f32; 4]],
    tilt_out: &mut [[f32; 4]],
) {
    let both = out.par_chunks_mut(POINTS_A_TASK).zip(tilt_out.par_chunks_mut(POINTS_A_TASK)).enumerate();
    both.for_each(|(chunk, (out, tilt_out))| {
        chunk_of(tree, corners, radii, points, probes, chunk * POINTS_A_TASK, out, tilt_out);
    });
}

widest! {
    #[allow(clippy::too_many_arguments)]
    fn chunk_of<L>(
        tree: &Tree,
        corners: &[[[f32; 4]; 3]],
        radii: &RadiusField,
        points: &Points,
        probes: &Probes,
        first: usize,
        out: &mut [[f32; 4]],
        tilt_out: &mut [[f32; 4]],
    ) {
        let (mut stack, mut found) = (Stack::new(), Vec::new());
        for (i, (out, tilt_out)) in out.iter_mut().zip(tilt_out).enumerate() {
            (*out, *tilt_out) = ([0.0; 4], [0.0; 4]);
            let at = first + i;
            let [x, y, z, surface] = points.places[at];
            let [nx, ny, nz, side] = points.facings[at];
            if !(surface > 0.0 && points.diffuses[at][3] > 0.0) {
                continue;
            }
            let radius = radii.at([x, y, z], [nx, ny, nz]) * probes.radius_scale;
            let normal = [nx, ny, nz];
            let (tangent, bitangent) = frame_about(normal);
            let cuts = points.cuts[at];
            let [column, row, ..] = points.pixels[at];
            let pixel = (row as usize * probes.frame_width + column as usize) as u32;
            let numbers = random4(probes.seed, 0, pixel, DIMENSION_COVERAGE.wrapping_add(probes.depth));
            let start = [numbers[0], numbers[1]];
            let position = [x, y, z];
            let tilts = [Tilt::NONE; 2];
            let mut disc = Disc { position, normal, tangent, bitangent, surface, side, radius, cuts, tilts };
            let own = corners.get(points.shadings[at][3] as usize).map_or(Flat::NONE, |own| Flat::of(own, &disc));
            let is_held = own.holds_disc(radius);
            if cuts != cuts::NONE {
                let sides = if is_held { None } else { Some(own.cuts()) };
                let turns = r2_sequence(start, probes.first);
                disc.tilts = cuts::tilts(cuts, sides, radius, probes.filter, turns);
            }
            let [outer, inner] = disc.tilts;
            let mut share = [outer.mass, inner.mass];
            if !is_held {
                let times = if outer.scale > MUCH { TILTED } else { 1 };
                let (count, first_probe) = (probes.count * times, probes.first.wrapping_mul(times));
                let is_outlined = count <= MOST_PLACES;
                let around = is_outlined.then(|| outline::<L>(tree, corners, &disc, &mut found, &mut stack));
                let around = around.flatten();
                if let Some(around) = around {
                    let turn = r2_sequence([numbers[2], numbers[3]], probes.first)[1];
                    let lacked = lacked_by(around, &disc, probes.filter, turn);
                    share = std::array::from_fn(|k| share[k] - lacked[k]);
                }
                for probe in 0..count {
                    let u = r2_sequence(start, first_probe.wrapping_add(probe));
                    let more = probe_surface::<L>(tree, corners, &disc, &own, around, u, probes, &mut stack);
                    share = std::array::from_fn(|k| share[k] + more[k] / count as f32);
                }
            }
            *out = [share[0], share[1], outer.scale, inner.scale];
            *tilt_out = [outer.tilt[0], outer.tilt[1], inner.tilt[0], inner.tilt[1]];
        }
    }
}

/// Sample the filter within the cuts. What of the tilted filter's mass is there on the surface, and of the inner
/// one's, less that of the outline, or of all there, over the density of the sampled disc.
#[inline(always)]
#[allow(clippy::too_many_arguments)]
fn probe_surface<L: Lanes>(
    tree: &Tree,
    corners: &[[[f32; 4]; 3]],
    disc: &Disc,
    own: &Flat,
    around: Option<&[Flat]>,
    u: [f32; 2],
    probes: &Probes,
    stack: &mut Stack,
) -> [f32; 2] {
    let (r2, normal) = (disc.radius * disc.radius, disc.normal);
    let (sin, cos) = sin_cos_of_turns(u[1]);
    let within = probes.filter.mass_within(reach2(disc.cuts, disc.radius, [cos, sin]));
    let x2 = probes.filter.sample(u[0] * within);
    let distance = (x2 * r2).sqrt();
    let (x, y) = (cos * distance, sin * distance);
    let [mass, inner_mass] = probes.filter.shape_and_inner(x2);
    let mass = mass.max(1.0e-30);
    let [outer, inner] = disc.tilts.map(|tilt| tilt.at([x, y]));
    let sampled = [outer, inner * inner_mass / mass];
    let known = around.map_or(1.0, |around| around.iter().filter(|flat| flat.holds([x, y])).count() as f32);
    if own.holds([x, y]) {
        return sampled.map(|sampled| within * (1.0 - known) * sampled);
    }
    let height = distance + SURFACE_OFFSET; // within 45 degrees a surface strays no further
    let on_plane: [f32; 3] =
        std::array::from_fn(|k| disc.position[k] + x * disc.tangent[k] + y * disc.bitangent[k]);
    let mut origin: [f32; 3] = std::array::from_fn(|k| on_plane[k] + normal[k] * height);
    let (mut left, mut above, mut source) = (2.0 * height, height, -1);
    let mut found = [0.0; 2];
    for _ in 0..MOST_LAYERS {
        let Some(ray) = Ray::new(origin, normal.map(|n| -n)) else { break };
        let Some((position, hit)) = tree.closest::<L>(&ray, left, source, Visible::TO_ALL, stack) else {
            break;
        };
        let triangle = &corners[position as usize];
        let geometric = normal_of(triangle);
        let side = if dot(geometric, normal) < 0.0 { -1.0 } else { 1.0 }; // the one the ray came from
        let geometric = geometric.map(|n| n * side);
        above -= hit.t;
        left -= hit.t;
        // Asked of the normal as photons carry it, so that they and the coverage agree at 45 degrees.
        let carried = unpack_direction(pack_direction(geometric));
        if triangle[1][3] + 1.0 == disc.surface && dot(carried, normal) >= SAME_ORIENTATION {
            let met = point_in(triangle, hit.u, hit.v);
            let offset: [f32; 3] = std::array::from_fn(|k| met[k] - disc.position[k]);
            let at = dot(offset, offset);
            let on_surface = if at > r2 { [0.0; 2] } else { probes.filter.shape_and_inner(at / r2) };
            let there = [dot(offset, disc.tangent), dot(offset, disc.bitangent)];
            let density = mass * dot(geometric, normal);
            found = std::array::from_fn(|k| on_surface[k] * disc.tilts[k].at(there) / density);
            // Of several layers the one nearest to the plane counts: in a fold of less than 45
            // degrees the first one met is the back of its other side.
            if above <= FLAT * height {
                break;
            }
            left = 2.0 * above; // as far below the plane as this one is above it
        }
        for k in 0..3 {
            origin[k] -= normal[k] * hit.t;
        }
        source = position;
    }
    std::array::from_fn(|k| within * (found[k] - known * sampled[k]))
}
