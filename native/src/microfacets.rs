// SPDX-License-Identifier: GPL-3.0-or-later
//! Lobes of microfacets of a visible point, which photons are gathered with (glsl/lib/ggx.glsl).

use crate::lanes::Lanes;
use crate::phong::MOST_BRIGHTER;
use crate::vector::{dot, frame_about};

const HORIZON: f32 = 1.0e-6; // no lobe below this cosine
const ASPECT_STEPS: f32 = 585.0; // an octave
const TURN_STEPS: f32 = 2048.0; // half a turn

/// A visible point's lobes, of two at most, as a record each of Scaled, Based and Dipped (layouts.rs).
pub(crate) type Records = [[[f32; 4]; 3]; 2];

/// Of a point, seen from where the viewer is.
pub(crate) struct Microfacets {
    geometric: [f32; 3],
    normal: [f32; 3],
    lobes: [Option<Lobe>; 2],
}

struct Lobe {
    frame: [[f32; 3]; 2], // tangent and bitangent
    viewer: [f32; 3],     // along these and the normal
    alpha: [f32; 2],      // along tangent and bitangent
    stretched: f32,       // the viewer, by alpha
    scale: [f32; 3],      // with the normals' constant factors
    f0: [f32; 3],         // reflectance head-on
    dip: [f32; 3],        // what a metal's curve falls by below Schlick's
    ior: f32,             // of a dielectric, whose curve leads from f0 to 1; 0: Schlick's
}

impl Microfacets {
    /// None: nothing is gathered. `gathered` is a Gathered (layouts.rs), `to_viewer` a unit vector.
    pub(crate) fn of(
        gathered: [f32; 4],
        records: &Records,
        to_viewer: [f32; 3],
        geometric: [f32; 3],
    ) -> Option<Microfacets> {
        let [x, y, z, albedo] = gathered;
        let normal = [x, y, z];
        if !(albedo > 0.0 && dot(to_viewer, normal) > HORIZON) {
            return None;
        }
        let [first, second] = records;
        let lobes = [Lobe::of(first, normal, to_viewer), Lobe::of(second, normal, to_viewer)];
        Some(Microfacets { geometric, normal, lobes })
    }

    /// The BSDF [1/sr] for light from these directions (unit vectors), times its cosine with the shading normal over
    /// that with the geometric normal: flux is measured on the triangle.
    #[inline(always)]
    pub(crate) fn value<L: Lanes>(&self, to_light: [L; 3]) -> [L; 3] {
        let zero = L::splat(0.0);
        let cosine = L::dot(to_light, L::splat3(self.normal));
        let fell = L::dot(to_light, L::splat3(self.geometric));
        let seen = L::splat(HORIZON).less(cosine) & zero.less(fell);
        let mut sum = [zero; 3];
        if L::bits(seen) == 0 {
            return sum;
        }
        for lobe in self.lobes.iter().flatten() {
            let value = lobe.value(to_light, cosine);
            sum = [sum[0] + value[0], sum[1] + value[1], sum[2] + value[2]];
        }
        let brighter = (cosine / fell).min(L::splat(MOST_BRIGHTER));
        [(sum[0] * brighter).keep(seen), (sum[1] * brighter).keep(seen), (sum[2] * brighter).keep(seen)]
    }
}

