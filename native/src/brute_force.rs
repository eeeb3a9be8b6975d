// SPDX-License-Identifier: GPL-3.0-or-later
//! Traces rays against every triangle in float64, by another algorithm than the renderer's: an
//! oracle for tests.

use crate::trace::Rays;
use crate::watertight::Ray;
use crate::watertight::Triangle;

/// Position of the triangle, t, u, v; as [`crate::watertight::Hit`] but in float64.
pub type Hit64 = (i32, f64, f64, f64);

/// The closest hit of every ray with any triangle: the point on the triangle's plane, and its
/// barycentric coordinates from areas in the projection along the largest component of the normal.
///
/// Not watertight: rounding decides about a ray through an edge.
pub fn trace(corners: &[Triangle], rays: &Rays) -> Vec<Option<Hit64>> {
    rays.map(None, |ray, t_max, skip| {
        let mut best: Option<Hit64> = None;
        for (position, triangle) in corners.iter().enumerate().filter(|(i, _)| *i as i32 != skip) {
            if let Some((t, u, v)) = intersect(ray, triangle) {
                let limit = best.map_or(f64::from(t_max), |best| best.1);
                if t < limit {
                    best = Some((position as i32, t, u, v));
                }
            }
        }
        best.map(Some)
    })
}

fn intersect(ray: &Ray, triangle: &Triangle) -> Option<(f64, f64, f64)> {
    let [a, b, c] = triangle.map(|p| p.map(f64::from));
    let (o, d) = (ray.origin().map(f64::from), ray.direction().map(f64::from));
    let normal = cross(sub(b, a), sub(c, a));
    let t = dot(normal, sub(a, o)) / dot(normal, d);
    // False for NaN, and for the infinity of a ray in the plane.
    if !(t > 0.0 && t < f64::INFINITY) {
        return None;
    }
    let k = (0..3).max_by(|&i, &j| normal[i].abs().total_cmp(&normal[j].abs()))?;
    let (i, j) = ((k + 1) % 3, (k + 2) % 3);
    let point: [f64; 3] = std::array::from_fn(|k| o[k] + t * d[k]);
    let area = |p: [f64; 3], q: [f64; 3]| (p[i] - a[i]) * (q[j] - a[j]) - (p[j] - a[j]) * (q[i] - a[i]);
    let (u, v) = (area(point, c) / normal[k], area(b, point) / normal[k]);
    (u >= 0.0 && v >= 0.0 && u + v <= 1.0).then_some((t, u, v))
}

fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| a[k] - b[k])
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| {
        let (i, j) = ((k + 1) % 3, (k + 2) % 3);
        a[i] * b[j] - a[j] * b[i]
    })
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
