// SPDX-License-Identifier: GPL-3.0-or-later
//! What photons went straight along, and how portals would have changed their flux.

use std::f32::consts::PI;

use crate::lanes::{Lanes, Row, WIDTH, widest};
use crate::portals::Portal;
use crate::vector::{Vector, cross, dot};

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

/// Eight segments, and sums over the portals that their places see.
#[derive(Clone, Copy)]
pub(super) struct Block {
    place: [Row; 3],
    normal: [Row; 3],
    direction: [Row; 3],
    length: Row,
    /// The pdf of the direction by the cosine [1/sr], times the share that goes by it.
    by_cosine: Row,
    /// The portals' solid angles [sr].
    angle: Row,
    /// The pdfs of the segment's direction through each [1/sr], times those.
    density: Row,
}

/// Segments, seen from a portal: its sides, where places are from its middle, how high above its plane, how fast
/// directions go toward that, how far it is, and where they meet it, along its sides.
struct AtPlane<L> {
    across: [L; 3],
    up: [L; 3],
    away: [L; 3],
    high: L,
    toward: L,
    far: L,
    x: L,
    y: L,
}

impl Block {
    /// All segments, in order, which see no portal yet; those that fill up the last one see none.
    pub(super) fn all_of(segments: &[Segment]) -> Vec<Block> {
        let none = Row([0.0; WIDTH]);
        let block = |some: &[Segment]| {
            let mut block = Block {
                place: [none; 3],
                normal: [none; 3],
                direction: [none; 3],
                length: none,
                by_cosine: none,
                angle: none,
                density: none,
            };
            for (lane, segment) in some.iter().enumerate() {
                for k in 0..3 {
                    block.place[k].0[lane] = segment.place[k];
                    block.normal[k].0[lane] = segment.normal[k];
                    block.direction[k].0[lane] = segment.direction[k];
                }
                block.length.0[lane] = segment.length;
                block.by_cosine.0[lane] = ALBEDO * segment.cosine / PI;
            }
            block
        };
        segments.chunks(WIDTH).map(block).collect()
    }

    #[inline(always)]
    fn at_plane<L: Lanes>(&self, portal: &Portal) -> AtPlane<L> {
        let [[mx, my, mz, _], [cx, cy, cz, _], [ax, ay, az, _]] = *portal;
        let up = L::splat3(cross([ax, ay, az], [cx, cy, cz]));
        let (across, axis) = (L::splat3([cx, cy, cz]), L::splat3([ax, ay, az]));
        let (place, middle) = (L::load3(&self.place), L::splat3([mx, my, mz]));
        let away = [place[0] - middle[0], place[1] - middle[1], place[2] - middle[2]];
        let direction = L::load3(&self.direction);
        let (high, toward) = (L::dot(away, axis), L::splat(0.0) - L::dot(direction, axis));
        let far = high / toward;
        let x = L::dot(away, across) + far * L::dot(direction, across);
        let y = L::dot(away, up) + far * L::dot(direction, up);
        AtPlane { across, up, away, high, toward, far, x, y }
    }

    /// The sums with one more portal, as [`crate::portals::Seen`] has it.
    #[inline(always)]
    fn sums_with<L: Lanes>(&self, portal: &Portal) -> (L, L) {
        let [[.., width], [.., height], _] = *portal;
        let (plane, zero) = (self.at_plane::<L>(portal), L::splat(0.0));
        let (half_width, half_height) = (L::splat(0.5 * width), L::splat(0.5 * height));
        let normal = L::load3(&self.normal);
        let above =
            L::dot(normal, plane.across).abs() * half_width + L::dot(normal, plane.up).abs() * half_height;
        let squared = L::dot(plane.away, plane.away).max(L::splat(1.0e-12));
        let seen = L::dot(normal, plane.away).less(above) & zero.less(plane.high);
        let angle = (L::splat(width * height) * plane.high / (squared * squared.sqrt())).keep(seen);
        let met = zero.less(plane.toward)
            & plane.x.abs().less_equal(half_width)
            & plane.y.abs().less_equal(half_height);
        let density =
            (angle * plane.far * plane.far / (L::splat(width * height) * plane.toward)).keep(met & seen);
        (L::load(&self.angle) + angle, L::load(&self.density) + density)
    }
}

/// Where segments meet the plane of a portal from the side that it is seen from, from its middle along its sides; which
/// segments these are.
pub(super) type Met = Vec<(usize, [f32; 2])>;

widest! {
    /// Those that meet it about the portal: `loose` sides from its middle.
    pub(super) fn meet<L>(blocks: &[Block], portal: &Portal, loose: f32, found: &mut Met) {
        let [[.., width], [.., height], _] = *portal;
        let (far_across, far_up) = (L::splat(loose * width), L::splat(loose * height));
        for (number, block) in blocks.iter().enumerate() {
            let AtPlane { high, toward, x, y, .. } = block.at_plane::<L>(portal);
            let through = L::splat(0.0).less(high) & high.less(L::load(&block.length) * toward);
            let mut lanes = L::bits(through & x.abs().less(far_across) & y.abs().less(far_up));
            let (x, y) = (x.store().0, y.store().0);
            while lanes != 0 {
                let lane = lanes.trailing_zeros() as usize;
                lanes &= lanes - 1;
                found.push((number * WIDTH + lane, [x[lane], y[lane]]));
            }
        }
    }
}

widest! {
    /// Count one more portal.
    pub(super) fn add<L>(blocks: &mut [Block], portal: &Portal) {
        for block in blocks {
            let (angle, density) = block.sums_with::<L>(portal);
            (block.angle, block.density) = (angle.store(), density.store());
        }
    }
}

widest! {
    /// Photons' fluxes that took each segment, over what they are without portals, if there is one more; how many see any.
    pub(super) fn weights<L>(blocks: &[Block], portal: &Portal, found: &mut Vec<Row>, seeing: &mut u32) {
        for block in blocks {
            let (angle, density) = block.sums_with::<L>(portal);
            let sees = L::splat(0.0).less(angle);
            let by_cosine = L::load(&block.by_cosine);
            let by_portals = (L::splat(1.0 - ALBEDO) * density / angle).keep(sees);
            let weight = by_cosine / (by_cosine + by_portals).max(L::splat(1.0e-30));
            *seeing += L::bits(sees).count_ones();
            found.push((weight.keep(sees) + L::splat(1.0).keep(!sees)).store());
        }
    }
}
