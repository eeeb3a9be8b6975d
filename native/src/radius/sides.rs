// SPDX-License-Identifier: GPL-3.0-or-later
//! The sides of surfaces, whose light is told apart.

/// Surfaces are told apart by the axes that they face: +x, -x, +y, -y, +z, -z. The light on one side of
/// a wall says nothing about the other.
pub(super) const SIDES: usize = 6;
/// Surfaces and photons count for the axes to which their normal has at least this cosine: one to three
/// of them, since to the nearest it has 0.577 or more.
const FACING: f32 = 0.5;

/// The sides for which a surface or a photon counts.
#[inline]
pub(super) fn sides_of(normal: [f32; 3]) -> impl Iterator<Item = usize> {
    let facing = (0..3).filter(move |&axis: &usize| normal[axis].abs() >= FACING);
    facing.map(move |axis| 2 * axis + usize::from(normal[axis] < 0.0))
}

/// The same, a bit for each.
#[inline]
pub(super) fn facing_bits(normal: [f32; 3]) -> usize {
    let bits = |k: usize| usize::from(normal[k] >= FACING) | usize::from(normal[k] <= -FACING) << 1;
    bits(0) | bits(1) << 2 | bits(2) << 4
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Both ways to tell the sides that a normal counts for, at its bounds, too.
    #[test]
    fn sides_and_their_bits() {
        let some = [0.0, -0.0, 0.3, FACING.next_down(), FACING, 0.8, 1.0, f32::NAN];
        let values: Vec<f32> = some.iter().flat_map(|&x| [x, -x]).collect();
        for &x in &values {
            for &y in &values {
                for &z in &values {
                    let bits: usize = sides_of([x, y, z]).map(|side| 1 << side).sum();
                    assert_eq!(facing_bits([x, y, z]), bits, "{x} {y} {z}");
                }
            }
        }
    }
}
