// SPDX-License-Identifier: GPL-3.0-or-later
//! Vectors of three, as glsl/lib has them.

use std::f32::consts::PI;

pub(crate) type Vector = [f32; 3];

pub(crate) fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(crate) fn largest(v: Vector) -> f32 {
    v[0].max(v[1].max(v[2]))
}

pub(crate) type Vector64 = [f64; 3];

pub(crate) fn dot64(a: Vector64, b: Vector64) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn cross64(a: Vector64, b: Vector64) -> Vector64 {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(crate) fn minus64(a: Vector64, b: Vector64) -> Vector64 {
    std::array::from_fn(|k| a[k] - b[k])
}

/// The unit normal of a triangle. Scaled up before the cross product: a tiny triangle's area would
/// underflow.
pub(crate) fn normal_of([a, b, c]: &[[f32; 4]; 3]) -> [f32; 3] {
    let ab: [f32; 3] = std::array::from_fn(|k| b[k] - a[k]);
    let ac: [f32; 3] = std::array::from_fn(|k| c[k] - a[k]);
    let scale = 1.0 / ab.iter().chain(&ac).fold(0.0, |m: f32, x| m.max(x.abs()));
    let (ab, ac) = (ab.map(|x| x * scale), ac.map(|x| x * scale));
    let n = cross(ab, ac);
    let length = dot(n, n).sqrt();
    n.map(|x| x / length)
}

/// Where in a triangle barycentric coordinates are.
pub(crate) fn point_in([a, b, c]: &[[f32; 4]; 3], u: f32, v: f32) -> [f32; 3] {
    let weight = 1.0 - u - v;
    std::array::from_fn(|k| weight * a[k] + u * b[k] + v * c[k])
}

/// Two unit vectors orthogonal to the unit vector n and each other (Duff et al. 2017).
pub(crate) fn frame_about(n: [f32; 3]) -> ([f32; 3], [f32; 3]) {
    let s = if n[2] >= 0.0 { 1.0 } else { -1.0 };
    let a = -1.0 / (s + n[2]);
    let b = n[0] * n[1] * a;
    ([1.0 + s * n[0] * n[0] * a, s * b, -s * n[0]], [b, s + n[1] * n[1] * a, -n[1]])
}

/// The same of a vector of f64.
pub(crate) fn frame_about64(n: Vector64) -> (Vector64, Vector64) {
    let s = if n[2] >= 0.0 { 1.0 } else { -1.0 };
    let a = -1.0 / (s + n[2]);
    let b = n[0] * n[1] * a;
    ([1.0 + s * n[0] * n[0] * a, s * b, -s * n[0]], [b, s + n[1] * n[1] * a, -n[1]])
}

/// A vector given in the frame whose third axis is the unit vector n.
pub(crate) fn from_frame(n: [f32; 3], local: [f32; 3]) -> [f32; 3] {
    let (tangent, bitangent) = frame_about(n);
    std::array::from_fn(|k| local[0] * tangent[k] + local[1] * bitangent[k] + local[2] * n[k])
}

/// Sine and cosine of `turns` full turns, 0 <= turns <= 1, to 1.2e-7: a library's, which must reduce
/// any angle, takes longer. Polynomials of Cephes' sinf and cosf.
pub(crate) fn sin_cos_of_turns(turns: f32) -> (f32, f32) {
    let quarter = (4.0 * turns + 0.5).floor();
    let x = (turns - 0.25 * quarter) * (2.0 * PI); // within an eighth of a turn; the difference is exact
    let z = x * x;
    let sin = ((-1.951_529_6e-4 * z + 8.332_161e-3) * z - 1.666_665_5e-1) * z * x + x;
    let cos = ((2.443_315_7e-5 * z - 1.388_731_6e-3) * z + 4.166_664_6e-2) * z * z - 0.5 * z + 1.0;
    match quarter as i32 & 3 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns() {
        for i in 0..=100_000 {
            let turns = i as f32 / 100_000.0;
            let (sin, cos) = sin_cos_of_turns(turns);
            let (true_sin, true_cos) = (2.0 * std::f64::consts::PI * f64::from(turns)).sin_cos();
            assert!((f64::from(sin) - true_sin).abs() < 1.2e-7, "{turns}: {sin} {true_sin}");
            assert!((f64::from(cos) - true_cos).abs() < 1.2e-7, "{turns}: {cos} {true_cos}");
        }
    }

    #[test]
    fn frames_are_orthonormal() {
        for n in [[0.0, 0.0, 1.0], [0.0, 0.0, -1.0], [0.6, 0.0, -0.8], [0.36, 0.48, 0.8]] {
            let (t, b) = frame_about(n);
            for (x, y, expected) in [(t, t, 1.0), (b, b, 1.0), (t, b, 0.0), (t, n, 0.0), (b, n, 0.0)] {
                assert!((dot(x, y) - expected).abs() < 1e-6, "{n:?}");
            }
            assert_eq!(from_frame(n, [0.0, 0.0, 1.0]), n);
        }
    }
}
