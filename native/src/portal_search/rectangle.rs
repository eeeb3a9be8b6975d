// SPDX-License-Identifier: GPL-3.0-or-later
//! Rectangles that may become portals.

use crate::portals::Portal;
use crate::vector::{Vector, cross, dot};

/// Sides of those that are tried [scene units].
pub(super) const LEAST_SIDE: f32 = 0.04;
pub(super) const MOST_SIDE: f32 = 1.2;

/// A rectangle by its middle, a normal, a vector about across it, and the logarithms of its sides.
#[derive(Clone, Copy)]
pub(super) struct Rectangle {
    pub(super) middle: Vector,
    pub(super) axis: Vector,
    pub(super) across: Vector,
    pub(super) sides: [f32; 2],
}

impl Rectangle {
    pub(super) fn of(portal: &Portal) -> Rectangle {
        let [[x, y, z, width], [cx, cy, cz, height], [ax, ay, az, _]] = *portal;
        let sides = [width.ln(), height.ln()];
        Rectangle { middle: [x, y, z], axis: [ax, ay, az], across: [cx, cy, cz], sides }
    }

    pub(super) fn wider(mut self, times: f32) -> Rectangle {
        self.sides = self.sides.map(|side| side + times.ln());
        self
    }

    pub(super) fn portal(&self) -> Portal {
        let axis = unit(self.axis);
        let along = dot(self.across, axis);
        let across = unit(std::array::from_fn(|k| self.across[k] - along * axis[k]));
        let [width, height] = self.sides.map(f32::exp);
        let row = |v: Vector, w: f32| [v[0], v[1], v[2], w];
        [row(self.middle, width), row(across, height), row(axis, 0.0)]
    }

    /// In the same plane from a low to a high end along each side, from the middle, `wider` than that by so many
    /// times, and no side shorter than `least` or longer than `most`.
    pub(super) fn resized(&self, ends: [[f32; 2]; 2], wider: f32, [least, most]: [f32; 2]) -> Rectangle {
        let [_, [cx, cy, cz, _], [ax, ay, az, _]] = self.portal();
        let (across, axis) = ([cx, cy, cz], [ax, ay, az]);
        let mut middle = self.middle;
        for ([low, high], along) in ends.into_iter().zip([across, cross(axis, across)]) {
            middle = std::array::from_fn(|i| middle[i] + 0.5 * (low + high) * along[i]);
        }
        let sides = ends.map(|[low, high]| (wider * (high - low)).clamp(least, most).ln());
        Rectangle { middle, axis, across, sides }
    }

    /// Another one, changed in one way by as much as `far` tells: an edge is moved, or it is shifted across its
    /// plane, or turned. No side becomes longer than `most`.
    pub(super) fn changed(&self, far: f32, most: f32, draw: impl Fn(u32) -> [f32; 4]) -> Rectangle {
        let (a, b) = (draw(0), draw(1));
        // About normal: the sum of two even ones.
        let n = |u: f32, v: f32| 2.4 * far * (u + v - 1.0);
        let [[.., width], [cx, cy, cz, height], [ax, ay, az, _]] = self.portal();
        let (across, axis) = ([cx, cy, cz], [ax, ay, az]);
        let moved = |along: Vector, by: f32| std::array::from_fn(|k| self.middle[k] + by * along[k]);
        let mut other = Rectangle { middle: self.middle, axis, across, sides: self.sides };
        match (10.0 * a[0]) as usize {
            edge @ 0..4 => {
                let (side, length, along) =
                    if edge < 2 { (0, width, across) } else { (1, height, cross(axis, across)) };
                other.sides[side] = (other.sides[side] + 0.5 * n(a[1], a[2])).min(most.ln());
                let longer = other.sides[side].exp() - length;
                other.middle = moved(along, if edge % 2 == 0 { 0.5 * longer } else { -0.5 * longer });
            }
            4..7 => other.middle = moved(axis, 0.5 * width.min(height) * n(a[1], a[2])),
            _ => {
                let turn = [n(a[1], a[2]), n(a[3], b[0]), n(b[1], b[2])];
                other.axis = std::array::from_fn(|k| axis[k] + 0.3 * turn[k]);
                other.across = std::array::from_fn(|k| across[k] + 0.3 * turn[(k + 1) % 3]);
            }
        }
        other
    }
}

fn unit(v: Vector) -> Vector {
    let length = dot(v, v).sqrt().max(1.0e-20);
    v.map(|x| x / length)
}
