// SPDX-License-Identifier: GPL-3.0-or-later
//! Ray/triangle and ray/box tests that let no ray slip between triangles that share an edge
//! (Woop, Benthin & Wald 2013, "Watertight Ray/Triangle Intersection", JCGT 2(1)).

use crate::bounds::Bounds;
use crate::bvh::MAX_COORDINATE;
use crate::lanes::{Lanes, Row};

/// How far rays are lifted off a surface that they leave (glsl/lib/constants.glsl).
pub(crate) const SURFACE_OFFSET: f32 = 1.0e-6;

/// The same at a position, farther out the more.
pub(crate) fn lift_at(position: [f32; 3]) -> f32 {
    SURFACE_OFFSET * position.iter().fold(1.0, |most: f32, x| most.max(x.abs()))
}

pub type Triangle = [[f32; 3]; 3];

/// The largest component of a direction must lie within [1 / LIMIT, LIMIT].
pub const DIRECTION_LIMIT: f32 = 1e18;

/// Projected area (doubled) over squared extent below which a triangle is worked out in float64;
/// errors of u and v then stay below about 1e-5 above it.
pub(crate) const NEEDLE: f32 = 1.0 / 64.0;

/// How much nearer than it is [`Ray::intersect`] may find a hit, in the triangle's extent along the ray's
/// main axis. Three edge functions of products up to extent^2 err by up to 4 half ulps of it each, and
/// [`NEEDLE`] bounds what that is of their sum: the weights of the corners err by 4.6e-5 in all. The rest is
/// for the rounding of t. (In float64 the products are exact.)
const T_ERROR: f32 = 1.0 / 8192.0;

/// Half a unit in the last place of 1.
const HALF_ULP: f32 = f32::EPSILON / 2.0;

/// Where a ray meets a triangle: `(1 - u - v) * v0 + u * v1 + v * v2`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Distance in lengths of the direction, > 0.
    pub t: f32,
    pub u: f32,
    pub v: f32,
}

/// A ray in the frame of the triangle test: the axis `axes[2]` is the one along which the
/// direction is largest, and a shear takes the direction to that axis.
#[derive(Debug, Clone, Copy)]
pub struct Ray {
    origin: [f32; 3],
    direction: [f32; 3],
    axes: [usize; 3],
    shear: [f32; 3],
}

impl Ray {
    /// None if the ray is of no use: its origin is not finite or beyond [`MAX_COORDINATE`], or its
    /// direction is zero, not finite or outside [`DIRECTION_LIMIT`].
    pub fn new(origin: [f32; 3], direction: [f32; 3]) -> Option<Ray> {
        let largest = direction.iter().fold(0.0, |m: f32, d| m.max(d.abs()));
        let usable = (1.0 / DIRECTION_LIMIT..=DIRECTION_LIMIT).contains(&largest)
            && direction.iter().all(|d| d.is_finite())
            && origin.iter().all(|o| o.abs() <= MAX_COORDINATE);
        if !usable {
            return None;
        }
        let kz = (0..3).find(|&k| direction[k].abs() == largest)?;
        // The paper swaps kx and ky when direction[kz] < 0, to keep the winding for culling.
        // Nothing is culled here.
        let axes = [(kz + 1) % 3, (kz + 2) % 3, kz];
        let d = axes.map(|k| direction[k]);
        let shear = [d[0] / d[2], d[1] / d[2], 1.0 / d[2]];
        Some(Ray { origin, direction, axes, shear })
    }

    pub fn origin(&self) -> [f32; 3] {
        self.origin
    }

    pub fn direction(&self) -> [f32; 3] {
        self.direction
    }

    /// Its axes, the one along which the direction is largest last.
    pub(crate) fn axes(&self) -> [usize; 3] {
        self.axes
    }

    pub(crate) fn shear(&self) -> [f32; 3] {
        self.shear
    }

    #[inline]
    fn to_local(self, point: &[f32; 3]) -> [f32; 3] {
        let [x, y, z] = self.axes.map(|k| point[k] - self.origin[k]);
        [x - self.shear[0] * z, y - self.shear[1] * z, self.shear[2] * z]
    }

