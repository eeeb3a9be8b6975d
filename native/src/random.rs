// SPDX-License-Identifier: GPL-3.0-or-later
//! The random numbers of glsl/lib/rng.glsl, bit for bit.

// Where each kernel's dimensions begin; a path's bounce or depth is added.
pub(crate) const DIMENSION_LIGHT: u32 = 0;
pub(crate) const DIMENSION_LIGHT_POINT: u32 = 1;
pub(crate) const DIMENSION_REFLECT: u32 = 0x100;
pub(crate) const DIMENSION_COVERAGE: u32 = 0x1800;

/// Jarzynski & Olano 2020, "Hash Functions for GPU Rendering", pcg4d.
fn pcg4d(v: [u32; 4]) -> [u32; 4] {
    let mut v = v.map(|x| x.wrapping_mul(1664525).wrapping_add(1013904223));
    let mix = |v: &mut [u32; 4]| {
        for (i, j, k) in [(0, 1, 3), (1, 2, 0), (2, 0, 1), (3, 1, 2)] {
            v[i] = v[i].wrapping_add(v[j].wrapping_mul(v[k]));
        }
    };
    mix(&mut v);
    v = v.map(|x| x ^ (x >> 16));
    mix(&mut v);
    v
}

/// Ettinger 2019's "lowbias32".
fn mix_bits(mut x: u32) -> u32 {
    x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
    x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// Four independent uniform numbers in [0, 1).
pub fn random4(seed: u32, pass_index: u32, element: u32, dimension: u32) -> [f32; 4] {
    pcg4d([element, dimension, pass_index, mix_bits(seed)]).map(|x| (x >> 8) as f32 / 16_777_216.0)
}

/// Point n of the R2 sequence (Roberts 2018), shifted by `start`, modulo 1.
pub fn r2_sequence(start: [f32; 2], n: u32) -> [f32; 2] {
    let step = [3_242_174_889u32, 2_447_445_414];
    std::array::from_fn(|i| (start[i] + (step[i].wrapping_mul(n) >> 8) as f32 / 16_777_216.0).fract())
}
