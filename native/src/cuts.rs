// SPDX-License-Identifier: GPL-3.0-or-later
//! Where each visible point's disc ends at what stands on its surface, as glsl/kernels/cuts.glsl.

use rayon::prelude::*;

use crate::filter::{Filter, INNER_AREA, SAME_ORIENTATION};
use crate::lanes::widest;
use crate::own::Sides;
use crate::radius::RadiusField;
use crate::trace::Tree;
use crate::vector::{dot, frame_about, normal_of, sin_cos_of_turns};
use crate::watertight::SURFACE_OFFSET;
use crate::wide::{Lifted, Stack};

/// How far above the tangent plane obstacles are looked for, in radii, and what a second obstacle stands
/// out from the first cut at least (the reasons are in glsl/lib/obstacles.glsl).
const LIFTS: [f32; 2] = [0.01, 0.2];
const MARGIN: f32 = 0.02;
/// Triangles about a disc at most: where there are more, it is not cut (see glsl/lib/obstacles.glsl).
const MOST_LOOKED_AT: u32 = 128;
/// Directions in which it is asked how far a cut disc reaches.
pub(crate) const DIRECTIONS: u32 = 16;
/// Cosine and sine of the turn from one to the next.
const STEP: [f32; 2] = [0.923_879_5, 0.382_683_43];
/// What keeps a strip from being tilted across, in radii squared; by how much a tilted filter may be scaled; which
/// share of what the cuts leave of a disc on the point's own polygon tilts it not at all, and wholly; and from which
/// shares on that is known (the reasons are in glsl/lib/cuts.glsl).
const LEAST_SPREAD: f32 = 1.0e-3;
const MOST_SCALE: f32 = 3.5;
const KNOWN: [f32; 2] = [0.3, 0.6];
const SURE: [f32; 2] = [0.8, 1.0];
const BROAD: [f32; 2] = [0.25, 0.45];
/// From so much of the first pass's radius on discs that are cut shrink faster.
const SHRUNK: f32 = 0.63;
const POINTS_A_TASK: usize = 256;

/// Half planes that end a disc, each a vector in the frame about the normal: what lies beyond has a
/// scalar product of more than one with it. Zero cuts nothing.
pub(crate) type Cuts = [f32; 4];
pub(crate) const NONE: Cuts = [0.0; 4];

/// A disc's radius of what radii say, where it is cut (the reasons are in glsl/lib/radius.glsl).
pub(crate) fn cut_radius(radius: f32, radius_scale: f32, [x, y, ..]: Cuts) -> f32 {
    if [x, y] == [0.0; 2] {
        return radius;
    }
    let least = (radius_scale / SHRUNK).min(1.0).sqrt() * radius;
    (x * x + y * y).sqrt().recip().max(least).min(radius)
}

/// How far a disc of this radius reaches in a direction of its plane, squared, in radii.
#[inline(always)]
pub(crate) fn reach2([ax, ay, bx, by]: Cuts, radius: f32, [x, y]: [f32; 2]) -> f32 {
    let nearness = (x * ax + y * ay).max(x * bx + y * by) * radius;
    if nearness > 1.0 { 1.0 / (nearness * nearness) } else { 1.0 }
}

/// How a filter is tilted about a cut disc (glsl/lib/cuts.glsl): what lies at `d` in the frame about the
/// normal counts `scale (1 + tilt d)` times as much, and so the filter's mass within the cuts is `mass`.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Tilt {
    pub(crate) tilt: [f32; 2],
    pub(crate) scale: f32,
    pub(crate) mass: f32,
    /// The share of the untilted filter that the cuts leave, of which the mass does not depend.
    pub(crate) left: f32,
    /// The same, or 1 where it does not tell what is surface.
    pub(crate) known: f32,
}

impl Tilt {
    pub(crate) const NONE: Tilt = Tilt { tilt: [0.0; 2], scale: 1.0, mass: 1.0, left: 1.0, known: 1.0 };

    /// From the filter's moments within the cuts, in radii: mass, x, y, xx, xy, yy; and from others that don't
    /// depend on them, for the mass of what is tilted by the former is to be right in the mean.
    fn of([mass, x, y, xx, xy, yy]: [f32; 6], others: [f32; 6], radius: f32, known: f32) -> Tilt {
        let left = mass;
        let sure = 1.0 + rise(SURE, known) * rise(BROAD, mass) * (mass - 1.0);
        let strength = rise(KNOWN, known);
        let least = LEAST_SPREAD * mass;
        let (xx, yy) = (xx + least, yy + least);
        let determinant = (xx * yy - xy * xy).max(1.0e-20);
        let tilt = [(xy * y - yy * x) / determinant, (xy * x - xx * y) / determinant];
        // What a whole tilt takes off the mass.
        let taken = -(tilt[0] * x + tilt[1] * y);
        let most = (1.0 - 1.0 / MOST_SCALE) * mass;
        let strength = if taken > most { strength * (most / taken) } else { strength };
        let tilt = tilt.map(|t| strength * t);
        let scale = mass / (mass - strength * taken).max(1.0e-20);
        let mass = scale * (others[0] + tilt[0] * others[1] + tilt[1] * others[2]);
        Tilt { tilt: tilt.map(|t| t / radius), scale, mass, left, known: sure }
    }

