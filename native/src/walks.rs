// SPDX-License-Identifier: GPL-3.0-or-later
//! Rays that go below surfaces, to where they come out, as glsl/lib/random_walk.glsl has it.

use rayon::prelude::*;

use crate::emission::direction_from_versine;
use crate::lanes::{Lanes, widest};
use crate::random::{DIMENSION_WALK, even_over_passes, random4};
use crate::trace::{EXIT, T_MAX, Tree};
use crate::vector::{Vector, dot, largest, normal_of, point_in};
use crate::watertight::{Ray, lift_at};
use crate::wide::Stack;

// Of glsl/lib/random_walk.glsl.
const MOST_FLIGHTS: u32 = 256;
const LEAST_OF_WALK: f32 = 1.0e-4;
const WALKS_A_RAY: u32 = 4;
const BY_WEIGHT: f32 = 0.5;
const SHORT: f32 = 0.1;
const LEAST_ALBEDO: f32 = 0.2;
// Of glsl/lib/packed_walk.glsl.
const RADII: f32 = 511.0;
const ALBEDOS: f32 = 255.0;
const OTHERS: f32 = 127.0;
const LEAST_RADIUS: f32 = 2.0e-6;
const OCTAVES: f32 = 21.0;

/// glsl/lib/constants.glsl
const NO_TRIANGLE: f32 = 16_777_215.0;
const RAYS_A_TASK: usize = 64;

/// What random numbers of rays depend on besides the pixel.
#[derive(Debug, Clone, Copy)]
pub struct Draw {
    pub seed: u32,
    pub pass_index: u32,
    pub depth: u32,
    /// Pixels a row of the frame.
    pub frame_width: usize,
}

/// Rays as streams hold them: pixels, places and the triangles that they leave, directions, what they carry, and of those
/// that go below the surface there what the walk depends on, and 1.
#[derive(Clone, Copy)]
pub struct Rays<'a> {
    pub pixels: &'a [[f32; 4]],
    pub origins: &'a [[f32; 4]],
    pub directions: &'a [[f32; 4]],
    pub throughputs: &'a [[f32; 4]],
    pub walks: &'a [[f32; 4]],
}

/// A ray that goes on: direction, origin and what it carries; zeros for none.
type GoneOn = [[f32; 4]; 3];

/// Directions, origins and throughputs of rays from where those have come out that went below; others stay as they are.
pub fn walk(tree: &Tree, corners: &[[[f32; 4]; 3]], rays: &Rays, draw: Draw, out: [&mut [[f32; 4]]; 3]) {
    let [directions, origins, throughputs] = out.map(|one| one.par_chunks_mut(RAYS_A_TASK));
    directions.zip(origins).zip(throughputs).enumerate().for_each(
        |(task, ((directions, origins), throughputs))| {
            walk_some(tree, corners, rays, draw, task * RAYS_A_TASK, [directions, origins, throughputs]);
        },
    );
}

widest! {
    fn walk_some<L>(
        tree: &Tree,
        corners: &[[[f32; 4]; 3]],
        rays: &Rays,
        draw: Draw,
        first: usize,
        out: [&mut [[f32; 4]]; 3],
    ) {
        let mut walker = Walker { tree, corners, draw, stack: &mut Stack::new() };
        let [directions, origins, throughputs] = out;
        for i in 0..directions.len() {
            let at = first + i;
            let (direction, origin, throughput) = (rays.directions[at], rays.origins[at], rays.throughputs[at]);
            let walk = rays.walks[at];
            [directions[i], origins[i], throughputs[i]] = match (drop_last(direction) == [0.0; 3], walk[3] > 0.0) {
                (true, _) => [[0.0; 4]; 3],
                (_, false) => [direction, origin, throughput],
                (_, true) => walker.go_on::<L>(rays.pixels[at], origin, direction, throughput, walk),
            };
        }
    }
}

/// Where a walk has left the surface, and what it weighs.
#[derive(Clone, Copy)]
struct Exit {
    position: Vector,
    normal: Vector,
    weight: Vector,
}

