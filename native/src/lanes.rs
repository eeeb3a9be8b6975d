// SPDX-License-Identifier: GPL-3.0-or-later
//! Eight floats at once: AVX registers where the processor has AVX2, else plain arrays.
//!
//! Both round every operation alike (no fused multiply-adds), so results have the same bits.
//! Code that uses [`Lanes`] must be `#[inline(always)]` all the way up to a function made by
//! [`widest`], and keep lanes out of closures: whatever stays a function of its own is compiled
//! without AVX2, and calls one for each operation.

use std::fmt::Debug;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Not, Sub};

pub(crate) const WIDTH: usize = 8;

/// Eight floats in memory.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C, align(32))]
pub(crate) struct Row(pub(crate) [f32; WIDTH]);

/// 0, 1, ... 7
pub(crate) const COUNTING: Row = Row([0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);

/// Eight floats to compute with. Comparisons are false for NaN.
pub(crate) trait Lanes:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// Eight times yes or no.
    type Mask: Copy
        + Debug
        + BitAnd<Output = Self::Mask>
        + BitOr<Output = Self::Mask>
        + Not<Output = Self::Mask>;

    fn load(row: &Row) -> Self;
    fn store(self) -> Row;
    fn splat(x: f32) -> Self;
    fn sqrt(self) -> Self;
    fn abs(self) -> Self;
    /// `if self < other { self } else { other }`
    fn min(self, other: Self) -> Self;
    /// `if self > other { self } else { other }`
    fn max(self, other: Self) -> Self;
    fn less(self, other: Self) -> Self::Mask;
    fn less_equal(self, other: Self) -> Self::Mask;
    fn equal(self, other: Self) -> Self::Mask;
    /// 0 where the mask says no.
    fn keep(self, mask: Self::Mask) -> Self;
    /// One bit a lane.
    fn bits(mask: Self::Mask) -> u32;

    #[inline(always)]
    fn splat3(v: [f32; 3]) -> [Self; 3] {
        [Self::splat(v[0]), Self::splat(v[1]), Self::splat(v[2])]
    }

    #[inline(always)]
    fn load3(rows: &[Row; 3]) -> [Self; 3] {
        [Self::load(&rows[0]), Self::load(&rows[1]), Self::load(&rows[2])]
    }

    /// The dot products of vectors.
    #[inline(always)]
    fn dot(a: [Self; 3], b: [Self; 3]) -> Self {
        a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    }

    #[inline(always)]
    fn sum(self) -> f32 {
        let [a, b, c, d, e, f, g, h] = self.store().0;
        ((a + b) + (c + d)) + ((e + f) + (g + h))
    }
}

/// Plain arrays, of which compilers make vector instructions where they see how.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Plain([f32; WIDTH]);

/// A bit a lane.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PlainMask(u32);

impl Plain {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        Plain(std::array::from_fn(|i| f(self.0[i], other.0[i])))
    }

    #[inline(always)]
    fn compare(self, other: Self, f: impl Fn(f32, f32) -> bool) -> PlainMask {
        PlainMask((0..WIDTH).fold(0, |bits, i| bits | u32::from(f(self.0[i], other.0[i])) << i))
    }
}

macro_rules! operator {
    ($Type:ident, $Trait:ident, $method:ident, $f:expr) => {
        impl $Trait for $Type {
            type Output = $Type;
            #[inline(always)]
            fn $method(self, other: $Type) -> $Type {
                $f(self, other)
            }
        }
    };
}
operator!(Plain, Add, add, |a: Plain, b| a.zip(b, |a, b| a + b));
operator!(Plain, Sub, sub, |a: Plain, b| a.zip(b, |a, b| a - b));
operator!(Plain, Mul, mul, |a: Plain, b| a.zip(b, |a, b| a * b));
operator!(Plain, Div, div, |a: Plain, b| a.zip(b, |a, b| a / b));
operator!(PlainMask, BitAnd, bitand, |a: PlainMask, b: PlainMask| PlainMask(a.0 & b.0));
operator!(PlainMask, BitOr, bitor, |a: PlainMask, b: PlainMask| PlainMask(a.0 | b.0));