    /// The hit with one triangle, whichever side faces the ray; None if it misses, lies behind
    /// the origin or is seen edge-on.
    ///
    /// The sign of a float32 edge function is right unless the function is 0, because rounding is
    /// monotonic: x > y implies fl(x) >= fl(y). (A fused multiply-add would break this.) So
    /// both triangles at an edge agree on which side the ray passes, and where the function is 0,
    /// float64 decides, in which the products are exact.
    #[inline]
    pub fn intersect(&self, corners: &[[f32; 3]; 3]) -> Option<Hit> {
        let [a, b, c] = [&corners[0], &corners[1], &corners[2]].map(|p| self.to_local(p));
        let u = c[0] * b[1] - c[1] * b[0];
        let v = a[0] * c[1] - a[1] * c[0];
        let w = b[0] * a[1] - b[1] * a[0];
        if u == 0.0 || v == 0.0 || w == 0.0 {
            return intersect_exactly(&a, &b, &c);
        }
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let det = u + v + w;
        // On a needle, or a triangle at a grazing angle, the products cancel and t, u and v drown in
        // their rounding, which is up to 2^-24 * extent^2. Outside the range, products have
        // underflowed or overflowed.
        let extent = [a, b, c].iter().fold(0.0, |m: f32, p| m.max(p[0].abs()).max(p[1].abs()));
        let size = det.abs();
        if size < extent * extent * NEEDLE || !(1e-30..=1e30).contains(&size) {
            return intersect_exactly(&a, &b, &c);
        }
        let scale = 1.0 / det;
        let t = u * scale * a[2] + v * scale * b[2] + w * scale * c[2];
        (t > 0.0).then_some(Hit { t, u: v * scale, v: w * scale })
    }
}

/// The test of [`Ray::intersect`] on local corners, in float64.
#[cold]
fn intersect_exactly(a: &[f32; 3], b: &[f32; 3], c: &[f32; 3]) -> Option<Hit> {
    let [a, b, c] = [a, b, c].map(|p| p.map(f64::from));
    let u = c[0] * b[1] - c[1] * b[0];
    let v = a[0] * c[1] - a[1] * c[0];
    let w = b[0] * a[1] - b[1] * a[0];
    if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
        return None;
    }
    let det = u + v + w;
    if det == 0.0 {
        return None;
    }
    let t = ((u * a[2] + v * b[2] + w * c[2]) / det) as f32;
    (t > 0.0).then_some(Hit { t, u: (v / det) as f32, v: (w / det) as f32 })
}

/// A ray's constants for the box test, which finds every box that holds a triangle which
/// [`Ray::intersect`] hits.
pub(crate) struct Slabs<L> {
    /// The origin as a box's near and far planes see it: shifted so that boxes grow.
    near_origin: [L; 3],
    far_origin: [L; 3],
    reciprocal: [L; 3],
    /// Whether the ray goes up the axis: the near plane is then the lower one.
    upward: [bool; 3],
    slack: f32,
}

impl<L: Lanes> Slabs<L> {
    /// `bounds` hold the scene.
    #[inline(always)]
    pub(crate) fn new(ray: &Ray, bounds: &Bounds) -> Self {
        // Translating and shearing a corner moves it by up to 5 half ulps of its distance along
        // its own axis plus that along the main axis (eps in Woop et al.'s traversal); twice the
        // largest distance bounds the sum.
        let mut reach = 0.0f32;
        for k in 0..3 {
            reach =
                reach.max((bounds.min[k] - ray.origin[k]).abs()).max((bounds.max[k] - ray.origin[k]).abs());
        }
        let grow = 10.0 * HALF_ULP * reach;
        // An axis along which the ray hardly moves: it moves by less than `grow` within the
        // scene, and a finite reciprocal makes no NaN (0 * inf).
        let main = ray.axes[2];
        let least = ray.direction[main].abs() * 1e-18;
        // The second term makes the shift survive the rounding of the shifted origin.
        let pad = ray.origin.map(|o| grow + 2.0 * HALF_ULP * o.abs());
        let reciprocal = ray.direction.map(|d| 1.0 / if d.abs() > least { d } else { least });
        let upward = reciprocal.map(|r| r > 0.0);
        let shifted = |k: usize, up: bool| ray.origin[k] + if up { pad[k] } else { -pad[k] };
        let near: [f32; 3] = std::array::from_fn(|k| shifted(k, upward[k]));
        let far: [f32; 3] = std::array::from_fn(|k| shifted(k, !upward[k]));
        Slabs {
            near_origin: L::splat3(near),
            far_origin: L::splat3(far),
            reciprocal: L::splat3(reciprocal),
            upward,
            slack: (bounds.max[main] - bounds.min[main]) / ray.direction[main].abs() * T_ERROR,
        }
    }

