// SPDX-License-Identifier: GPL-3.0-or-later
//! Axis-aligned boxes of finite coordinates.

/// Of what bounds nothing, such as a missing child: `min` is +EMPTY and `max` is -EMPTY. Finite, so that shader
/// arithmetic on it makes no NaN.
pub const EMPTY: f32 = 3.0e38;

/// Four lanes, of which the last is unused: min and max then compile to vector instructions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bounds {
    pub(crate) min: [f32; 4],
    pub(crate) max: [f32; 4],
}

impl Bounds {
    pub(crate) const EMPTY: Bounds = Bounds { min: [EMPTY; 4], max: [-EMPTY; 4] };

    #[inline]
    pub(crate) fn union(&self, other: &Bounds) -> Bounds {
        let mut result = *self;
        for lane in 0..4 {
            // Not f32::min: the coordinates are finite, and this is one instruction.
            if other.min[lane] < result.min[lane] {
                result.min[lane] = other.min[lane];
            }
            if other.max[lane] > result.max[lane] {
                result.max[lane] = other.max[lane];
            }
        }
        result
    }

    /// Float64, because squares of float32 lengths overflow and underflow. 0 if empty.
    #[inline]
    pub(crate) fn half_area(&self) -> f64 {
        let [x, y, z] = [0, 1, 2].map(|k| (self.max[k] as f64 - self.min[k] as f64).max(0.0));
        x * y + y * z + z * x
    }
}