    /// What moments of the untilted filter count, in its radii: mass, x and y.
    #[inline(always)]
    pub(crate) fn mass_of(&self, [mass, x, y]: [f32; 3], radius: f32) -> f32 {
        self.scale * (mass + radius * (x * self.tilt[0] + y * self.tilt[1]))
    }

    /// What something at (x, y) counts.
    #[inline(always)]
    pub(crate) fn at(&self, [x, y]: [f32; 2]) -> f32 {
        self.scale * (1.0 + x * self.tilt[0] + y * self.tilt[1])
    }
}

/// The tilts of a filter within the cuts, and of the inner filter; `turns`, 0 to 1, move the directions that
/// are looked at. `sides`: other half planes, of the point's own polygon.
pub(crate) fn tilts(
    cuts: Cuts,
    sides: Option<&Sides>,
    radius: f32,
    filter: Filter,
    turns: [f32; 2],
) -> [Tilt; 2] {
    let [outer, inner] = moments::<true>(cuts, radius, filter, turns[0]);
    let [here, between] = [0.0, 0.5].map(|more| moments::<false>(cuts, radius, filter, turns[1] + more));
    let [other, other_inner] = std::array::from_fn(|k| mean_of(here[k], between[k]));
    let known =
        sides.map_or(1.0, |sides| sides.masses(cuts, radius, filter, turns[0])[0] / outer[0].max(1.0e-20));
    let inner_radius = radius * INNER_AREA.sqrt();
    [Tilt::of(outer, other, radius, known), Tilt::of(inner, other_inner, inner_radius, known)]
}

/// From 0 at the first bound to 1 at the second.
fn rise([low, high]: [f32; 2], x: f32) -> f32 {
    ((x - low) / (high - low)).clamp(0.0, 1.0)
}

fn mean_of(a: [f32; 6], b: [f32; 6]) -> [f32; 6] {
    std::array::from_fn(|k| 0.5 * (a[k] + b[k]))
}

/// Unit vectors all around, the first of which `turn`, 0 to 1, moves from one to the next.
pub(crate) fn directions(turn: f32) -> impl Iterator<Item = [f32; 2]> {
    let (sin, cos) = sin_cos_of_turns(turn / DIRECTIONS as f32);
    let turned = |&[x, y]: &[f32; 2]| Some([x * STEP[0] - y * STEP[1], x * STEP[1] + y * STEP[0]]);
    std::iter::successors(Some([cos, sin]), turned).take(DIRECTIONS as usize)
}

/// The moments of a filter within the cuts, and of the inner filter, either in its radii: mass, x, y, and, if
/// SQUARES are asked for, xx, xy, yy.
fn moments<const SQUARES: bool>(cuts: Cuts, radius: f32, filter: Filter, turn: f32) -> [[f32; 6]; 2] {
    let mut sums = [[0.0; 6]; 2];
    let whole = filter.moments_within(1.0);
    for direction in directions(turn) {
        let x2 = reach2(cuts, radius, direction);
        let [x, y] = direction;
        for (sum, x2) in sums.iter_mut().zip([x2, x2 / INNER_AREA]) {
            let [mass, first, second] = if x2 < 1.0 { filter.moments_within(x2) } else { whole };
            sum[0] += mass;
            sum[1] += x * first;
            sum[2] += y * first;
            if SQUARES {
                sum[3] += x * x * second;
                sum[4] += x * y * second;
                sum[5] += y * y * second;
            }
        }
    }
    sums.map(|sum| sum.map(|x| x / DIRECTIONS as f32))
}

/// Write the cuts of visible points; zeros where there is none.
///
/// `places` are positions and surfaces (0: no point), `facings` normals, `diffuses` albedos and flags, of
/// which those above 0 are of interest; a point's radius is what `radii` says, times `radius_scale`.
/// `corners` are the triangles in leaf order, whose second corner's fourth number is the surface.
#[allow(clippy::too_many_arguments)]
pub fn cuts(
    tree: &Tree,
    corners: &[[[f32; 4]; 3]],
    radii: &RadiusField,
    radius_scale: f32,
    places: &[[f32; 4]],
    facings: &[[f32; 4]],
    diffuses: &[[f32; 4]],
    out: &mut [[f32; 4]],
) {
    out.par_chunks_mut(POINTS_A_TASK)
        .zip(places.par_chunks(POINTS_A_TASK))
        .zip(facings.par_chunks(POINTS_A_TASK))
        .zip(diffuses.par_chunks(POINTS_A_TASK))
        .for_each(|(((out, places), facings), diffuses)| {
            chunk_of(tree, corners, radii, radius_scale, places, facings, diffuses, out);
        });
}

