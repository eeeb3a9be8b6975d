// SPDX-License-Identifier: GPL-3.0-or-later
//! Where a pass's photons start at points and spots: what generator.glsl does, with the same random numbers.

use std::f32::consts::PI;

use rayon::prelude::*;

use crate::aim;
use crate::paths::Scene;
use crate::random::{DIMENSION_LIGHT, photon_sequence, random4};
use crate::vector::{Vector, from_frame, sin_cos_of_turns};
use crate::watertight::SURFACE_OFFSET;

/// Which photons.
#[derive(Debug, Clone, Copy, Default)]
pub struct Emission {
    pub photons: u32,
    pub seed: u32,
    pub pass_index: u32,
    /// Reflections of a photon at most.
    pub bounces: u32,
    /// Whether photons are stored where they land first, too.
    pub first_hits: bool,
    /// Whether fluxes carry the direction to the light.
    pub directions: bool,
    /// Whether deposits tell no colours, but the photons' numbers.
    pub numbered: bool,
}

#[derive(Clone, Copy)]
pub(crate) struct Photon {
    pub origin: Vector,
    pub source: i32,
    pub direction: Vector,
    pub flux: Vector,
    pub number: u32,
}

/// By how much the photons of a pass are moved along the lights' shares.
pub(crate) fn shift_of(emission: &Emission) -> f32 {
    random4(emission.seed, emission.pass_index, u32::MAX, DIMENSION_LIGHT)[0]
}

/// Where photons start, and where they go to; zeros for those that do not start.
pub fn photon_starts(scene: &Scene, emission: &Emission) -> Vec<[Vector; 2]> {
    let shift = shift_of(emission);
    let start =
        |number| generate(scene, emission, number, shift).map_or([[0.0; 3]; 2], |p| [p.origin, p.direction]);
    (0..emission.photons).into_par_iter().map(start).collect()
}

/// generator.glsl
pub(crate) fn generate(scene: &Scene, emission: &Emission, number: u32, shift: f32) -> Option<Photon> {
    let share = (number as f32 + shift) / emission.photons as f32;
    let (mut low, mut high) = (0, scene.lights.len().checked_sub(1)?);
    while low < high {
        let middle = (low + high) / 2;
        if share < scene.lights[middle][3][1] { high = middle } else { low = middle + 1 }
    }
    let [[x, y, z, radius], [ax, ay, az, outer], [r, g, b, inner], [chosen, ..]] = scene.lights[low];
    if chosen <= 0.0 {
        return None;
    }
    let numbers = photon_sequence(emission.seed, emission.pass_index, number, emission.photons);
    let (u, weight) = match scene.aims.get(low) {
        Some(&[.., root]) if root > 0.0 => {
            let rest = aim::rest_of(emission.seed, emission.pass_index, number);
            aim::aimed(scene.aim_nodes, root as usize - 1, numbers, rest)
        }
        _ => (numbers, 1.0),
    };
    let versine = sample_spot(inner, outer, u[0]);
    let direction = from_frame([ax, ay, az], direction_from_versine(versine, u[1]));
    let mut lift = [0.0; 3];
    if radius > 0.0 {
        let disc = sample_disc([u[2], u[3]]);
        let up = (1.0 - disc[0] * disc[0] - disc[1] * disc[1]).max(0.0).sqrt();
        lift = from_frame(direction, [disc[0], disc[1], up].map(|x| x * radius));
    }
    let emitted = PI * (inner + outer) / (4.0 * PI) / (emission.photons as f32 * chosen) * weight;
    let position = [x, y, z];
    Some(Photon {
        origin: std::array::from_fn(|k| position[k] + lift[k] + direction[k] * SURFACE_OFFSET),
        source: -1,
        direction,
        flux: [r, g, b].map(|power| power * emitted),
        number,
    })
}

/// 1 - cos of the angle to a spotlight's axis (glsl/lights/spot.glsl).
fn sample_spot(inner: f32, outer: f32, u: f32) -> f32 {
    let fading = outer - inner;
    let x = u * (inner + 0.5 * fading);
    if x < inner {
        return x;
    }
    let rest = (1.0 - (x - inner) / (0.5 * fading)).clamp(0.0, 1.0);
    let mut t = (0.5 * rest).cbrt();
    for _ in 0..6 {
        let slope = t * t * (6.0 - 4.0 * t);
        let before = t;
        if slope > 0.0 {
            t = (t - (t * t * t * (2.0 - t) - rest) / slope).clamp(0.0, 1.0);
        }
        if t == before {
            break; // further steps would change nothing either
        }
    }
    outer - t * fading
}

pub(crate) fn direction_from_versine(v: f32, turns: f32) -> Vector {
    let sine = (v * (2.0 - v)).max(0.0).sqrt();
    let (sin, cos) = sin_cos_of_turns(turns);
    [sine * cos, sine * sin, 1.0 - v]
}

pub(crate) fn sample_disc(u: [f32; 2]) -> [f32; 2] {
    let (sin, cos) = sin_cos_of_turns(u[1]);
    [cos, sin].map(|x| x * u[0].sqrt())
}
