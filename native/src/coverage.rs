// SPDX-License-Identifier: GPL-3.0-or-later
//! The share of the filter on each visible point's own surface and within its cuts, as glsl/kernels/coverage.glsl.

use rayon::prelude::*;

use crate::cuts::{self, Cuts, Tilt, reach2};
use crate::filter::{Filter, SAME_ORIENTATION};
use crate::lanes::{Lanes, widest};
use crate::packing::{pack_direction, unpack_direction};
use crate::radius::RadiusField;
use crate::random::{DIMENSION_COVERAGE, DIMENSION_EXPECTED, r2_sequence, random4};
use crate::trace::{Tree, Visible};
use crate::vector::{dot, frame_about, normal_of, point_in, sin_cos_of_turns};
use crate::watertight::Ray;
use crate::watertight::SURFACE_OFFSET;
use crate::wide::Stack;

/// Flags of glsl/lib/triangle.glsl.
const OPAQUE: u8 = 1;
const PHOTONS_LAND: u8 = 2;
const MOST_LAYERS: usize = 16; // that a probe may pass through
/// Layers so near to each other are one: of surfaces in one place rays meet the first.
const ONE_LAYER: f32 = 4.0 * SURFACE_OFFSET;
/// Every so many-th probe looks for all layers, of which those that are not the nearest count as much more.
const LOOKS: u32 = 8;
/// What is so near below another layer, over how far from the plane a probe begins, touches it.
const TOUCHES: f32 = 0.02;
const FLAT: f32 = 0.02; // slope up to which a surface is taken for the nearest layer at once
/// Times as many probes where the filter is tilted, by a scale of more than this (the reason is in
/// glsl/kernels/coverage.glsl).
const TILTED: u32 = 4;
const MUCH: f32 = 1.5;
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
    /// The surface's share of the tilted filter, and what scales it (glsl/kernels/coverage.glsl); `not_expected`: what
    /// the surface lacks of the untilted one by other probes.
    #[inline(always)]
    fn share_and_scale(&self, tilt: &Tilt, mass: f32, missing: f32, not_expected: f32) -> [f32; 2] {
        let (mut found, mut over) = (1.0, tilt.known);
        if self.expecting > 0 {
            let count = self.expecting as f32;
            found = (1.0 - not_expected / tilt.left.max(1.0e-6)).clamp(0.0, 1.0);
            over = (tilt.left * (count * found + 1.0) / (count + 1.0)).max(self.least_expected);
        }
        let mass = mass + found * (tilt.mass - mass);
        [(mass - missing) / over, tilt.scale / over]
    }
}

/// Where a pixel's probes start.
#[inline(always)]
fn start_of(probes: &Probes, pass_index: u32, pixel: u32, dimension: u32) -> [f32; 2] {
    let numbers = random4(probes.seed, pass_index, pixel, dimension.wrapping_add(probes.depth));
    [numbers[0], numbers[1]]
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
    /// As [`crate::solid::solid`] tells; none: no triangle bounds one.
    pub solid: &'a [i8],
    /// OPAQUE and PHOTONS_LAND, of materials; none: all have PHOTONS_LAND alone.
    pub flags: &'a [u8],
}