/// What walks of a ray begin with.
struct Inside {
    entry: Vector,
    geometric: Vector,
    direction: Vector,
    triangle: i32,
    surface: f32,
    extinction: Vector,
    scattering: Vector,
    weight: Vector,
    channel: usize,
    shares: Vector,
    number: u32,
}

struct Walker<'a> {
    tree: &'a Tree,
    corners: &'a [[[f32; 4]; 3]],
    draw: Draw,
    stack: &'a mut Stack,
}

impl Walker<'_> {
    #[inline(always)]
    fn go_on<L: Lanes>(
        &mut self,
        pixel: [f32; 4],
        origin: [f32; 4],
        direction: [f32; 4],
        throughput: [f32; 4],
        walk: [f32; 4],
    ) -> GoneOn {
        let number = (pixel[1] as usize * self.draw.frame_width + pixel[0] as usize) as u32;
        let triangle = origin[3] as i32;
        let Some(corners) = usize::try_from(triangle).ok().and_then(|at| self.corners.get(at)) else {
            return [[0.0; 4]; 3];
        };
        let (entry, direction, weight) = (drop_last(origin), drop_last(direction), drop_last(throughput));
        let geometric = normal_of(corners);
        let side = if dot(geometric, direction) > 0.0 { -1.0 } else { 1.0 };
        let geometric = geometric.map(|x| side * x);
        let own = Inside {
            entry,
            geometric,
            direction,
            triangle,
            surface: corners[1][3],
            extinction: [0.0; 3],
            scattering: [0.0; 3],
            weight,
            channel: 0,
            shares: [0.0; 3],
            number,
        };
        let Some(Exit { position, normal, weight }) = self.walk_below::<L>(own, drop_last(walk)) else {
            return [[0.0; 4]; 3];
        };
        if largest(weight) <= 0.0 || largest(weight).is_nan() {
            return [[0.0; 4]; 3];
        }
        let lift = lift_at(position);
        let lifted: Vector = std::array::from_fn(|k| position[k] + normal[k] * lift);
        [
            with(normal.map(|x| -x), T_MAX / f32::from(EXIT)),
            with(lifted, NO_TRIANGLE),
            with(weight, throughput[3]),
        ]
    }

    /// Of several walks of a channel one by chance, as much as each brings.
    #[inline(always)]
    fn walk_below<L: Lanes>(&mut self, mut inside: Inside, walk: Vector) -> Option<Exit> {
        let weight = inside.weight;
        let sum: f32 = weight.iter().sum();
        if sum <= 0.0 || sum.is_nan() {
            return None;
        }
        let draw = self.draw;
        let (radius, albedo) = (walk.map(radius_of_walk), walk.map(albedo_of_walk));
        let is_later = is_later_walk(walk[2]);
        let scattering = albedo.map(|x| albedo_of_scattering(x, is_later));
        let dimension = DIMENSION_WALK.wrapping_add(draw.depth.wrapping_mul(WALKS_A_RAY * MOST_FLIGHTS + 2));
        let shares = weight.map(|x| 1.0 / 3.0 + BY_WEIGHT * (x / sum - 1.0 / 3.0));
        let even = even_over_passes(draw.seed, draw.pass_index, inside.number, dimension);
        inside.channel = channel_by(shares, even[0]);
        let stays = radius.map(|x| f32::from(u8::from(x == 0.0))); // light that leaves at once
        if stays[inside.channel] > 0.0 {
            let all = dot(shares, stays);
            let weight = std::array::from_fn(|k| weight[k] * stays[k] / all);
            return Some(Exit { position: inside.entry, normal: inside.geometric, weight });
        }
        inside.weight = std::array::from_fn(|k| {
            weight[k] * (1.0 - stays[k]) / albedo[k] * (scattering[k] / LEAST_ALBEDO).min(1.0)
        });
        inside.extinction = std::array::from_fn(|k| (1.0 - stays[k]) / radius[k].max(LEAST_RADIUS));
        inside.shares = std::array::from_fn(|k| shares[k] * (1.0 - stays[k]));
        inside.scattering = scattering.map(|x| x.max(LEAST_ALBEDO));
        let [mut u, ..] = random4(draw.seed, draw.pass_index, inside.number, dimension.wrapping_add(1));
        let (mut all, mut own, mut chosen) = (0.0, 0.0, None);
        for i in 0..WALKS_A_RAY {
            let Some(found) = self.walk_once::<L>(&inside, i, dimension.wrapping_add(2 + i * MOST_FLIGHTS))
            else {
                continue;
            };
            let brings = found.weight.iter().sum::<f32>() / 3.0;
            if brings > 0.0 && is_drawn(brings, &mut all, &mut u) {
                chosen = Some(found);
                own = brings;
            }
        }
        let scale = all / (own * WALKS_A_RAY as f32);
        chosen.map(|exit| Exit { weight: exit.weight.map(|x| x * scale), ..exit })
    }

    /// The walk of a number; None where nothing comes out.
    #[inline(always)]
    fn walk_once<L: Lanes>(&mut self, inside: &Inside, walk: u32, dimension: u32) -> Option<Exit> {
        let down = lift_at(inside.entry).min(SHORT / largest(inside.extinction));
        let mut position: Vector = std::array::from_fn(|k| inside.entry[k] - inside.geometric[k] * down);
        let mut direction = inside.direction;
        // Of the light that is not absorbed, and the densities of the way by each channel, but for a factor.
        let (mut kept, mut density) = ([1.0f32; 3], [1.0f32; 3]);
        let mut source = inside.triangle;
        let least = LEAST_OF_WALK * largest(inside.weight);
        for flight in 0..MOST_FLIGHTS {
            let draw = self.draw;
            let mut u = random4(draw.seed, draw.pass_index, inside.number, dimension.wrapping_add(flight));
            if flight == 0 {
                u[1] = (walk as f32 + u[1]) / WALKS_A_RAY as f32;
            } else {
                direction = direction_from_versine(2.0 * u[2], u[3]);
            }
            let far = -(1.0 - u[1]).ln() / inside.extinction[inside.channel];
            let corners = self.corners;
            let meets = |position: i32| corners[position as usize][1][3] == inside.surface;
            // False for NaN.
            let ray = if far > 0.0 { Ray::new(position, direction) } else { None };
            let found = ray.and_then(|ray| self.tree.closest::<L>(&ray, far, source, meets, self.stack));
            let way = found.map_or(far, |(_, hit)| hit.t);
            for k in 0..3 {
                density[k] *= (-inside.extinction[k] * way).exp();
                if found.is_none() {
                    density[k] *= inside.extinction[k];
                    kept[k] *= inside.scattering[k];
                }
            }
            let most = largest(density).max(1.0e-30);
            density = density.map(|x| x / most);
            let all = dot(inside.shares, density).max(1.0e-30);
            let weight = std::array::from_fn(|k| inside.weight[k] * kept[k] * density[k] / all);
            if let Some((met, hit)) = found {
                let corners = &self.corners[met as usize];
                let normal = normal_of(corners);
                let side = if dot(normal, direction) < 0.0 { -1.0 } else { 1.0 };
                let normal = normal.map(|x| side * x);
                return Some(Exit { position: point_in(corners, hit.u, hit.v), normal, weight });
            }
            if largest(weight) <= least || largest(weight).is_nan() {
                return None;
            }
            position = std::array::from_fn(|k| position[k] + way * direction[k]);
            source = -1;
        }
        None
    }
}

