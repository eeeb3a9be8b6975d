// SPDX-License-Identifier: GPL-3.0-or-later
//! The share of the filter on each visible point's own surface and within its cuts, as glsl/kernels/coverage.glsl.

mod look;

use rayon::prelude::*;

use crate::cuts::{self, Tilt};
use crate::faces::Face;
use crate::filter::{Filter, INNER_AREA};
use crate::lanes::widest;
use crate::own::Own;
use crate::radius::RadiusField;
use crate::random::{DIMENSION_COVERAGE, DIMENSION_EXPECTED, r2_sequence, random4, second_sequence};
use crate::trace::Tree;
use crate::vector::frame_about;
use crate::wide::Stack;
use look::{Layer, Look, Point, Probed};
pub(crate) use look::{ONE_LAYER, TOUCHES};

/// Flags of glsl/lib/triangle.glsl.
const OPAQUE: u8 = 1;
const PHOTONS_LAND: u8 = 2;
/// Every so many-th probe looks for all layers, of which those that are not the nearest count as much more.
const LOOKS: u32 = 8;
/// Times as many probes where the filter is tilted, by a scale of more than this (the reason is in
/// glsl/kernels/coverage.glsl).
const TILTED: u32 = 4;
const MUCH: f32 = 1.5;
/// A probe is uncertain whose variance is so much of the squared coverage; and how many times as many more are then sent.
const UNCERTAIN: f32 = 3.0;
const MORE: u32 = 2;
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
    /// Probes more, that tell what is expected of the coverage; 0: cuts alone tell.
    pub expecting: u32,
    /// At least so much is expected.
    pub least_expected: f32,
    pub depth: u32,
    /// Pixels a row of the frame.
    pub frame_width: usize,
}

impl Probes {
    /// Whether a point needs more probes (glsl/kernels/coverage.glsl). `rest`: the filter's mass that is not on its
    /// polygon, of which so many probes as were `asked` found a share.
    fn is_uncertain(&self, own: f32, rest: f32, share: f32, asked: f32) -> bool {
        let share = (share * asked + 0.5) / (asked + 1.0);
        let covered = own + rest * share;
        self.expecting > 0 && rest * share * (1.0 - share) > UNCERTAIN * covered * covered
    }

    /// What scales the tilted filter (glsl/kernels/coverage.glsl): 1 over what is expected of the coverage. `own`: the
    /// untilted filter's mass on the polygon, of `left` within the cuts.
    #[inline(always)]
    fn scale(&self, known: f32, left: f32, own: f32, share: f32, asked: f32) -> f32 {
        if self.expecting == 0 {
            return 1.0 / known;
        }
        let share = (asked * share + 1.0 - own) / (asked + 1.0);
        1.0 / (own + (left - own).max(0.0) * share).max(self.least_expected)
    }
}

/// Where two of a pixel's sequences start.
#[inline(always)]
fn starts_of(probes: &Probes, pass_index: u32, pixel: u32, dimension: u32) -> [[f32; 2]; 2] {
    let [x, y, z, w] = random4(probes.seed, pass_index, pixel, dimension.wrapping_add(probes.depth));
    [[x, y], [z, w]]
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

/// In leaf order, the fourth number of whose second corner is the surface.
pub struct Triangles<'a> {
    pub corners: &'a [[[f32; 4]; 3]],
    /// As [`crate::faces::faces`] tells; none: no triangle bounds a solid, and none makes a quad with another.
    pub faces: &'a [Face],
    /// OPAQUE and PHOTONS_LAND, of materials; none: all have PHOTONS_LAND alone.
    pub flags: &'a [u8],
}

impl Triangles<'_> {
    /// Whether a solid is behind a triangle, seen from one of its sides, or in front of it; 0: neither.
    #[inline(always)]
    fn behind(&self, position: i32, side: f32) -> f32 {
        side * (self.face(position)[3] % 4.0 - 1.0)
    }

    #[inline(always)]
    fn face(&self, position: i32) -> Face {
        self.faces.get(position as usize).copied().unwrap_or([0.0, 0.0, 0.0, 1.0])
    }

    /// What a point is known to be on, of its triangle's position.
    #[inline(always)]
    fn own(&self, position: i32, point: &Point) -> Own {
        let corners = usize::try_from(position).ok().and_then(|at| self.corners.get(at));
        corners.map_or(Own::NONE, |corners| {
            let frame = (point.tangent, point.bitangent);
            Own::of(corners, self.face(position), position, point.surface.signum(), point.position, frame)
        })
    }

    #[inline(always)]
    fn flags_of(&self, position: i32) -> u8 {
        self.flags.get(position as usize).copied().unwrap_or(PHOTONS_LAND)
    }

    /// What a probe has met that is a triangle seen from one of its sides.
    #[inline(always)]
    fn layer(&self, above: f32, position: i32, side: f32) -> Layer {
        let is_opaque = self.flags_of(position) & OPAQUE != 0;
        Layer { above, is_opaque, is_top: self.behind(position, side) > 0.0 }
    }
}

/// Write the share of the filter's mass on the surface (glsl/kernels/coverage.glsl) into `out`, then the inner
/// filter's, and what scales either; into `tilt_out` how either is tilted.
#[allow(clippy::too_many_arguments)]
pub fn coverage(
    tree: &Tree,
    triangles: &Triangles,
    radii: &RadiusField,
    points: &Points,
    probes: &Probes,
    out: &mut [[f32; 4]],
    tilt_out: &mut [[f32; 4]],
) {
    let both = out.par_chunks_mut(POINTS_A_TASK).zip(tilt_out.par_chunks_mut(POINTS_A_TASK)).enumerate();
    both.for_each(|(chunk, (out, tilt_out))| {
        chunk_of(tree, triangles, radii, points, probes, chunk * POINTS_A_TASK, out, tilt_out);
    });
}