impl Triangles<'_> {
    /// Whether a solid is behind a triangle, seen from one of its sides, or in front of it; 0: neither.
    #[inline(always)]
    fn behind(&self, position: i32, side: f32) -> f32 {
        side * self.solid.get(position as usize).map_or(0.0, |&solid| f32::from(solid))
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
            let radius = radii.at([x, y, z], [nx, ny, nz]) * probes.radius_scale;
            let normal = [nx, ny, nz];
            let (tangent, bitangent) = frame_about(normal);
            let cuts = points.cuts[at];
            let [column, row, ..] = points.pixels[at];
            let pixel = (row as usize * probes.frame_width + column as usize) as u32;
            let start = start_of(probes, 0, pixel, DIMENSION_COVERAGE);
            let position = [x, y, z];
            let tilts = [Tilt::NONE; 2];
            let mut point = Point { position, normal, tangent, bitangent, surface, radius, cuts, tilts };
            let own = Own::of(triangles, points.shadings[at][3] as i32, &point);
            let is_held = own.holds_disc(radius);
            if cuts != cuts::NONE {
                let sides = if is_held { None } else { Some(own.cuts()) };
                let turns = r2_sequence(start, probes.first);
                point.tilts = cuts::tilts(cuts, sides, radius, probes.filter, turns);
            }
            let times = if point.tilts[0].scale > MUCH { TILTED } else { 1 };
            let (count, first_probe) = (probes.count * times, probes.first.wrapping_mul(times));
            let (mut sent, mut expectant) = (Probed::NONE, Probed::NONE);
            for number in (0..count).map(|probe| first_probe.wrapping_add(probe)) {
                let others = if number % LOOKS == 0 { LOOKS as f32 } else { 0.0 };
                if is_held && others == 0.0 {
                    continue;
                }
                let probe = Probe { u: r2_sequence(start, number), others };
                sent.add(&probe_surface::<L>(tree, triangles, &point, &own, &probe, probes.filter, &mut stack), count);
            }
            let [outer, inner] = point.tilts;
            if !is_held && probes.expecting > 0 {
                point.tilts = [Tilt::NONE; 2];
                let start = start_of(probes, probes.first, pixel, DIMENSION_EXPECTED);
                for number in 0..probes.expecting {
                    let probe = Probe { u: r2_sequence(start, number), others: 0.0 };
                    let found = probe_surface::<L>(tree, triangles, &point, &own, &probe, probes.filter, &mut stack);
                    expectant.add(&found, probes.expecting);
                }
            }
            let [share, scale] = probes.share_and_scale(&outer, sent.mass[0], sent.missing[0], expectant.missing[0]);
            let [inner_share, inner_scale] =
                probes.share_and_scale(&inner, sent.mass[1], sent.missing[1], expectant.missing[1]);
            *out = [share, inner_share, scale, inner_scale];
            *tilt_out = [outer.tilt[0], outer.tilt[1], inner.tilt[0], inner.tilt[1]];
        }
    }
}

/// Where the filter is sampled, and how much layers count that are not the nearest to the plane; 0: they are not
/// looked for.
struct Probe {
    u: [f32; 2],
    others: f32,
}

/// What probes sample of the tilted filter's mass within the cuts and of the inner one's, and what the surface lacks
/// of it.
struct Probed {
    mass: [f32; 2],
    missing: [f32; 2],
}

impl Probed {
    const NONE: Probed = Probed { mass: [0.0; 2], missing: [0.0; 2] };

