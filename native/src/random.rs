// SPDX-License-Identifier: GPL-3.0-or-later
//! The random numbers of glsl/lib/rng.glsl, bit for bit.

// Where each kernel's dimensions begin; a path's bounce or depth is added.
pub(crate) const DIMENSION_LIGHT: u32 = 0;
pub(crate) const DIMENSION_REFLECT: u32 = 0x100;
pub(crate) const DIMENSION_COVERAGE: u32 = 0x1800;
pub(crate) const DIMENSION_EXPECTED: u32 = 0x1e00;
pub(crate) const DIMENSION_WALK: u32 = 0x8000_0000;

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

fn random_bits(seed: u32, pass_index: u32, element: u32, dimension: u32) -> [u32; 4] {
    pcg4d([element, dimension, pass_index, mix_bits(seed)])
}

/// Four independent uniform numbers in [0, 1).
pub fn random4(seed: u32, pass_index: u32, element: u32, dimension: u32) -> [f32; 4] {
    random_bits(seed, pass_index, element, dimension).map(|x| (x >> 8) as f32 / 16_777_216.0)
}

/// Point n of the R2 sequence (Roberts 2018), shifted by `start`, modulo 1.
pub fn r2_sequence(start: [f32; 2], n: u32) -> [f32; 2] {
    stepped(start, [3_242_174_889, 2_447_445_414], n)
}

/// The same for two dimensions more, as glsl/lib/rng.glsl has them.
pub fn second_sequence(start: [f32; 2], n: u32) -> [f32; 2] {
    stepped(start, [2_726_840_505, 1_455_715_471], n)
}

/// `n` steps, in units of 2^-32, from `start`, modulo 1.
fn stepped(start: [f32; 2], step: [u32; 2], n: u32) -> [f32; 2] {
    std::array::from_fn(|i| (start[i] + (step[i].wrapping_mul(n) >> 8) as f32 / 16_777_216.0).fract())
}

/// even_passes of glsl/lib/rng.glsl: what stands for passes that are even together, and a pass's number among them.
fn even_passes(pass_index: u32) -> (u32, u32) {
    let is_early = pass_index < 4;
    let pair = if is_early { pass_index } else { pass_index >> 1 };
    let number = if is_early { pass_index >> 1 } else { 2 * (pass_index >> 2) + (pass_index & 1) };
    (0x4000_0000 + 2 * (number >> 4) + (pair.count_ones() & 1), number & 15)
}

/// scrambled of glsl/lib/even.glsl: another number for each below 16.
fn scrambled(number: u32, random: u32) -> u32 {
    (0..4).fold(0, |other, level| {
        let (before, bit) = (number >> (4 - level), number >> (3 - level) & 1);
        other << 1 | (bit ^ (random >> ((1 << level) - 1 + before) & 1))
    })
}

/// even_over_passes of glsl/lib/even.glsl: two numbers that are more even over passes than chance is.
pub fn even_over_passes(seed: u32, pass_index: u32, element: u32, dimension: u32) -> [f32; 2] {
    let (group, number) = even_passes(pass_index);
    let random = random_bits(seed, group, element, dimension);
    let point = sobol4(scrambled(number, random[0]));
    let within = random4(seed, pass_index, element, dimension);
    std::array::from_fn(|i| {
        let part = (point[i] ^ random[2 + i]) >> 28;
        (0.0625 * (part as f32 + within[i])).min(1.0f32.next_down())
    })
}

/// Permutes numbers within aligned blocks of 2^k (shuffled of glsl/lib/rng.glsl).
fn shuffled(x: u32, key: u32) -> u32 {
    let mut x = x.reverse_bits().wrapping_add(key);
    for factor in [0x6c50_b47c, 0xb82f_1e52, 0xc7af_e638, 0x8d22_f6e6u32] {
        x ^= x.wrapping_mul(factor);
    }
    x.reverse_bits()
}

/// Point n of Sobol's sequence in four dimensions (sobol4 of glsl/lib/rng.glsl).
fn sobol4(mut n: u32) -> [u32; 4] {
    let (mut first, mut second) = (1u32 << 31, 1u32 << 31);
    let (mut third, mut fourth) = ([1u32 << 31, 3 << 30], [1u32 << 31, 3 << 30, 1 << 29]);
    let mut point = [0u32; 4];
    while n > 0 {
        if n & 1 != 0 {
            let digit = [first, second, third[0], fourth[0]];
            point = std::array::from_fn(|i| point[i] ^ digit[i]);
        }
        first >>= 1;
        second ^= second >> 1;
        third = [third[1], third[1] ^ third[0] ^ (third[0] >> 2)];
        fourth = [fourth[1], fourth[2], fourth[1] ^ fourth[0] ^ (fourth[0] >> 3)];
        n >>= 1;
    }
    point
}

/// photon_sequence of glsl/lib/rng.glsl: the numbers that a photon, of so many a pass, starts by.
pub fn photon_sequence(seed: u32, pass_index: u32, photon: u32, photons: u32) -> [f32; 4] {
    if pass_index >= 0x8000_0000 {
        return random4(seed, pass_index, photon, DIMENSION_LIGHT);
    }
    let (group, number) = even_passes(pass_index);
    let shuffle = random_bits(seed, group, u32::MAX, DIMENSION_LIGHT);
    let [key, ..] = random_bits(seed, group, u32::MAX - 1, DIMENSION_LIGHT);
    let bits = sobol4(shuffled(number.wrapping_mul(photons).wrapping_add(photon), key));
    std::array::from_fn(|i| ((bits[i] ^ shuffle[i]) >> 8) as f32 / 16_777_216.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of 2^12 points each box of a volume of 2^-10 that halving leaves in the first two dimensions has its share; of
    /// one of 2^-8 in all four.
    #[test]
    fn boxes_have_their_share_of_photons() {
        let points: Vec<[f32; 4]> =
            (0..1 << 12).map(|photon| photon_sequence(3, 2, photon, 1 << 12)).collect();
        let counts = |halvings: [u32; 4]| {
            let mut counts = vec![0; 1 << halvings.iter().sum::<u32>()];
            for point in &points {
                let place = |at: usize, k: usize| {
                    (at << halvings[k]) + (point[k] * (1 << halvings[k]) as f32) as usize
                };
                counts[(0..4).fold(0, place)] += 1;
            }
            counts
        };
        for first in 0..=10 {
            assert!(counts([first, 10 - first, 0, 0]).iter().all(|&n| n == 4), "{first}");
        }
        assert!(counts([2, 2, 2, 2]).iter().all(|&n| n == 16));
        // Passes of one half go on with it, and the halves know nothing of each other.
        assert_eq!(photon_sequence(3, 0, 4096 + 7, 4096), photon_sequence(3, 3, 7, 4096));
        assert_ne!(photon_sequence(3, 0, 4096 + 7, 4096), photon_sequence(3, 2, 7, 4096));
    }
}