fn drop_last([x, y, z, _]: [f32; 4]) -> Vector {
    [x, y, z]
}

fn with([x, y, z]: Vector, last: f32) -> [f32; 4] {
    [x, y, z, last]
}

/// glsl/lib/packed_walk.glsl
fn radius_of_walk(packed: f32) -> f32 {
    let octaves = (packed / ((ALBEDOS + 1.0) * (OTHERS + 1.0))).floor() * (OCTAVES / RADII);
    if octaves == 0.0 { 0.0 } else { LEAST_RADIUS * octaves.exp2() }
}

fn albedo_of_walk(packed: f32) -> f32 {
    ((packed / (OTHERS + 1.0)).floor() % (ALBEDOS + 1.0)).max(1.0) / ALBEDOS
}

/// Whether the walk is Blender's since 5.2, by what blue's number holds.
fn is_later_walk(packed: f32) -> bool {
    (packed % (OTHERS + 1.0)) as i32 & 2 != 0
}

/// What one scattering leaves, for surfaces of such an albedo.
fn albedo_of_scattering(albedo: f32, is_later: bool) -> f32 {
    if is_later {
        let root = (9.59217 + 41.6808 * albedo + 17.7126 * albedo * albedo).sqrt();
        let s = 4.20863 * albedo - root + 4.09712;
        return (1.0 - s * s).clamp(0.0, 0.999_999);
    }
    let few = 0.496_310_2 * (4.235_009 * albedo).atan().powf(2.406_03);
    let many = 1.826_052_4 * (5.112_468 * albedo).atan().powf(1.096_861);
    (many + albedo.powf(0.25) * (few - many)).clamp(0.0, 0.999_999)
}

