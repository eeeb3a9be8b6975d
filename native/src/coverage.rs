// SPDX-License-Identifier: GPL-3.0-or-later
//! The share of the filter on each visible point's own surface and within its cuts, as glsl/kernels/coverage.glsl.

use rayon::prelude::*;

use crate::cuts::{self, Cuts, Tilt, reach2};
use crate::faces::Face;
use crate::filter::{Filter, INNER_AREA, SAME_ORIENTATION};
use crate::lanes::{Lanes, widest};
use crate::own::Own;
use crate::packing::{pack_direction, unpack_direction};
use crate::radius::RadiusField;
use crate::random::{DIMENSION_COVERAGE, DIMENSION_EXPECTED, r2_sequence, random4, second_sequence};
use crate::trace::Tree;
use crate::vector::{dot, frame_about, normal_of, point_in, sin_cos_of_turns};
use crate::watertight::Ray;
use crate::watertight::SURFACE_OFFSET;
use crate::wide::Stack;

/// Flags of glsl/lib/triangle.glsl.
const OPAQUE: u8 = 1;
const PHOTONS_LAND: u8 = 2;
const MOST_LAYERS: usize = 16; // that a probe may pass through
/// Layers so near to each other are one: of surfaces in one place rays meet the first.
pub(crate) const ONE_LAYER: f32 = 4.0 * SURFACE_OFFSET;
/// Every so many-th probe looks for all layers, of which those that are not the nearest count as much more.
const LOOKS: u32 = 8;
/// What is so near below another layer, over how far from the plane a probe begins, touches it.
pub(crate) const TOUCHES: f32 = 0.02;
const LEVEL: f32 = 2.0e-3; // slope of a quad at most, and what rounding adds
const FLAT: f32 = 0.02; // slope up to which a surface is taken for the nearest layer at once
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

/// Where a point's surface is probed, and with what it is compared.
struct Point {
    position: [f32; 3],
    normal: [f32; 3],
    tangent: [f32; 3],
    bitangent: [f32; 3],
    surface: f32,
    radius: f32,
    cuts: Cuts,
    tilts: [Tilt; 2],
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

/// What probes sample of the mass of the tilted filter and of the inner one beyond the own polygon, and what of it they
/// find; and what of either they find on other layers.
struct Probed {
    sums: [[f32; 2]; 2],
    layers: [f32; 2],
}

impl Probed {
    const NONE: Probed = Probed { sums: [[0.0; 2]; 2], layers: [0.0; 2] };

    /// Add one of `count` probes to their mean.
    #[inline(always)]
    fn add(&mut self, one: Probed, count: u32) {
        for k in 0..2 {
            self.sums[k] = std::array::from_fn(|i| self.sums[k][i] + one.sums[k][i] / count as f32);
            self.layers[k] += one.layers[k] / count as f32;
        }
    }
}

/// What a probe met before, from above.
#[derive(Clone, Copy)]
struct Layer {
    above: f32, // the plane
    is_opaque: bool,
    /// Below it one is in a solid.
    is_top: bool,
}

impl Layer {
    const NONE: Layer = Layer { above: f32::INFINITY, is_opaque: false, is_top: false };

    /// Whether no light falls on the next layer: it is in a solid, as a leg in a seat, of whose outside a point
    /// is, or touches what is above it, as a board on another.
    #[inline(always)]
    fn hides(&self, above: f32, height: f32, is_outside: bool) -> bool {
        self.is_opaque && ((self.is_top && is_outside) || self.above - above < TOUCHES * height)
    }
}

/// What looks for a point's surface.
struct Look<'a, 'b> {
    tree: &'a Tree,
    triangles: &'a Triangles<'a>,
    point: Point,
    own: &'a Own,
    /// It is known where light falls on the own polygon.
    own_is_known: bool,
    filter: Filter,
    stack: &'b mut Stack,
}

impl Look<'_, '_> {
    /// Sample the filter within the cuts, and look for the surface there where that is not the own polygon
    /// (glsl/kernels/coverage.glsl): the nearest layer, and, `others` times, what else is met; 0: that is not looked for.
    #[inline(always)]
    fn probe<L: Lanes>(&mut self, [radial, turns]: [f32; 2], others: f32) -> Probed {
        let (point, filter) = (&self.point, self.filter);
        let (sin, cos) = sin_cos_of_turns(turns);
        let within = filter.mass_within(reach2(point.cuts, point.radius, [cos, sin]));
        let x2 = filter.sample(radial * within);
        let away = (x2 * (point.radius * point.radius)).sqrt();
        let at = [cos * away, sin * away];
        let is_own = self.own_is_known && self.own.holds(at);
        if is_own && others == 0.0 {
            return Probed::NONE;
        }
        let [mass, inner_mass] = filter.shape_and_inner(x2);
        let mass = mass.max(1.0e-30);
        let tilted: [f32; 2] = std::array::from_fn(|k| point.tilts[k].at(at));
        let sampled = [within * tilted[0], within * tilted[1] * inner_mass / mass];
        let [nearest, rest] = self.layers::<L>(at, away, mass / within, is_own, others > 0.0);
        let sums = if is_own { [[0.0; 2]; 2] } else { std::array::from_fn(|k| [sampled[k], nearest[k]]) };
        Probed { sums, layers: rest.map(|x| others * x) }
    }

