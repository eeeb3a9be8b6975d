// SPDX-License-Identifier: GPL-3.0-or-later
//! Phong's lobe of a visible point, which photons are gathered with (glsl/kernels/gather.glsl).

use crate::lanes::Lanes;

/// The most that cosine(shading normal) / cosine(geometric normal) may scale a photon's flux.
pub(crate) const MOST_BRIGHTER: f32 = 4.0;
/// Steps of an exponent, a power of two: by as many roots less one a photon's cosine is raised to a fraction.
const STEPS: u32 = 64;
const LEAST: f32 = 1.0e-12; // of what counts: smaller powers might take the processor's slow way to 0

/// A lobe, seen from where the viewer is.
pub(crate) struct PhongLobe {
    mirrored: [f32; 3],
    normal: [f32; 3],
    geometric: [f32; 3],
    /// At the mirrored direction [1/sr].
    peak: [f32; 3],
    exponent: u32,     // in steps
    least_cosine: f32, // with the mirrored direction
}

impl PhongLobe {
    /// Of the streams Gathered, PlainLobe and PlainPeak (layouts.rs); None: nothing is gathered.
    pub(crate) fn of(
        gathered: [f32; 4],
        lobe: [f32; 4],
        peak: [f32; 4],
        geometric: [f32; 3],
    ) -> Option<PhongLobe> {
        let [nx, ny, nz, albedo] = gathered;
        let [mx, my, mz, exponent] = lobe;
        (albedo > 0.0).then(|| PhongLobe {
            mirrored: [mx, my, mz],
            normal: [nx, ny, nz],
            geometric,
            peak: [peak[0], peak[1], peak[2]],
            exponent: (exponent * STEPS as f32).round() as u32,
            least_cosine: LEAST.powf(1.0 / exponent.max(1.0e-3)),
        })
    }

    /// The BSDF [1/sr] for light from these directions (unit vectors), times its cosine with the shading normal over
    /// that with the geometric normal: flux is measured on the triangle.
    #[inline(always)]
    pub(crate) fn value<L: Lanes>(&self, to_light: [L; 3]) -> [L; 3] {
        let zero = L::splat(0.0);
        let cosine = L::dot(to_light, L::splat3(self.normal));
        let fell = L::dot(to_light, L::splat3(self.geometric));
        let with_mirrored = L::dot(to_light, L::splat3(self.mirrored));
        let seen = zero.less(cosine) & zero.less(fell) & L::splat(self.least_cosine).less(with_mirrored);
        let brighter = (cosine / fell).min(L::splat(MOST_BRIGHTER));
        let value = (self.power(with_mirrored.max(zero)) * brighter).keep(seen);
        let [red, green, blue] = L::splat3(self.peak);
        [value * red, value * green, value * blue]
    }

    /// x to the exponent: squares for its whole part, roots for the rest.
    #[inline(always)]
    fn power<L: Lanes>(&self, x: L) -> L {
        let mut power = L::splat(1.0);
        let (mut whole, mut square) = (self.exponent / STEPS, x);
        while whole > 0 {
            if whole & 1 == 1 {
                power = power * square;
            }
            whole >>= 1;
            if whole > 0 {
                square = square * square;
            }
        }
        let (mut rest, mut root) = (self.exponent % STEPS, x);
        while rest > 0 {
            root = root.sqrt();
            rest *= 2;
            if rest >= STEPS {
                power = power * root;
                rest -= STEPS;
            }
        }
        power
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::Plain;

    #[test]
    fn powers() {
        for exponent in [0.25, 1.0, 9.984375, 12.5, 60.0] {
            let up = [0.0, 0.0, 1.0];
            let lobe = PhongLobe::of([0.0, 0.0, 1.0, 1.0], [0.0, 0.0, 1.0, exponent], [1.0; 4], up).unwrap();
            for x in [0.3f32, 0.9, 1.0] {
                let found = lobe.power(Plain::splat(x)).store().0[3];
                assert!((found / x.powf(exponent) - 1.0).abs() < 1e-5, "{x} ^ {exponent} is not {found}");
            }
        }
    }
}
