// SPDX-License-Identifier: GPL-3.0-or-later
//! The flat polygon of the surface that a visible point is known to be on, as glsl/lib/own.glsl.

use std::f32::consts::PI;

use crate::cuts::{self, Cuts, DIRECTIONS, directions, reach2};
use crate::faces::{Face, LIES_ON};
use crate::filter::{Filter, INNER_AREA};
use crate::vector::dot;

/// Of a triangle, in place of a quad's side: all is to its left.
const NO_SIDE: [f32; 3] = [0.0, 0.0, 1.0e-10];
/// So near to the point a side is at least, for its cut [scene units].
const NEAREST: f32 = 1.0e-10;
/// A polygon of so much of a disc's area is small.
pub(crate) const SMALL: f32 = 0.1;

/// The point's own triangle, with the neighbour that makes a quad of it. Seen from the point in its plane, the sides
/// with the polygon to their left: at (x, y) it is there that a x + b y + c > 0.
pub(crate) struct Own {
    sides: [[f32; 3]; 4],
    pub(crate) triangle: i32,
    /// Something lies on it, on the point's side.
    is_lain_on: bool,
}

impl Own {
    pub(crate) const NONE: Own = Own { sides: [[0.0, 0.0, -1.0]; 4], triangle: -1, is_lain_on: true };

    /// `seen_from`: the front of the triangle, 1, or its back, -1; `frame`: tangent and bitangent of the point's normal.
    pub(crate) fn of(
        corners: &[[f32; 4]; 3],
        face: Face,
        triangle: i32,
        seen_from: f32,
        position: [f32; 3],
        frame: ([f32; 3], [f32; 3]),
    ) -> Own {
        let at = |corner: &[f32]| {
            let away: [f32; 3] = std::array::from_fn(|k| corner[k] - position[k]);
            [dot(away, frame.0), dot(away, frame.1)]
        };
        let code = face[3] as usize;
        let diagonal = code / 4 % 4; // 0: none
        let [p, q, r] = [0, 1, 2].map(|k| at(&corners[(diagonal + 1 + k) % 3]));
        let side = |[ax, ay]: [f32; 2], [bx, by]: [f32; 2]| [ay - by, bx - ax, ax * by - ay * bx];
        let [first, last] = [side(p, q), side(r, p)];
        let [second, third] = if diagonal == 0 {
            [side(q, r), NO_SIDE]
        } else {
            let s = at(&face[..3]);
            [side(q, s), side(s, r)]
        };
        let mut sides = [first, second, third, last];
        if sides.iter().map(|side| side[2]).sum::<f32>() < 0.0 {
            sides = sides.map(|side| side.map(|x| -x));
        }
        if diagonal == 0 {
            sides[2] = NO_SIDE;
        }
        let is_lain_on = code & LIES_ON[usize::from(seen_from < 0.0)] != 0;
        Own { sides, triangle, is_lain_on }
    }

    #[inline(always)]
    pub(crate) fn holds(&self, [x, y]: [f32; 2]) -> bool {
        self.sides.iter().all(|[a, b, c]| a * x + b * y + c > 0.0)
    }

    /// Whether it is known where light falls on it: nothing lies there, and it is not so small beside a disc that
    /// knowing it is not worth what it takes.
    pub(crate) fn is_known(&self, radius: f32) -> bool {
        let [first, second, third, last] = self.sides.map(|side| side[2]);
        !self.is_lain_on && 0.5 * (first + second + third + last) >= SMALL * PI * radius * radius
    }

    #[inline(always)]
    pub(crate) fn holds_disc(&self, radius: f32) -> bool {
        self.sides.iter().all(|[a, b, c]| *c > radius * (a * a + b * b).sqrt())
    }

    /// The sides as [`Cuts`] are; one that the point is not to the left of cuts at the point.
    pub(crate) fn cuts(&self) -> Sides {
        Sides(self.sides.map(|[a, b, c]| [-a / c.max(NEAREST), -b / c.max(NEAREST)]))
    }
}

/// The sides of a polygon about a point, as [`Cuts`].
pub(crate) struct Sides([[f32; 2]; 4]);

impl Sides {
    /// How far the polygon reaches in a direction, squared, in radii; 1 at most.
    #[inline(always)]
    pub(crate) fn reach2(&self, radius: f32, [x, y]: [f32; 2]) -> f32 {
        let nearness =
            self.0.iter().fold(0.0, |most: f32, side| most.max(x * side[0] + y * side[1])) * radius;
        if nearness > 1.0 { 1.0 / (nearness * nearness) } else { 1.0 }
    }

    /// Directions all around, which `turn`, 0 to 1, moves, and how far the polygon reaches there within the cuts.
    fn reaches(&self, cuts: Cuts, radius: f32, turn: f32) -> impl Iterator<Item = ([f32; 2], f32)> {
        directions(turn).map(move |direction| {
            (direction, self.reach2(radius, direction).min(reach2(cuts, radius, direction)))
        })
    }

    /// The filter's mass, x and y on the polygon and within the cuts, and the inner one's, either in its radii. Where
    /// nothing is cut only masses are told.
    pub(crate) fn moments(&self, cuts: Cuts, radius: f32, filter: Filter, turn: f32) -> [[f32; 3]; 2] {
        let mut sums = [[0.0; 3]; 2];
        for (direction, x2) in self.reaches(cuts, radius, turn) {
            for (sum, area) in sums.iter_mut().zip([1.0, INNER_AREA]) {
                let x2 = (x2 / area).min(1.0);
                sum[0] += filter.mass_within(x2);
                if cuts != cuts::NONE {
                    let [_, first, _] = filter.moments_within(x2);
                    sum[1] += direction[0] * first;
                    sum[2] += direction[1] * first;
                }
            }
        }
        sums.map(|sum| sum.map(|x| x / DIRECTIONS as f32))
    }

    /// The same masses alone.
    pub(crate) fn masses(&self, cuts: Cuts, radius: f32, filter: Filter, turn: f32) -> [f32; 2] {
        let mut sums = [0.0; 2];
        for (_, x2) in self.reaches(cuts, radius, turn) {
            sums[0] += filter.mass_within(x2);
            sums[1] += filter.mass_within((x2 / INNER_AREA).min(1.0));
        }
        sums.map(|sum| sum / DIRECTIONS as f32)
    }
}