    /// Where a box that holds a triangle is entered at the latest, if [`Ray::intersect`] finds it hit at
    /// `t`. Boxes up to there have to be looked into, or it would depend on the tree and on the order of
    /// traversal which of two triangles at almost or exactly the same distance is the closest.
    #[inline(always)]
    pub(crate) fn latest_entry(&self, t: f32) -> f32 {
        t + self.slack
    }

    /// Where the ray enters the boxes (at least 0), and which of them it does at `latest` or before.
    #[inline(always)]
    pub(crate) fn enter(&self, min: &[Row; 3], max: &[Row; 3], latest: f32) -> (L, L::Mask) {
        // Covers the rounding of the products below.
        const SLACK: f32 = 16.0 * HALF_ULP;
        let mut near = L::splat(0.0);
        let mut far = L::splat(f32::INFINITY);
        for k in 0..3 {
            let (a, b) = if self.upward[k] { (&min[k], &max[k]) } else { (&max[k], &min[k]) };
            near = ((L::load(a) - self.near_origin[k]) * self.reciprocal[k]).max(near);
            far = ((L::load(b) - self.far_origin[k]) * self.reciprocal[k]).min(far);
        }
        let near = near * L::splat(1.0 - SLACK);
        let entered = near.less_equal(far * L::splat(1.0 + SLACK)) & near.less_equal(L::splat(latest));
        (near, entered)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::Plain;

    /// Xorshift (Marsaglia 2003); in [-1, 1).
    fn random(state: &mut u64) -> f32 {
        *state ^= *state << 13;
        *state ^= *state >> 7;
        *state ^= *state << 17;
        (*state >> 40) as f32 / (1u64 << 23) as f32 - 1.0
    }

    /// At an edge in a side of the box, where a ray enters the box and meets the triangle at once.
    #[test]
    fn boxes_are_entered_before_what_they_hold_is_hit() {
        let mut state = 7;
        let (mut hits, mut too_near, mut late) = (0, 0, 0);
        for _ in 0..4_000_000 {
            let mut point = || -> [f32; 3] { std::array::from_fn(|_| random(&mut state)) };
            let (a, c, direction) = (point(), point(), point());
            let b = [a[0], a[1] + 2.0, a[2]];
            let c: [f32; 3] = std::array::from_fn(|k| a[k] + c[k] * [0.1, 2.0, 1.0][k]);
            let along = 1.0 + random(&mut state);
            let inside = 1e-6 * (1.0 + random(&mut state));
            let to = [a[0] + inside * (c[0] - a[0]), a[1] + along, a[2] + inside * (c[2] - a[2])];
            let away = 1.1 + random(&mut state);
            let from: [f32; 3] = std::array::from_fn(|k| to[k] - away * direction[k]);
            let Some(ray) = Ray::new(from, direction) else { continue };
            let Some(hit) = ray.intersect(&[a, b, c]) else { continue };
            let [a, b, c] = [a, b, c].map(|[x, y, z]| Bounds { min: [x, y, z, 0.0], max: [x, y, z, 0.0] });
            let bounds = a.union(&b).union(&c);
            let slabs = Slabs::<Plain>::new(&ray, &bounds);
            let rows = |corner: [f32; 4]| [0, 1, 2].map(|k: usize| Row([corner[k]; 8]));
            let (entry, entered) =
                slabs.enter(&rows(bounds.min), &rows(bounds.max), slabs.latest_entry(hit.t));
            hits += 1;
            too_near += u32::from(entry.store().0[0] > hit.t);
            late += u32::from(Plain::bits(entered) == 0);
        }
        assert!(hits > 100_000, "{hits}");
        assert!(too_near > 0, "{too_near} of {hits}");
        assert_eq!(late, 0, "of {hits}");
    }
}
