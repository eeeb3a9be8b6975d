// SPDX-License-Identifier: GPL-3.0-or-later
//! Where each visible point's disc ends at what stands on its surface, as glsl/kernels/cuts.glsl.

use rayon::prelude::*;

use crate::filter::{Filter, SAME_ORIENTATION};
use crate::lanes::widest;
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
const DIRECTIONS: u32 = 16;
/// Cosine and sine of the turn from one to the next.
const STEP: [f32; 2] = [0.923_879_5, 0.382_683_43];
const POINTS_A_TASK: usize = 256;

/// Half planes that end a disc, each a vector in the frame about the normal: what lies beyond has a
/// scalar product of more than one with it. Zero cuts nothing.
pub(crate) type Cuts = [f32; 4];
pub(crate) const NONE: Cuts = [0.0; 4];

/// How far a disc of this radius reaches in a direction of its plane, squared, in radii.
#[inline(always)]
pub(crate) fn reach2([ax, ay, bx, by]: Cuts, radius: f32, [x, y]: [f32; 2]) -> f32 {
    let nearness = (x * ax + y * ay).max(x * bx + y * by) * radius;
    if nearness > 1.0 { 1.0 / (nearness * nearness) } else { 1.0 }
}

/// The share of a filter's mass within the cuts, and of the inner filter's; `turn`, 0 to 1, moves the
/// directions that are looked at.
pub(crate) fn masses(cuts: Cuts, radius: f32, filter: Filter, turn: f32) -> [f32; 2] {
    let (sin, cos) = sin_cos_of_turns(turn / DIRECTIONS as f32);
    let (mut direction, mut sums) = ([cos, sin], [0.0; 2]);
    for _ in 0..DIRECTIONS {
        let masses = filter.masses_within(reach2(cuts, radius, direction));
        sums = [sums[0] + masses[0], sums[1] + masses[1]];
        let [x, y] = direction;
        direction = [x * STEP[0] - y * STEP[1], x * STEP[1] + y * STEP[0]];
    }
    sums.map(|sum| sum / DIRECTIONS as f32)
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
            if !(surface > 0.0 && flags > 0.0 && radius > 0.0) {
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
        if triangle[1][3] + 1.0 == self.surface
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
