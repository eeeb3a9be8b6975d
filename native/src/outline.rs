// SPDX-License-Identifier: GPL-3.0-or-later
//! What of a visible point's surface lies about it, as triangles of its tangent plane (glsl/lib/outline.glsl).

use crate::cuts::{self, Cuts, Tilt, reach2};
use crate::filter::{Filter, INNER_AREA, SAME_ORIENTATION};
use crate::lanes::Lanes;
use crate::trace::Tree;
use crate::vector::{dot, normal_of, sin_cos_of_turns};
use crate::wide::Stack;

/// Triangles that are looked at, and that an outline may have (the reasons are in glsl/lib/outline.glsl).
const MOST_LOOKED_AT: u32 = 256;
const MOST: usize = 24;
/// Directions in which triangles' mass is summed.
const DIRECTIONS: u32 = 16;
/// Cosine and sine of the turn from one to the next.
const STEP: [f32; 2] = [0.923_879_5, 0.382_683_43];

/// A visible point's disc.
pub(crate) struct Disc {
    pub(crate) position: [f32; 3],
    pub(crate) normal: [f32; 3],
    pub(crate) tangent: [f32; 3],
    pub(crate) bitangent: [f32; 3],
    pub(crate) surface: f32,
    pub(crate) side: f32,
    pub(crate) radius: f32,
    pub(crate) cuts: Cuts,
    pub(crate) tilts: [Tilt; 2],
}

/// A triangle seen from the point in its plane, the sides with the triangle to their left: at (x, y) it is there
/// that a x + b y + c > 0.
#[derive(Clone, Copy)]
pub(crate) struct Flat([[f32; 3]; 3]);

impl Flat {
    /// Nowhere.
    pub(crate) const NONE: Flat = Flat([[0.0, 0.0, -1.0]; 3]);

    #[inline(always)]
    pub(crate) fn of(corners: &[[f32; 4]; 3], disc: &Disc) -> Flat {
        let [p, q, r] = corners.map(|corner| {
            let away: [f32; 3] = std::array::from_fn(|k| corner[k] - disc.position[k]);
            [dot(away, disc.tangent), dot(away, disc.bitangent)]
        });
        let side = |[ax, ay]: [f32; 2], [bx, by]: [f32; 2]| [ay - by, bx - ax, ax * by - ay * bx];
        let sides = [side(p, q), side(q, r), side(r, p)];
        let area = sides[0][2] + sides[1][2] + sides[2][2];
        Flat(if area < 0.0 { sides.map(|side| side.map(|x| -x)) } else { sides })
    }

    #[inline(always)]
    pub(crate) fn holds(&self, [x, y]: [f32; 2]) -> bool {
        self.0.iter().all(|[a, b, c]| a * x + b * y + c > 0.0)
    }

    /// The sides as [`Cuts`] are; of no triangle, none is left of the disc.
    pub(crate) fn cuts(&self) -> [[f32; 2]; 3] {
        self.0.map(|[a, b, c]| if c > 0.0 { [-a / c, -b / c] } else { [1.0e10; 2] })
    }

    #[inline(always)]
    pub(crate) fn holds_disc(&self, radius: f32) -> bool {
        self.0.iter().all(|[a, b, c]| *c > radius * (a * a + b * b).sqrt())
    }

    /// How far it is from the point, at least.
    fn nearest_side(&self) -> f32 {
        let away = |[a, b, c]: [f32; 3]| -c / (a * a + b * b).sqrt();
        self.0.iter().fold(0.0, |most: f32, &side| most.max(away(side)))
    }

    /// From where to where it is there in a direction, no farther than `reach`.
    #[inline(always)]
    fn along(&self, [x, y]: [f32; 2], reach: f32) -> (f32, f32) {
        let (mut from, mut to) = (0.0f32, reach);
        for [a, b, c] in self.0 {
            let rises = a * x + b * y;
            if rises > 0.0 {
                from = from.max(-c / rises);
            } else if rises < 0.0 {
                to = to.min(-c / rises);
            } else if c <= 0.0 {
                to = 0.0;
            }
        }
        (from, to)
    }
}

/// Triangles of the point's surface about it, that face the way it does; None: too many, or none.
#[inline(always)]
pub(crate) fn outline<'a, L: Lanes>(
    tree: &Tree,
    corners: &[[[f32; 4]; 3]],
    disc: &Disc,
    found: &'a mut Vec<Flat>,
    stack: &mut Stack,
) -> Option<&'a [Flat]> {
    found.clear();
    let visit = |position: i32| {
        let triangle = &corners[position as usize];
        if triangle[1][3] + 1.0 == disc.surface
            && disc.side * dot(normal_of(triangle), disc.normal) >= SAME_ORIENTATION
        {
            let flat = Flat::of(triangle, disc);
            if flat.nearest_side() < disc.radius {
                found.push(flat);
            }
        }
        found.len() <= MOST
    };
    let all = tree.about::<L>(disc.position, disc.radius, stack, MOST_LOOKED_AT, visit);
    (all && !found.is_empty()).then_some(found)
}

/// The mass of the tilted filter that triangles lack within the cuts, and the inner filter's; `turn`, 0 to 1, moves the
/// directions that are looked at.
pub(crate) fn lacked_by(outline: &[Flat], disc: &Disc, filter: Filter, turn: f32) -> [f32; 2] {
    let (sin, cos) = sin_cos_of_turns(turn / DIRECTIONS as f32);
    let (mut direction, mut sums) = ([cos, sin], [0.0; 2]);
    for _ in 0..DIRECTIONS {
        let reach = disc.radius * reach2(disc.cuts, disc.radius, direction).sqrt();
        let all = mass_within(disc, filter, direction, reach);
        sums = std::array::from_fn(|k| sums[k] + all[k]);
        for flat in outline {
            let (from, to) = flat.along(direction, reach);
            if to > from {
                let end = mass_within(disc, filter, direction, to);
                let begin = if from > 0.0 { mass_within(disc, filter, direction, from) } else { [0.0; 2] };
                sums = std::array::from_fn(|k| sums[k] - (end[k] - begin[k]));
            }
        }
        let [x, y] = direction;
        direction = [x * STEP[0] - y * STEP[1], x * STEP[1] + y * STEP[0]];
    }
    sums.map(|sum| sum / DIRECTIONS as f32)
}

/// The mass of the tilted filter in a direction up to a distance, and the inner filter's.
#[inline(always)]
fn mass_within(disc: &Disc, filter: Filter, [x, y]: [f32; 2], away: f32) -> [f32; 2] {
    let x2 = ((away * away) / (disc.radius * disc.radius)).min(1.0);
    let inner_x2 = (x2 / INNER_AREA).min(1.0);
    if disc.cuts == cuts::NONE {
        return [filter.mass_within(x2), filter.mass_within(inner_x2)];
    }
    let of = |tilt: &Tilt, x2: f32, radius: f32| {
        let [mass, first, _] = filter.moments_within(x2);
        tilt.scale * (mass + radius * (tilt.tilt[0] * x + tilt.tilt[1] * y) * first)
    };
    [of(&disc.tilts[0], x2, disc.radius), of(&disc.tilts[1], inner_x2, disc.radius * INNER_AREA.sqrt())]
}
