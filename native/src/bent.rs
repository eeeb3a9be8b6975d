// SPDX-License-Identifier: GPL-3.0-or-later
//! Lambert's lobe about a normal that nodes have bent (glsl/lib/bump_shadowing.glsl).

use crate::lanes::Lanes;
use crate::vector::dot;

/// The most that cosine(bent normal) / cosine(geometric normal) may scale flux (glsl/lib/constants.glsl): little
/// comes from so low.
pub(crate) const BRIGHTEST: f32 = 16.0;
const LEAST: f32 = 1.0e-6; // cosine with the smooth surface

/// Of a visible point.
pub(crate) struct Bent {
    normal: [f32; 3],
    base: [f32; 3], // of the smooth surface
    geometric: [f32; 3],
    side: f32,   // the cosine between normal and base
    alpha2: f32, // of the masking that darkens softly towards behind the base
}

impl Bent {
    /// Of the streams Shading and Base (layouts.rs); None: the normal is not bent.
    pub(crate) fn of(shading: [f32; 4], base: [f32; 4], geometric: [f32; 3]) -> Option<Bent> {
        let [x, y, z, _] = shading;
        let [bx, by, bz, is_bent] = base;
        let (normal, base) = ([x, y, z], [bx, by, bz]);
        let side = dot(base, normal);
        let alpha2 = (0.125 * (1.0 / (side * side) - 1.0)).clamp(0.0, 1.0);
        (is_bent > 0.0).then_some(Bent { normal, base, geometric, side, alpha2 })
    }

    /// What the lobe makes of flux that fell on the triangle along these unit vectors.
    #[inline(always)]
    pub(crate) fn share<L: Lanes>(&self, to_light: [L; 3]) -> L {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let fell = L::dot(to_light, L::splat3(self.geometric));
        let cosine = L::dot(to_light, L::splat3(self.normal));
        let brighter = (cosine / fell).min(L::splat(BRIGHTEST));
        let seen = zero.less(fell) & zero.less(cosine);
        if self.normal == self.base {
            return brighter.keep(seen);
        }
        let light = L::dot(to_light, L::splat3(self.base));
        let leaks = (light * L::splat(self.side) * cosine).less(zero);
        let square = light * light;
        let slope = L::splat(self.alpha2) * (one / square - one).max(zero);
        let masked = L::splat(2.0) / (one + (one + slope).sqrt());
        (brighter * masked).keep(seen & !leaks & L::splat(LEAST).less_equal(light.abs()))
    }
}