impl Lobe {
    fn of(records: &[[f32; 4]; 3], normal: [f32; 3], to_viewer: [f32; 3]) -> Option<Lobe> {
        let [[red, green, blue, both], [r, g, b, ior], [dip_r, dip_g, dip_b, code]] = *records;
        if !(red > 0.0 || green > 0.0 || blue > 0.0) {
            return None;
        }
        let rest = (code * 0.5).floor();
        let steps = (rest / TURN_STEPS).floor();
        let aspect = (-steps / ASPECT_STEPS).exp2();
        let angle = (rest - steps * TURN_STEPS) * (std::f32::consts::PI / TURN_STEPS);
        let (sin, cos) = if steps > 0.0 { angle.sin_cos() } else { (0.0, 1.0) };
        let (x, y) = frame_about(normal);
        let turned = |a: f32, b: f32| std::array::from_fn(|i| a * x[i] + b * y[i]);
        let frame = [turned(cos, sin), turned(-sin, cos)];
        let viewer = [dot(to_viewer, frame[0]), dot(to_viewer, frame[1]), dot(to_viewer, normal)];
        let alpha = [both / aspect, both * aspect];
        let along = [alpha[0] * viewer[0], alpha[1] * viewer[1], viewer[2]];
        let constant = 0.5 / (std::f32::consts::PI * alpha[0] * alpha[1]);
        Some(Lobe {
            frame,
            viewer,
            alpha,
            stretched: dot(along, along).sqrt(),
            scale: [red * constant, green * constant, blue * constant],
            f0: [r, g, b],
            dip: [dip_r, dip_g, dip_b],
            ior,
        })
    }

    #[inline(always)]
    fn value<L: Lanes>(&self, to_light: [L; 3], lz: L) -> [L; 3] {
        let (lx, ly) =
            (L::dot(to_light, L::splat3(self.frame[0])), L::dot(to_light, L::splat3(self.frame[1])));
        let [vx, vy, vz] = L::splat3(self.viewer);
        let [ax, ay] = [L::splat(self.alpha[0]), L::splat(self.alpha[1])];
        let [hx, hy, hz] = [lx + vx, ly + vy, lz + vz];
        let h2 = hx * hx + hy * hy + hz * hz;
        let [sx, sy] = [hx / ax, hy / ay];
        let q = h2 / (sx * sx + sy * sy + hz * hz).max(L::splat(1.0e-37));
        let [x, y] = [ax * lx, ay * ly];
        let stretched = (x * x + y * y + lz * lz).sqrt();
        let f = q * q / (lz * L::splat(self.stretched) + vz * stretched);
        let one = L::splat(1.0);
        let cosine = ((hx * vx + hy * vy + hz * vz) / h2.sqrt()).min(one).max(L::splat(0.0));
        let [r, g, b] = self.fresnel(cosine);
        let [red, green, blue] = L::splat3(self.scale);
        [f * r * red, f * g * green, f * b * blue]
    }

    #[inline(always)]
    fn fresnel<L: Lanes>(&self, cosine: L) -> [L; 3] {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let (share, dip) = if self.ior > 0.0 {
            (share(cosine, self.ior), zero)
        } else {
            let s = one - cosine;
            let s5 = s * s * s * s * s;
            (s5, cosine * s5 * s)
        };
        let [r, g, b] = self.f0;
        let [dip_r, dip_g, dip_b] = self.dip;
        [curve(r, share, dip_r, dip), curve(g, share, dip_g, dip), curve(b, share, dip_b, dip)]
    }
}

/// A channel's reflectance, from its own head-on to 1.
#[inline(always)]
fn curve<L: Lanes>(f0: f32, share: L, by: f32, dip: L) -> L {
    let found = L::splat(f0) + L::splat(1.0 - f0) * share - L::splat(by) * dip;
    found.min(L::splat(1.0)).max(L::splat(0.0))
}

/// Where a dielectric's reflectance stands between its own at normal incidence (0) and 1 (1).
#[inline(always)]
fn share<L: Lanes>(cosine: L, ior: f32) -> L {
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    let r = (ior - 1.0) / (ior + 1.0);
    let f0 = r * r;
    let g2 = L::splat(ior * ior - 1.0) + cosine * cosine;
    let g = g2.max(zero).sqrt();
    let (more, less) = (g + cosine, g - cosine);
    let s = less / more;
    let p = (cosine * more - one) / (cosine * less + one);
    let found = L::splat(0.5) * s * s * (one + p * p);
    let is_total = g2.less_equal(zero);
    let reflected = found.keep(!is_total) + one.keep(is_total);
    ((reflected - L::splat(f0)) * L::splat(1.0 / (1.0 - f0))).min(one).max(zero)
}
