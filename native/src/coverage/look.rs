// SPDX-License-Identifier: GPL-3.0-or-later
//! What a probe of the coverage finds of a point's surface.

use super::{PHOTONS_LAND, Triangles};
use crate::cuts::{Cuts, Tilt, reach2};
use crate::filter::{Filter, SAME_ORIENTATION};
use crate::lanes::Lanes;
use crate::own::Own;
use crate::packing::{pack_direction, unpack_direction};
use crate::trace::Tree;
use crate::vector::{dot, normal_of, point_in, sin_cos_of_turns};
use crate::watertight::{Ray, SURFACE_OFFSET};
use crate::wide::Stack;

const MOST_LAYERS: usize = 16; // that a probe may pass through
/// Layers so near to each other are one: of surfaces in one place rays meet the first.
pub(crate) const ONE_LAYER: f32 = 4.0 * SURFACE_OFFSET;
/// What is so near below another layer, over how far from the plane a probe begins, touches it.
pub(crate) const TOUCHES: f32 = 0.02;
const LEVEL: f32 = 2.0e-3; // slope of a quad at most, and what rounding adds
const FLAT: f32 = 0.02; // slope up to which a surface is taken for the nearest layer at once

/// Where a point's surface is probed, and with what it is compared.
pub(super) struct Point {
    pub(super) position: [f32; 3],
    pub(super) normal: [f32; 3],
    pub(super) tangent: [f32; 3],
    pub(super) bitangent: [f32; 3],
    pub(super) surface: f32,
    pub(super) radius: f32,
    pub(super) cuts: Cuts,
    pub(super) tilts: [Tilt; 2],
}

/// What probes sample of the mass of the tilted filter and of the inner one beyond the own polygon, and what of it they
/// find; and what of either they find on other layers.
pub(super) struct Probed {
    pub(super) sums: [[f32; 2]; 2],
    pub(super) layers: [f32; 2],
}

impl Probed {
    pub(super) const NONE: Probed = Probed { sums: [[0.0; 2]; 2], layers: [0.0; 2] };

    /// Add one of `count` probes to their mean.
    #[inline(always)]
    pub(super) fn add(&mut self, one: Probed, count: u32) {
        for k in 0..2 {
            self.sums[k] = std::array::from_fn(|i| self.sums[k][i] + one.sums[k][i] / count as f32);
            self.layers[k] += one.layers[k] / count as f32;
        }
    }
}

/// What a probe met before, from above.
#[derive(Clone, Copy)]
pub(super) struct Layer {
    pub(super) above: f32, // the plane
    pub(super) is_opaque: bool,
    /// Below it one is in a solid.
    pub(super) is_top: bool,
}

impl Layer {
    pub(super) const NONE: Layer = Layer { above: f32::INFINITY, is_opaque: false, is_top: false };

    /// Whether no light falls on the next layer: it is in a solid, as a leg in a seat, of whose outside a point
    /// is, or touches what is above it, as a board on another.
    #[inline(always)]
    fn hides(&self, above: f32, height: f32, is_outside: bool) -> bool {
        self.is_opaque && ((self.is_top && is_outside) || self.above - above < TOUCHES * height)
    }
}

/// What looks for a point's surface.
pub(super) struct Look<'a, 'b> {
    pub(super) tree: &'a Tree,
    pub(super) triangles: &'a Triangles<'a>,
    pub(super) point: Point,
    pub(super) own: &'a Own,
    /// It is known where light falls on the own polygon.
    pub(super) own_is_known: bool,
    pub(super) filter: Filter,
    pub(super) stack: &'b mut Stack,
}

impl Look<'_, '_> {
    /// Sample the filter within the cuts, and look for the surface there where that is not the own polygon
    /// (glsl/kernels/coverage.glsl): the nearest layer, and, `others` times, what else is met; 0: that is not looked for.
    #[inline(always)]
    pub(super) fn probe<L: Lanes>(&mut self, [radial, turns]: [f32; 2], others: f32) -> Probed {
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