    /// The tilted filter at a place, and the inner one, over the density by which a probe found it.
    #[inline(always)]
    fn tilted_share(&self, place: [f32; 3], density: f32) -> [f32; 2] {
        let point = &self.point;
        let r2 = point.radius * point.radius;
        let offset: [f32; 3] = std::array::from_fn(|k| place[k] - point.position[k]);
        let at = dot(offset, offset);
        let on_surface = if at > r2 { [0.0; 2] } else { self.filter.shape_and_inner(at / r2) };
        let there = [dot(offset, point.tangent), dot(offset, point.bitangent)];
        std::array::from_fn(|k| on_surface[k] * point.tilts[k].at(there) / density)
    }

    /// What the layer of the surface that is nearest to the plane counts, and, if `all` are looked for, what the others
    /// do. As photons do, all of those on the point's side count, but hidden ones. `is_own`: on the point's own
    /// polygon, which is then the nearest, and needs no ray.
    #[inline(always)]
    fn layers<L: Lanes>(
        &mut self,
        [x, y]: [f32; 2],
        away: f32,
        density: f32,
        is_own: bool,
        all: bool,
    ) -> [[f32; 2]; 2] {
        let (point, triangles, own) = (&self.point, self.triangles, self.own);
        let normal = point.normal;
        let height = away + SURFACE_OFFSET; // within 45 degrees a surface strays no further
        let mut origin: [f32; 3] = std::array::from_fn(|k| {
            point.position[k] + x * point.tangent[k] + y * point.bitangent[k] + normal[k] * height
        });
        let (mut nearness, mut source) = if is_own { (0.0, own.triangle) } else { (f32::INFINITY, -1) };
        let (mut nearest, mut others) = ([0.0; 2], [0.0; 2]);
        let (mut left, mut above, mut before) = (2.0 * height, height, Layer::NONE);
        let on_plane = triangles.layer(0.0, own.triangle, point.surface.signum());
        let is_outside = triangles.behind(own.triangle, point.surface.signum()) >= 0.0;
        for _ in 0..MOST_LAYERS {
            let Some(ray) = Ray::new(origin, normal.map(|n| -n)) else { break };
            let Some((position, hit)) = self.tree.closest::<L>(&ray, left, source, |_| true, self.stack)
            else {
                break;
            };
            let triangle = &triangles.corners[position as usize];
            let geometric = normal_of(triangle);
            let side = if dot(geometric, normal) < 0.0 { -1.0 } else { 1.0 }; // the one the ray came from
            let geometric = geometric.map(|n| n * side);
            above -= hit.t;
            left -= hit.t;
            // Asked of the normal as photons carry it, so that they and the coverage agree at 45 degrees.
            let carried = unpack_direction(pack_direction(geometric));
            if is_own && above < 0.0 && before.above > 0.0 {
                before = on_plane;
            }
            let is_own_layer = is_own && above.abs() < ONE_LAYER.max(LEVEL * height);
            let is_known = is_own_layer || (above - before.above).abs() < ONE_LAYER;
            let is_hidden = before.hides(above, height, is_outside);
            before = triangles.layer(above, position, side);
            if !(is_known || is_hidden)
                && triangles.flags_of(position) & PHOTONS_LAND != 0
                && side * (triangle[1][3] + 1.0) == point.surface
                && dot(carried, normal) >= SAME_ORIENTATION
            {
                let met = point_in(triangle, hit.u, hit.v);
                let found = self.tilted_share(met, density * dot(geometric, normal));
                let is_nearest = above.abs() < nearness;
                let other = if is_nearest { std::mem::replace(&mut nearest, found) } else { found };
                others = std::array::from_fn(|k| others[k] + other[k]);
                nearness = nearness.min(above.abs());
                if !all {
                    if above <= FLAT * height {
                        break;
                    }
                    left = 2.0 * above; // what is further below the plane is not nearer
                }
            }
            for k in 0..3 {
                origin[k] -= normal[k] * hit.t;
            }
            source = position;
        }
        [nearest, others]
    }
}