impl Not for PlainMask {
    type Output = PlainMask;
    #[inline(always)]
    fn not(self) -> PlainMask {
        PlainMask(!self.0 & 0xff)
    }
}

impl Lanes for Plain {
    type Mask = PlainMask;

    #[inline(always)]
    fn load(row: &Row) -> Self {
        Plain(row.0)
    }
    #[inline(always)]
    fn store(self) -> Row {
        Row(self.0)
    }
    #[inline(always)]
    fn splat(x: f32) -> Self {
        Plain([x; WIDTH])
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Plain(self.0.map(f32::sqrt))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Plain(self.0.map(f32::abs))
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn less(self, other: Self) -> PlainMask {
        self.compare(other, |a, b| a < b)
    }
    #[inline(always)]
    fn less_equal(self, other: Self) -> PlainMask {
        self.compare(other, |a, b| a <= b)
    }
    #[inline(always)]
    fn equal(self, other: Self) -> PlainMask {
        self.compare(other, |a, b| a == b)
    }
    #[inline(always)]
    fn keep(self, mask: PlainMask) -> Self {
        Plain(std::array::from_fn(|i| if mask.0 >> i & 1 == 1 { self.0[i] } else { 0.0 }))
    }
    #[inline(always)]
    fn bits(mask: PlainMask) -> u32 {
        mask.0
    }
}

#[cfg(target_arch = "x86_64")]
pub(crate) mod avx {
    use super::{Add, BitAnd, BitOr, Div, Lanes, Mul, Not, Row, Sub, WIDTH};
    use std::arch::x86_64::*;

    /// An AVX register. [`super::widest`] uses it where the processor has AVX2, and nothing else may.
    #[derive(Debug, Clone, Copy)]
    pub(crate) struct Avx(__m256);

    /// All bits of a lane set, or none.
    #[derive(Debug, Clone, Copy)]
    pub(crate) struct AvxMask(__m256);

    // SAFETY, for every block below: see Avx.
    operator!(Avx, Add, add, |a: Avx, b: Avx| Avx(unsafe { _mm256_add_ps(a.0, b.0) }));
    operator!(Avx, Sub, sub, |a: Avx, b: Avx| Avx(unsafe { _mm256_sub_ps(a.0, b.0) }));
    operator!(Avx, Mul, mul, |a: Avx, b: Avx| Avx(unsafe { _mm256_mul_ps(a.0, b.0) }));
    operator!(Avx, Div, div, |a: Avx, b: Avx| Avx(unsafe { _mm256_div_ps(a.0, b.0) }));
    operator!(AvxMask, BitAnd, bitand, |a: AvxMask, b: AvxMask| AvxMask(unsafe { _mm256_and_ps(a.0, b.0) }));
    operator!(AvxMask, BitOr, bitor, |a: AvxMask, b: AvxMask| AvxMask(unsafe { _mm256_or_ps(a.0, b.0) }));

    impl Not for AvxMask {
        type Output = AvxMask;
        #[inline(always)]
        fn not(self) -> AvxMask {
            AvxMask(unsafe { _mm256_xor_ps(self.0, _mm256_castsi256_ps(_mm256_set1_epi32(-1))) })
        }
    }

    impl Lanes for Avx {
        type Mask = AvxMask;