    /// Add one of `count` probes to their mean.
    #[inline(always)]
    fn add(&mut self, one: &Probed, count: u32) {
        for k in 0..2 {
            self.mass[k] += one.mass[k] / count as f32;
            self.missing[k] += one.missing[k] / count as f32;
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

/// Where in a disc's plane a probe samples the filter, within the cuts.
struct Drawn {
    at: [f32; 2],
    distance: f32,
    /// Its square over the radius's.
    x2: f32,
    /// The filter's mass in that direction within the cuts, over all of it.
    within: f32,
}

impl Drawn {
    #[inline(always)]
    fn of(point: &Point, probe: &Probe, filter: Filter) -> Drawn {
        let (sin, cos) = sin_cos_of_turns(probe.u[1]);
        let within = filter.mass_within(reach2(point.cuts, point.radius, [cos, sin]));
        let x2 = filter.sample(probe.u[0] * within);
        let distance = (x2 * (point.radius * point.radius)).sqrt();
        Drawn { at: [cos * distance, sin * distance], distance, x2, within }
    }

    /// The filter's mass there; the tilted filter and the inner one over that.
    #[inline(always)]
    fn mass_and_tilted(&self, point: &Point, filter: Filter) -> (f32, [f32; 2]) {
        let [mass, inner_mass] = filter.shape_and_inner(self.x2);
        let mass = mass.max(1.0e-30);
        let [outer, inner] = point.tilts.map(|tilt| tilt.at(self.at));
        (mass, [outer, inner * inner_mass / mass])
    }
}

/// The tilted filter at a place, and the inner one, over the density by which a probe found it.
#[inline(always)]
fn tilted_share(point: &Point, filter: Filter, place: [f32; 3], density: f32) -> [f32; 2] {
    let r2 = point.radius * point.radius;
    let offset: [f32; 3] = std::array::from_fn(|k| place[k] - point.position[k]);
    let at = dot(offset, offset);
    let on_surface = if at > r2 { [0.0; 2] } else { filter.shape_and_inner(at / r2) };
    let there = [dot(offset, point.tangent), dot(offset, point.bitangent)];
    std::array::from_fn(|k| on_surface[k] * point.tilts[k].at(there) / density)
}

/// Sample the filter within the cuts, over the density of the sampled point. As photons do, all of the surface's
/// layers on the point's side count.
#[inline(always)]
fn probe_surface<L: Lanes>(
    tree: &Tree,
    triangles: &Triangles,
    point: &Point,
    own: &Own,
    probe: &Probe,
    filter: Filter,
    stack: &mut Stack,
) -> Probed {
    let normal = point.normal;
    let drawn = Drawn::of(point, probe, filter);
    let [x, y] = drawn.at;
    let is_own = own.holds(drawn.at);
    let (mass, sampled) = drawn.mass_and_tilted(point, filter);
    let within = sampled.map(|sampled| drawn.within * sampled);
    if is_own && probe.others == 0.0 {
        return Probed { mass: within, missing: [0.0; 2] };
    }
    let height = drawn.distance + SURFACE_OFFSET; // within 45 degrees a surface strays no further
    let middle: [f32; 3] =
        std::array::from_fn(|k| point.position[k] + x * point.tangent[k] + y * point.bitangent[k]);
    let mut origin: [f32; 3] = std::array::from_fn(|k| middle[k] + normal[k] * height);
    // The point's own triangle needs no ray.
    let (mut nearest, mut away, mut source) =
        if is_own { (sampled, 0.0, own.triangle) } else { ([0.0; 2], f32::INFINITY, -1) };
    let mut others = [0.0; 2];
    let (mut left, mut above, mut before) = (2.0 * height, height, Layer::NONE);
    let on_plane = triangles.layer(0.0, own.triangle, point.surface.signum());
    let is_outside = triangles.behind(own.triangle, point.surface.signum()) >= 0.0;
    for _ in 0..MOST_LAYERS {
        let Some(ray) = Ray::new(origin, normal.map(|n| -n)) else { break };
        let Some((position, hit)) = tree.closest::<L>(&ray, left, source, Visible::TO_ALL, stack) else {
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
        let is_known = (above - before.above).abs() < ONE_LAYER || (is_own && above.abs() < ONE_LAYER);
        let is_hidden = before.hides(above, height, is_outside);
        before = triangles.layer(above, position, side);
        if !(is_known || is_hidden)
            && triangles.flags_of(position) & PHOTONS_LAND != 0
            && side * (triangle[1][3] + 1.0) == point.surface
            && dot(carried, normal) >= SAME_ORIENTATION
        {
            let met = point_in(triangle, hit.u, hit.v);
            let found = tilted_share(point, filter, met, mass * dot(geometric, normal));
            let other = if above.abs() < away { std::mem::replace(&mut nearest, found) } else { found };
            others = std::array::from_fn(|k| others[k] + other[k]);
            away = away.min(above.abs());
            if probe.others == 0.0 {
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
    let missing =
        std::array::from_fn(|k| drawn.within * (sampled[k] - nearest[k] - probe.others * others[k]));
    Probed { mass: within, missing }
}

/// The point's own triangle, on which most probes end. Seen from the point in its plane,
/// the sides with the triangle to their left: at (x, y) it is there that a x + b y + c > 0.
struct Own {
    sides: [[f32; 3]; 3],
    triangle: i32,
}

impl Own {
    const NONE: Own = Own { sides: [[0.0, 0.0, -1.0]; 3], triangle: -1 };

    #[inline(always)]
    fn of(triangles: &Triangles, triangle: i32, point: &Point) -> Own {
        let Some(corners) = usize::try_from(triangle).ok().and_then(|at| triangles.corners.get(at)) else {
            return Own::NONE;
        };
        let [p, q, r] = corners.map(|corner| {
            let away: [f32; 3] = std::array::from_fn(|k| corner[k] - point.position[k]);
            [dot(away, point.tangent), dot(away, point.bitangent)]
        });
        let side = |[ax, ay]: [f32; 2], [bx, by]: [f32; 2]| [ay - by, bx - ax, ax * by - ay * bx];
        let sides = [side(p, q), side(q, r), side(r, p)];
        let area = sides[0][2] + sides[1][2] + sides[2][2];
        Own { sides: if area < 0.0 { sides.map(|side| side.map(|x| -x)) } else { sides }, triangle }
    }

    #[inline(always)]
    fn holds(&self, [x, y]: [f32; 2]) -> bool {
        self.sides.iter().all(|[a, b, c]| a * x + b * y + c > 0.0)
    }

    /// The sides as [`Cuts`] are; of no triangle, none is left of the disc.
    fn cuts(&self) -> [[f32; 2]; 3] {
        self.sides.map(|[a, b, c]| if c > 0.0 { [-a / c, -b / c] } else { [1.0e10; 2] })
    }

    #[inline(always)]
    fn holds_disc(&self, radius: f32) -> bool {
        self.sides.iter().all(|[a, b, c]| *c > radius * (a * a + b * b).sqrt())
    }
}