widest! {
    #[allow(clippy::too_many_arguments)]
    fn chunk_of<L>(
        tree: &Tree,
        triangles: &Triangles,
        radii: &RadiusField,
        points: &Points,
        probes: &Probes,
        first: usize,
        out: &mut [[f32; 4]],
        tilt_out: &mut [[f32; 4]],
    ) {
        let mut stack = Stack::new();
        for (i, (out, tilt_out)) in out.iter_mut().zip(tilt_out).enumerate() {
            (*out, *tilt_out) = ([0.0; 4], [0.0; 4]);
            let at = first + i;
            let [x, y, z, surface] = points.places[at];
            let [nx, ny, nz, _] = points.facings[at];
            if !(surface != 0.0 && points.diffuses[at][3] > 0.0) {
                continue;
            }
            let normal = [nx, ny, nz];
            let (tangent, bitangent) = frame_about(normal);
            let cuts = points.cuts[at];
            let radius = radii.at([x, y, z], normal) * probes.radius_scale;
            let radius = cuts::cut_radius(radius, probes.radius_scale, cuts);
            let [column, row, ..] = points.pixels[at];
            let pixel = (row as usize * probes.frame_width + column as usize) as u32;
            let [start, turns_start] = starts_of(probes, 0, pixel, DIMENSION_COVERAGE);
            let pass_number = probes.first / probes.count.max(1);
            let position = [x, y, z];
            let tilts = [Tilt::NONE; 2];
            let mut point = Point { position, normal, tangent, bitangent, surface, radius, cuts, tilts };
            let own = triangles.own(points.shadings[at][3] as i32, &point);
            let own_is_known = own.is_known(radius);
            let (is_held, sides) = (own_is_known && own.holds_disc(radius), own.cuts());
            if cuts != cuts::NONE {
                let turns = r2_sequence(start, probes.first);
                let others = if is_held { None } else { Some(&sides) };
                point.tilts = cuts::tilts(cuts, others, radius, probes.filter, turns);
            }
            let (mut own_moments, mut own_masses) = ([[0.0; 3]; 2], [0.0; 2]);
            if !is_held && own_is_known && probes.expecting > 0 {
                // What the sums are divided by does not depend on what is averaged.
                let [turn, other_turn] = second_sequence(turns_start, pass_number);
                own_moments = sides.moments(cuts, radius, probes.filter, turn);
                own_masses = sides.masses(cuts, radius, probes.filter, other_turn);
            }
            let times = if point.tilts[0].scale > MUCH { TILTED } else { 1 };
            let (count, first_probe) = (probes.count * times, probes.first.wrapping_mul(times));
            let [outer, inner] = point.tilts;
            let (filter, stack) = (probes.filter, &mut stack);
            let mut look = Look { tree, triangles, point, own: &own, own_is_known, filter, stack };
            let asked = if is_held { 0 } else { probes.expecting };
            let mut told = Probed::NONE;
            if asked > 0 {
                let [start, _] = starts_of(probes, probes.first, pixel, DIMENSION_EXPECTED);
                look.point.tilts = [Tilt::NONE; 2];
                for number in 0..asked {
                    told.add(look.probe::<L>(r2_sequence(start, number), 0.0), asked);
                }
                look.point.tilts = [outer, inner];
            }
            let shares = told.sums.map(|[sampled, found]| if sampled > 0.0 { (found / sampled).min(1.0) } else { 1.0 });
            let (asked, known) = (told.sums.map(|sum| sum[0] * asked as f32), own_masses[0]);
            let more = if !is_held && probes.is_uncertain(known, outer.left - known, shares[0], asked[0]) {
                MORE * count
            } else {
                0
            };
            let mut sent = Probed::NONE;
            for probe in 0..count {
                let number = first_probe.wrapping_add(probe);
                let others = if number % LOOKS == 0 { LOOKS as f32 } else { 0.0 };
                if is_held && others == 0.0 {
                    continue;
                }
                sent.add(look.probe::<L>(r2_sequence(start, number), others), count + more);
            }
            for probe in 0..more {
                let u = r2_sequence(second_sequence(start, probe + 1), pass_number);
                sent.add(look.probe::<L>(u, 0.0), count + more);
            }
            let share_and_scale = |tilt: &Tilt, radius: f32, k: usize| {
                let [sampled, found] = sent.sums[k];
                let found = found + sent.layers[k] * ((count + more) as f32 / count as f32);
                let own = tilt.mass_of(own_moments[k], radius);
                let scale = probes.scale(tilt.known, tilt.left, own_masses[k], shares[k], asked[k]);
                [(own + shares[k] * (tilt.mass - own - sampled) + found) * scale, tilt.scale * scale]
            };
            let [share, scale] = share_and_scale(&outer, radius, 0);
            let [inner_share, inner_scale] = share_and_scale(&inner, radius * INNER_AREA.sqrt(), 1);
            *out = [share, inner_share, scale, inner_scale];
            *tilt_out = [outer.tilt[0], outer.tilt[1], inner.tilt[0], inner.tilt[1]];
        }
    }
}