widest! {
    #[allow(clippy::too_many_arguments)]
    fn chunk_of<L>(
        tree: &Tree,
        corners: &[[[f32; 4]; 3]],
        radii: &RadiusField,
        radius_scale: f32,
        places: &[[f32; 4]],
        facings: &[[f32; 4]],
        diffuses: &[[f32; 4]],
        out: &mut [[f32; 4]],
    ) {
        let mut stack = Stack::new();
        let mut crossing: Vec<(i32, [f32; 3])> = Vec::new();
        let mut segments: Vec<Segment> = Vec::new();
        let points = places.iter().zip(facings).zip(diffuses);
        for (((&[x, y, z, surface], &[nx, ny, nz, _]), &[.., flags]), out) in points.zip(out) {
            *out = NONE;
            let (position, normal) = ([x, y, z], [nx, ny, nz]);
            let radius = radii.at(position, normal) * radius_scale;
            // False for NaN.
            if !(surface != 0.0 && flags > 0.0 && radius > 0.0) {
                continue;
            }
            let levels = LIFTS.map(|lift| 4.0 * SURFACE_OFFSET + lift * radius);
            let lifted = Lifted::new(position, normal, levels, radius);
            crossing.clear();
            let visit = |position, heights| crossing.push((position, heights));
            if !tree.crossing::<L>(&lifted, &mut stack, MOST_LOOKED_AT, visit) || crossing.is_empty() {
                continue;
            }
            let disc = Disc { position, normal, frame: frame_about(normal), surface, radius, levels };
            segments.clear();
            for &(position, heights) in &crossing {
                disc.add_segments(&corners[position as usize], heights, &mut segments);
            }
            let first = disc.cut(&segments, [0.0; 2]);
            if first != [0.0; 2] {
                let second = disc.cut(&segments, first);
                *out = [first[0], first[1], second[0], second[1]];
            }
        }
    }
}

/// Where a triangle crosses a plane, in the frame about the normal.
type Segment = [[f32; 2]; 2];

/// A visible point's disc, and the heights above it at which obstacles are looked for.
struct Disc {
    position: [f32; 3],
    normal: [f32; 3],
    frame: ([f32; 3], [f32; 3]),
    surface: f32,
    radius: f32,
    levels: [f32; 2],
}

impl Disc {
    /// Where a triangle, of whose corners these are the heights, crosses the levels; nowhere if it is of
    /// the point's own surface and bends up slowly.
    fn add_segments(&self, triangle: &[[f32; 4]; 3], heights: [f32; 3], segments: &mut Vec<Segment>) {
        if triangle[1][3] + 1.0 == self.surface.abs()
            && dot(normal_of(triangle), self.normal).abs() >= SAME_ORIENTATION
        {
            return;
        }
        let (tangent, bitangent) = self.frame;
        let local = triangle.map(|corner| {
            let offset: [f32; 3] = std::array::from_fn(|axis| corner[axis] - self.position[axis]);
            [dot(offset, tangent), dot(offset, bitangent)]
        });
        for level in self.levels {
            let above = heights.map(|height| level < height);
            // The corner that is alone on its side.
            let lone = match above {
                [a, b, c] if b == c && a != b => 0,
                [a, b, c] if a == c && a != b => 1,
                [a, b, c] if a == b && a != c => 2,
                _ => continue,
            };
            let [x, y] = local[lone];
            segments.push([(lone + 1) % 3, (lone + 2) % 3].map(|other| {
                let share = (level - heights[lone]) / (heights[other] - heights[lone]);
                let [to_x, to_y] = local[other];
                [x + (to_x - x) * share, y + (to_y - y) * share]
            }));
        }
    }

    /// The cut at the nearest point of what a first cut, if not zero, leaves of the segments; zero if
    /// there is none within the radius.
    fn cut(&self, segments: &[Segment], first: [f32; 2]) -> [f32; 2] {
        let along = |p: [f32; 2]| p[0] * first[0] + p[1] * first[1];
        let most = (1.0 - MARGIN * self.radius * along(first).sqrt()).max(0.0);
        let (mut nearest, mut least) = ([0.0; 2], self.radius * self.radius);
        for &[p, q] in segments {
            let (mut begin, mut end) = (0.0f32, 1.0f32);
            if first != [0.0; 2] {
                let (at_p, at_q) = (along(p), along(q));
                if at_p >= most && at_q >= most {
                    continue;
                }
                let met = (most - at_p) / (at_q - at_p);
                if at_p >= most {
                    begin = met;
                } else if at_q >= most {
                    end = met;
                }
            }
            let way = [q[0] - p[0], q[1] - p[1]];
            let length2 = (way[0] * way[0] + way[1] * way[1]).max(1.0e-30);
            let foot = (-(p[0] * way[0] + p[1] * way[1]) / length2).max(begin).min(end);
            let at = [p[0] + way[0] * foot, p[1] + way[1] * foot];
            let d2 = at[0] * at[0] + at[1] * at[1];
            // Of points at one distance always the same, in whatever order the triangles come.
            let first = || nearest != [0.0; 2] && (at[0], at[1]) < (nearest[0], nearest[1]);
            if d2 > 0.0 && (d2 < least || (d2 == least && first())) {
                (nearest, least) = (at, d2);
            }
        }
        nearest.map(|x| x / least)
    }
}
