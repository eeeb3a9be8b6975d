// SPDX-License-Identifier: GPL-3.0-or-later
//! Rectangles through which photons reach what the picture shows, as glsl/lib/openings.glsl has them.

use crate::vector::{Vector, cross, dot};

/// As in addon/photon/stage/portals.py.
pub(crate) const MOST_PORTALS: usize = 4;

/// Portal of layouts.rs.
pub type Portal = [[f32; 4]; 3];

/// A portal as a place sees it: that one by the portal's frame, on the side where z is positive, and half its
/// sides; about its solid angle [sr], by which portals share photons.
pub(crate) struct Seen {
    middle: Vector,
    across: Vector,
    up: Vector,
    axis: Vector,
    place: Vector,
    half: [f32; 2],
    pub(crate) angle: f32,
}

impl Seen {
    /// None: nothing of it is above the surface, or the place is where photons shall come to.
    pub(crate) fn of(portal: &Portal, position: Vector, normal: Vector) -> Option<Seen> {
        let [[mx, my, mz, width], [cx, cy, cz, height], [ax, ay, az, _]] = *portal;
        let (middle, across, axis) = ([mx, my, mz], [cx, cy, cz], [ax, ay, az]);
        let up = cross(axis, across);
        let away: Vector = std::array::from_fn(|k| position[k] - middle[k]);
        let half = [0.5 * width, 0.5 * height];
        let place = [dot(away, across), dot(away, up), dot(away, axis)];
        let above = dot(normal, across).abs() * half[0] + dot(normal, up).abs() * half[1];
        if !(above > dot(normal, away) && place[2] > 0.0) {
            return None;
        }
        let far = dot(away, away).max(1.0e-12).sqrt();
        let angle = width * height * place[2] / (far * far * far);
        (angle > 0.0).then_some(Seen { middle, across, up, axis, place, half, angle })
    }

    /// The pdf of a direction through this portal alone [1/sr], times the portal's solid angle [sr].
    pub(crate) fn density(&self, direction: Vector) -> f32 {
        let toward = -dot(direction, self.axis);
        let far = self.place[2] / toward;
        let x = self.place[0] + far * dot(direction, self.across);
        let y = self.place[1] + far * dot(direction, self.up);
        if !(toward > 0.0 && x.abs() <= self.half[0] && y.abs() <= self.half[1]) {
            0.0
        } else {
            self.angle * far * far / (4.0 * self.half[0] * self.half[1] * toward)
        }
    }
}

/// Those that a place sees, the first ones.
pub(crate) struct Portals {
    seen: [Option<Seen>; MOST_PORTALS],
    position: Vector,
    /// Of all.
    angle: f32,
}

impl Portals {
    /// None: none is seen. No more than the first MOST_PORTALS are looked at.
    pub(crate) fn seen(all: &[Portal], position: Vector, normal: Vector) -> Option<Portals> {
        let mut seen = [const { None }; MOST_PORTALS];
        let (mut angle, mut count) = (0.0, 0);
        for one in all.iter().take(MOST_PORTALS).filter_map(|portal| Seen::of(portal, position, normal)) {
            angle += one.angle;
            seen[count] = Some(one);
            count += 1;
        }
        (count > 0).then_some(Portals { seen, position, angle })
    }

    /// A unit direction through one of them; `u` in [0, 1).
    pub(crate) fn sample(&self, u: [f32; 2]) -> Vector {
        let mut before = 0.0;
        let mut each = self.seen.iter().flatten();
        let Some(mut seen) = each.next() else { return [0.0; 3] };
        for next in each {
            if before + seen.angle > u[0] * self.angle {
                break;
            }
            before += seen.angle;
            seen = next;
        }
        let x = ((u[0] * self.angle - before) / seen.angle).clamp(0.0, 0.999_999_94);
        let [x, y] = [(2.0 * x - 1.0) * seen.half[0], (2.0 * u[1] - 1.0) * seen.half[1]];
        let onward: Vector =
            std::array::from_fn(|k| seen.middle[k] + x * seen.across[k] + y * seen.up[k] - self.position[k]);
        let length = dot(onward, onward).sqrt();
        onward.map(|x| x / length)
    }

    /// The pdf of a direction [1/sr].
    pub(crate) fn pdf(&self, direction: Vector) -> f32 {
        self.seen.iter().flatten().map(|seen| seen.density(direction)).sum::<f32>() / self.angle
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::PI;

    use super::*;
    use crate::random::random4;
    use crate::vector::from_frame;

    const PORTALS: [Portal; 3] = [
        [[0.0, 0.0, 0.0, 0.4], [1.0, 0.0, 0.0, 1.0], [0.0, 0.0, 1.0, 0.0]],
        [[0.0, -2.0, 0.5, 0.05], [0.0, 0.0, 1.0, 0.03], [0.0, 1.0, 0.0, 0.0]],
        // Seen from behind.
        [[1.0, 0.0, 0.0, 1.0], [0.0, 1.0, 0.0, 1.0], [1.0, 0.0, 0.0, 0.0]],
    ];
    const PLACE: Vector = [0.1, 0.3, 0.9];

    /// Every direction that is drawn is possible, and what all bring is right: so densities are those of what
    /// is drawn.
    #[test]
    fn densities_are_those_of_what_is_drawn() {
        let normal = [0.6, 0.0, -0.8];
        let portals = Portals::seen(&PORTALS, PLACE, normal).unwrap();
        let brings = |d: Vector| if portals.pdf(d) > 0.0 { dot(d, normal).max(0.0) } else { 0.0 };
        let (mut by_portals, mut by_cosine) = (0.0f64, 0.0f64);
        let photons = 400_000;
        for number in 0..photons {
            let u = random4(1, 2, number, 3);
            let d = portals.sample([u[0], u[1]]);
            assert!((dot(d, d) - 1.0).abs() < 1e-5);
            if portals.pdf(d) > 0.0 {
                by_portals += f64::from(brings(d) / portals.pdf(d)) / f64::from(photons);
            }
            let (radius, turn) = (u[2].sqrt(), 2.0 * PI * u[3]);
            let local = [radius * turn.cos(), radius * turn.sin(), (1.0 - u[2]).sqrt()];
            if portals.pdf(from_frame(normal, local)) > 0.0 {
                by_cosine += f64::from(PI) / f64::from(photons);
            }
        }
        assert!((by_portals / by_cosine - 1.0).abs() < 0.02, "{by_portals} {by_cosine}");
    }

    #[test]
    fn not_from_behind_and_not_below() {
        let portals = &PORTALS[..1];
        assert!(Portals::seen(portals, [0.1, 0.3, -0.9], [0.0, 0.0, 1.0]).is_none());
        assert!(Portals::seen(portals, PLACE, [0.0, 0.0, 1.0]).is_none());
        let portals = Portals::seen(portals, PLACE, [0.0, 0.0, -1.0]).unwrap();
        assert!(portals.pdf([0.0, 0.0, -1.0]) > 0.0);
        assert!(portals.pdf([0.0, 0.0, 1.0]) == 0.0);
    }
}