        #[inline(always)]
        fn load(row: &Row) -> Self {
            Avx(unsafe { _mm256_load_ps(row.0.as_ptr()) })
        }
        #[inline(always)]
        fn store(self) -> Row {
            let mut row = Row([0.0; WIDTH]);
            unsafe { _mm256_store_ps(row.0.as_mut_ptr(), self.0) };
            row
        }
        #[inline(always)]
        fn splat(x: f32) -> Self {
            Avx(unsafe { _mm256_set1_ps(x) })
        }
        #[inline(always)]
        fn sqrt(self) -> Self {
            Avx(unsafe { _mm256_sqrt_ps(self.0) })
        }
        #[inline(always)]
        fn abs(self) -> Self {
            Avx(unsafe { _mm256_andnot_ps(_mm256_set1_ps(-0.0), self.0) })
        }
        #[inline(always)]
        fn min(self, other: Self) -> Self {
            Avx(unsafe { _mm256_min_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn max(self, other: Self) -> Self {
            Avx(unsafe { _mm256_max_ps(self.0, other.0) })
        }
        #[inline(always)]
        fn less(self, other: Self) -> AvxMask {
            AvxMask(unsafe { _mm256_cmp_ps::<_CMP_LT_OQ>(self.0, other.0) })
        }
        #[inline(always)]
        fn less_equal(self, other: Self) -> AvxMask {
            AvxMask(unsafe { _mm256_cmp_ps::<_CMP_LE_OQ>(self.0, other.0) })
        }
        #[inline(always)]
        fn equal(self, other: Self) -> AvxMask {
            AvxMask(unsafe { _mm256_cmp_ps::<_CMP_EQ_OQ>(self.0, other.0) })
        }
        #[inline(always)]
        fn keep(self, mask: AvxMask) -> Self {
            Avx(unsafe { _mm256_and_ps(self.0, mask.0) })
        }
        #[inline(always)]
        fn bits(mask: AvxMask) -> u32 {
            unsafe { _mm256_movemask_ps(mask.0) as u32 }
        }
    }
}

/// Define `$name` over lanes `$L`: with AVX registers where the processor has AVX2, else with arrays.
macro_rules! widest {
    ($(#[$attribute:meta])* $visible:vis fn $name:ident<$L:ident>($($argument:ident: $kind:ty),* $(,)?) $body:block) => {
        $(#[$attribute])*
        $visible fn $name($($argument: $kind),*) {
            #[inline(always)]
            fn with<$L: $crate::lanes::Lanes>($($argument: $kind),*) $body

            #[cfg(target_arch = "x86_64")]
            #[target_feature(enable = "avx2")]
            fn with_avx2($($argument: $kind),*) {
                with::<$crate::lanes::avx::Avx>($($argument),*)
            }

            #[cfg(target_arch = "x86_64")]
            if is_x86_feature_detected!("avx2") {
                // SAFETY: the processor has it.
                return unsafe { with_avx2($($argument),*) };
            }
            with::<$crate::lanes::Plain>($($argument),*)
        }
    };
}
pub(crate) use widest;

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use super::avx::Avx;
    use super::*;

    /// Every operation gives the same bits in both, also for NaN, infinities and signed zeros.
    #[test]
    fn avx_equals_plain() {
        assert!(is_x86_feature_detected!("avx2"), "this processor has no AVX2 to compare with");
        let special = [0.0, -0.0, 1.5, -2.5, f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 1e-40];
        for turn in 0..WIDTH {
            let (a, mut b) = (Row(special), Row(special));
            b.0.rotate_left(turn);
            let (pa, pb) = (Plain::load(&a), Plain::load(&b));
            let (va, vb) = (Avx::load(&a), Avx::load(&b));
            let same = |p: Plain, v: Avx| {
                let (p, v) = (p.store().0, v.store().0);
                let equal = |(p, v): (&f32, &f32)| p.to_bits() == v.to_bits() || (p.is_nan() && v.is_nan());
                assert!(p.iter().zip(&v).all(equal), "{p:?} {v:?}");
            };
            same(pa + pb, va + vb);
            same(pa - pb, va - vb);
            same(pa * pb, va * vb);
            same(pa / pb, va / vb);
            same(pa.min(pb), va.min(vb));
            same(pa.max(pb), va.max(vb));
            same(pa.sqrt(), va.sqrt());
            same(pa.abs(), va.abs());
            same(Plain::splat(3.0), Avx::splat(3.0));
            let masks = [
                (pa.less(pb), va.less(vb)),
                (pa.less_equal(pb), va.less_equal(vb)),
                (pa.equal(pb), va.equal(vb)),
                (!pa.less(pb) & pa.equal(pa), !va.less(vb) & va.equal(va)),
                (pa.less(pb) | pa.equal(pb), va.less(vb) | va.equal(vb)),
            ];
            for (p, v) in masks {
                assert_eq!(Plain::bits(p), Avx::bits(v));
                same(pb.keep(p), vb.keep(v));
            }
        }
    }
}
