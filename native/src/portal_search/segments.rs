// SPDX-License-Identifier: GPL-3.0-or-later
//! What photons went straight along, and how portals would have changed their flux.

use std::f32::consts::PI;

use crate::portals::{Portal, Seen};
use crate::vector::{Vector, dot};

/// What a surface is taken to reflect; the rest goes through portals.
const ALBEDO: f32 = 0.5;

/// From a place on a surface straight to the next one.
pub(super) struct Segment {
    pub(super) place: Vector,
    pub(super) normal: Vector,
    pub(super) direction: Vector,
    pub(super) length: f32,
    pub(super) cosine: f32,
    /// Whether it is the first one of a photon.
    pub(super) is_first: bool,
    /// What the photon adds to the variance where it ends.
    pub(super) mass: f64,
    /// What it adds there and after.
    pub(super) after: f64,
}

/// Those of photons' paths; arguments as of [`super::search`].
pub(super) fn segments_of(
    places: &[Vector],
    normals: &[Vector],
    photons: &[u32],
    masses: &[f32],
) -> Vec<Segment> {
    let mut segments: Vec<Segment> = Vec::new();
    let mut is_first = true;
    for end in 1..places.len() {
        if photons[end] != photons[end - 1] {
            is_first = true;
            continue;
        }
        let along: Vector = std::array::from_fn(|k| places[end][k] - places[end - 1][k]);
        let length = dot(along, along).sqrt().max(1.0e-9);
        let direction = along.map(|x| x / length);
        let (place, normal, mass) = (places[end - 1], normals[end - 1], f64::from(masses[end]));
        let cosine = dot(direction, normal).max(0.0);
        segments.push(Segment { place, normal, direction, length, cosine, is_first, mass, after: 0.0 });
        is_first = false;
    }
    let mut after = 0.0;
    for segment in segments.iter_mut().rev() {
        after += segment.mass;
        segment.after = after;
        if segment.is_first {
            after = 0.0;
        }
    }
    segments
}

impl Segment {
    /// How far along it the other one's line is closest.
    pub(super) fn closest_to(&self, other: &Segment) -> f32 {
        let away: Vector = std::array::from_fn(|k| other.place[k] - self.place[k]);
        let both = dot(self.direction, other.direction);
        let far = dot(away, self.direction) - both * dot(away, other.direction);
        (far / (1.0 - both * both).max(1.0e-6)).clamp(0.0, self.length)
    }
}

/// Sums over the portals that a segment's place sees.
#[derive(Clone, Copy)]
pub(super) struct PortalSums {
    /// Their solid angles [sr].
    angle: f32,
    /// The pdfs of the segment's direction through each [1/sr], times those.
    density: f32,
}

impl PortalSums {
    pub(super) const NONE: PortalSums = PortalSums { angle: 0.0, density: 0.0 };

    pub(super) fn with(self, segment: &Segment, portal: &Portal) -> PortalSums {
        match Seen::of(portal, segment.place, segment.normal) {
            None => self,
            Some(seen) => PortalSums {
                angle: self.angle + seen.angle,
                density: self.density + seen.density(segment.direction),
            },
        }
    }

    pub(super) fn sees_some(self) -> bool {
        self.angle > 0.0
    }

    /// A photon's flux that took the segment over what it is without portals.
    pub(super) fn weight(self, segment: &Segment) -> f64 {
        if self.angle <= 0.0 {
            return 1.0;
        }
        let by_cosine = ALBEDO * segment.cosine / PI;
        let all = by_cosine + (1.0 - ALBEDO) * self.density / self.angle;
        f64::from(by_cosine) / f64::from(all).max(1.0e-30)
    }
}
