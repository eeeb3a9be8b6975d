// SPDX-License-Identifier: GPL-3.0-or-later
//! Where triangles cross the two levels of a disc that is lifted off its surface.

use super::{Block, LEAF, Stack, Wide};
use crate::lanes::{Lanes, Row, WIDTH};
use crate::watertight::SURFACE_OFFSET;

/// A disc lifted off its surface to two levels, and the box about both.
pub(crate) struct Lifted {
    position: [f32; 3],
    normal: [f32; 3],
    levels: [f32; 2],
    low: [f32; 3],
    high: [f32; 3],
}

impl Lifted {
    pub(crate) fn new(position: [f32; 3], normal: [f32; 3], levels: [f32; 2], radius: f32) -> Lifted {
        let (middle, half) = (0.5 * (levels[0] + levels[1]), 0.5 * (levels[1] - levels[0]));
        // Grown by what positions are rounded.
        let reach = normal.map(|n| radius * (1.0 - n * n).max(0.0).sqrt() + n.abs() * half + SURFACE_OFFSET);
        let middle: [f32; 3] = std::array::from_fn(|k| position[k] + normal[k] * middle);
        let low = std::array::from_fn(|k| middle[k] - reach[k]);
        let high = std::array::from_fn(|k| middle[k] + reach[k]);
        Lifted { position, normal, levels, low, high }
    }
}

impl Wide {
    /// Calls `visit(triangle, its corners' heights above the position)` for the triangles that cross the
    /// plane of either level and may do so within the box. False if the boxes of more than `most` triangles
    /// overlap it, whatever was visited: that is so in any tree of them.
    #[inline(always)]
    pub(crate) fn crossing<L: Lanes>(
        &self,
        disc: &Lifted,
        stack: &mut Stack,
        most: u32,
        mut visit: impl FnMut(i32, [f32; 3]),
    ) -> bool {
        let stack = &mut stack.0;
        let mut looked_at = 0;
        let (region, planes) = (Region::<L>::new(disc), Planes::<L>::new(disc));
        stack[0].0 = 0;
        let mut size = 1;
        while size > 0 {
            size -= 1;
            let reference = stack[size].0;
            if reference & LEAF == 0 {
                let node = &self.nodes[reference as usize];
                let mut inside = L::bits(region.overlaps(&node.min, &node.max));
                while inside != 0 {
                    let lane = inside.trailing_zeros() as usize;
                    inside &= inside - 1;
                    stack[size].0 = node.child[lane];
                    size += 1;
                }
                continue;
            }
            for block in &self.blocks[(reference & !LEAF) as usize..] {
                let there = region.meets(block);
                looked_at += L::bits(there).count_ones();
                if looked_at > most {
                    return false;
                }
                let (mut found, heights) = planes.crossed_by(block, there);
                while found != 0 {
                    let lane = found.trailing_zeros() as usize;
                    found &= found - 1;
                    visit(block.position[lane], [heights[0].0[lane], heights[1].0[lane], heights[2].0[lane]]);
                }
                if !block.more {
                    break;
                }
            }
        }
        true
    }
}

/// The box about a lifted disc.
struct Region<L> {
    low: [L; 3],
    high: [L; 3],
}

impl<L: Lanes> Region<L> {
    #[inline(always)]
    fn new(disc: &Lifted) -> Self {
        Region { low: L::splat3(disc.low), high: L::splat3(disc.high) }
    }

    /// The lanes whose interval along an axis overlaps it.
    #[inline(always)]
    fn spans(&self, axis: usize, min: L, max: L) -> L::Mask {
        min.less_equal(self.high[axis]) & self.low[axis].less_equal(max)
    }

    /// The lanes whose boxes overlap it.
    #[inline(always)]
    fn overlaps(&self, min: &[Row; 3], max: &[Row; 3]) -> L::Mask {
        let x = self.spans(0, L::load(&min[0]), L::load(&max[0]));
        let y = self.spans(1, L::load(&min[1]), L::load(&max[1]));
        let z = self.spans(2, L::load(&min[2]), L::load(&max[2]));
        x & y & z
    }

    /// The lanes whose triangles' boxes overlap it.
    #[inline(always)]
    fn meets(&self, block: &Block) -> L::Mask {
        let used = L::splat(0.0).less(L::load(&block.used));
        used & self.meets_along(0, block) & self.meets_along(1, block) & self.meets_along(2, block)
    }

    #[inline(always)]
    fn meets_along(&self, axis: usize, block: &Block) -> L::Mask {
        let a = L::load(&block.corner[0][axis]);
        let b = L::load(&block.corner[1][axis]);
        let c = L::load(&block.corner[2][axis]);
        self.spans(axis, a.min(b).min(c), a.max(b).max(c))
    }
}

/// A lifted disc's constants of [`Wide::crossing`].
struct Planes<L> {
    position: [L; 3],
    normal: [L; 3],
    levels: [L; 2],
}

impl<L: Lanes> Planes<L> {
    #[inline(always)]
    fn new(disc: &Lifted) -> Self {
        Planes {
            position: L::splat3(disc.position),
            normal: L::splat3(disc.normal),
            levels: [L::splat(disc.levels[0]), L::splat(disc.levels[1])],
        }
    }

    #[inline(always)]
    fn height(&self, corner: &[Row; 3]) -> L {
        let x = (L::load(&corner[0]) - self.position[0]) * self.normal[0];
        let y = (L::load(&corner[1]) - self.position[1]) * self.normal[1];
        let z = (L::load(&corner[2]) - self.position[2]) * self.normal[2];
        x + y + z
    }

    /// The lanes of those that are `there` whose triangles have corners on both sides of a level, and the
    /// corners' heights.
    #[inline(always)]
    fn crossed_by(&self, block: &Block, there: L::Mask) -> (u32, [Row; 3]) {
        if L::bits(there) == 0 {
            return (0, [Row([0.0; WIDTH]); 3]);
        }
        let a = self.height(&block.corner[0]);
        let b = self.height(&block.corner[1]);
        let c = self.height(&block.corner[2]);
        let crossed = crosses(self.levels[0], a, b, c) | crosses(self.levels[1], a, b, c);
        (L::bits(crossed & there), [a.store(), b.store(), c.store()])
    }
}

/// The lanes with heights on both sides of a level.
#[inline(always)]
fn crosses<L: Lanes>(level: L, a: L, b: L, c: L) -> L::Mask {
    let (a, b, c) = (level.less(a), level.less(b), level.less(c));
    (a | b | c) & !(a & b & c)
}