/// glsl/lib/sampling.glsl
fn channel_by(shares: Vector, u: f32) -> usize {
    let chosen = u * (shares[0] + shares[1] + shares[2]);
    let channel = if chosen < shares[0] {
        0
    } else if chosen < shares[0] + shares[1] {
        1
    } else {
        2
    };
    let last = (0..3).rev().find(|&k| shares[k] > 0.0).unwrap_or(0); // by rounding
    if shares[channel] > 0.0 { channel } else { last }
}

/// glsl/lib/sampling.glsl
fn is_drawn(own: f32, all: &mut f32, u: &mut f32) -> bool {
    let others = *all;
    *all += own;
    let at = *u * *all;
    let is_taken = at < own || others == 0.0;
    *u = (if is_taken { at / own } else { (at - own) / others }).min(1.0f32.next_down());
    is_taken
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What packs them: glsl/lib/packed_walk.glsl.
    fn packed(radius: f32, albedo: f32, other: f32) -> f32 {
        let octaves = (radius.max(LEAST_RADIUS) / LEAST_RADIUS).log2() / OCTAVES;
        let steps = |x: f32, all: f32| (x.clamp(0.0, 1.0) * all + 0.5).floor();
        (steps(octaves, RADII) * (ALBEDOS + 1.0) + steps(albedo, ALBEDOS)) * (OTHERS + 1.0)
            + steps(other, OTHERS)
    }

    #[test]
    fn packing() {
        for (radius, albedo, other) in [(0.1f32, 0.2f32, 1.0), (1.9, 1.0, 0.0), (3.0e-5, 0.8, 0.5)] {
            let walk = packed(radius, albedo, other);
            assert!((radius_of_walk(walk) / radius - 1.0).abs() < 0.015, "{radius}");
            assert!((albedo_of_walk(walk) - albedo).abs() <= 0.5 / ALBEDOS, "{albedo}");
        }
        assert_eq!((radius_of_walk(packed(0.0, 0.0, 0.0)), albedo_of_walk(0.0)), (0.0, 1.0 / ALBEDOS));
    }

    #[test]
    fn scattering_of_white_and_black() {
        for is_later in [false, true] {
            assert!(albedo_of_scattering(1.0, is_later) > 0.999);
            assert!(albedo_of_scattering(1.0 / ALBEDOS, is_later) < 0.05);
        }
    }

    #[test]
    fn channels_by_their_shares() {
        assert_eq!([0.1, 0.3, 0.9].map(|u| channel_by([0.2, 0.3, 0.5], u)), [0, 1, 2]);
        assert_eq!(channel_by([0.4, 0.0, 0.0], 1.0), 0);
    }
}
