// SPDX-License-Identifier: GPL-3.0-or-later
//! A BVH of eight children a node and eight triangles a leaf: one vector instruction a step.
//!
//! Made from the binary tree by taking the largest inner child apart until there are eight
//! (Wald, Benthin & Boulos 2008, "Getting Rid of Packets"; Ernst & Greiner 2008).

use crate::bounds::Bounds;
use crate::lanes::{Lanes, Row, WIDTH};
use crate::watertight::{Hit, NEEDLE, Ray, SURFACE_OFFSET, Slabs, Triangle};

/// A leaf's reference has this bit; the rest is the number of its first block.
const LEAF: u32 = 1 << 31;
/// More than a path of the deepest tree can push.
const STACK: usize = 512;

#[derive(Debug, Clone, Copy)]
struct Node {
    min: [Row; 3],
    max: [Row; 3],
    child: [u32; WIDTH],
}

/// Up to eight triangles, by corner and axis.
#[derive(Debug, Clone, Copy)]
struct Block {
    corner: [[Row; 3]; 3],
    position: [i32; WIDTH],
    /// 1 in the lanes that hold a triangle, 0 in the others.
    used: Row,
    /// The leaf has another block behind this one.
    more: bool,
}

#[derive(Debug, Clone)]
pub(crate) struct Wide {
    nodes: Vec<Node>,
    blocks: Vec<Block>,
    bounds: Bounds,
}

/// A child in the binary tree: an inner node of it, or the triangles first .. first + count.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Child {
    pub(crate) bounds: Bounds,
    pub(crate) node: Option<usize>,
    pub(crate) first: usize,
    pub(crate) count: usize,
}

/// Where a ray is going in a tree, kept from ray to ray: clearing it for each would take longer
/// than many rays do.
pub(crate) struct Stack([(u32, f32); STACK]);

impl Stack {
    pub(crate) fn new() -> Stack {
        Stack([(0, 0.0); STACK])
    }
}

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
    /// From a checked binary tree: the children of each of its nodes, nodes after their parents,
    /// of at most 62 levels.
    pub(crate) fn new(binary: &[Vec<Child>], corners: &[Triangle]) -> Wide {
        // The triangles below each node, where they are a run of the leaf order.
        let mut runs: Vec<Option<(usize, usize)>> = vec![None; binary.len()];
        for (row, children) in binary.iter().enumerate().rev() {
            let parts: Vec<_> =
                children.iter().map(|c| c.node.map_or(Some((c.first, c.count)), |n| runs[n])).collect();
            runs[row] = match parts[..] {
                [Some((first, count))] => Some((first, count)),
                [Some(a), Some(b)] if a.0 + a.1 == b.0 => Some((a.0, a.1 + b.1)),
                _ => None,
            };
        }
        let bounds = binary[0].iter().fold(Bounds::EMPTY, |b, child| b.union(&child.bounds));
        let mut wide = Wide { nodes: Vec::new(), blocks: Vec::new(), bounds };
        wide.collapse(binary, &runs, 0, corners);
        wide
    }

    fn collapse(
        &mut self,
        binary: &[Vec<Child>],
        runs: &[Option<(usize, usize)>],
        row: usize,
        corners: &[Triangle],
    ) -> u32 {
        // A subtree that fits a leaf becomes one.
        let as_leaf = |mut child: Child| {
            if let Some((first, count)) = child.node.and_then(|node| runs[node]).filter(|run| run.1 <= WIDTH)
            {
                child = Child { node: None, first, count, ..child };
            }
            child
        };
        let mut children: Vec<Child> = binary[row].iter().copied().map(as_leaf).collect();
        while children.len() < WIDTH {
            let inner = (0..children.len()).filter(|&i| children[i].node.is_some());
            let area = |i: &usize| children[*i].bounds.half_area();
            let Some(largest) = inner.max_by(|a, b| area(a).total_cmp(&area(b))) else { break };
            let taken = children.remove(largest);
            let node = taken.node.expect("inner nodes were chosen from");
            children.splice(largest..largest, binary[node].iter().copied().map(as_leaf));
        }
        let index = self.nodes.len();
        // An empty lane's box is inside out: no ray enters it.
        let empty = Node {
            min: [Row([f32::INFINITY; WIDTH]); 3],
            max: [Row([f32::NEG_INFINITY; WIDTH]); 3],
            child: [0; WIDTH],
        };
        self.nodes.push(empty);
        for (lane, child) in children.iter().enumerate() {
            let reference = match child.node {
                Some(node) => self.collapse(binary, runs, node, corners),
                None => self.leaf(child.first, child.count, corners),
            };
            let node = &mut self.nodes[index];
            for axis in 0..3 {
                node.min[axis].0[lane] = child.bounds.min[axis];
                node.max[axis].0[lane] = child.bounds.max[axis];
            }
            node.child[lane] = reference;
        }
        index as u32
    }

    fn leaf(&mut self, first: usize, count: usize, corners: &[Triangle]) -> u32 {
        let reference = self.blocks.len() as u32 | LEAF;
        let last = first + count;
        for begin in (first..last).step_by(WIDTH) {
            let end = last.min(begin + WIDTH);
            let mut block = Block {
                corner: [[Row([0.0; WIDTH]); 3]; 3],
                position: [-1; WIDTH],
                used: Row(std::array::from_fn(|lane| f32::from(u8::from(begin + lane < end)))),
                more: end < last,
            };
            for (lane, position) in (begin..end).enumerate() {
                block.position[lane] = position as i32;
                for (corner, point) in corners[position].iter().enumerate() {
                    for (axis, &x) in point.iter().enumerate() {
                        block.corner[corner][axis].0[lane] = x;
                    }
                }
            }
            self.blocks.push(block);
        }
        reference
    }

    /// Calls `visit(triangle, hit, limit)` for the triangles that a ray may hit before or at `limit`,
    /// roughly near ones first; `visit` returns the new limit, or None to stop. None of these is left out
    /// in any tree.
    #[inline(always)]
    pub(crate) fn traverse<L: Lanes>(
        &self,
        ray: &Ray,
        t_max: f32,
        skip: i32,
        stack: &mut Stack,
        mut visit: impl FnMut(i32, Hit, f32) -> Option<f32>,
    ) {
        let slabs = Slabs::<L>::new(ray, &self.bounds);
        let sheared = Sheared::<L>::new(ray);
        let stack = &mut stack.0;
        let (mut limit, mut latest) = (t_max, slabs.latest_entry(t_max));
        stack[0] = (0, 0.0);
        let mut size = 1;
        while size > 0 {
            size -= 1;
            let (reference, t) = stack[size];
            if t > latest {
                continue;
            }
            if reference & LEAF == 0 {
                let node = &self.nodes[reference as usize];
                let (entry, entered) = slabs.enter(&node.min, &node.max, latest);
                let (entry, mut entered) = (entry.store().0, L::bits(entered));
                let bottom = size;
                while entered != 0 {
                    let lane = entered.trailing_zeros() as usize;
                    entered &= entered - 1;
                    // Insertion sort: the nearest on top.
                    let mut at = size;
                    while at > bottom && stack[at - 1].1 < entry[lane] {
                        stack[at] = stack[at - 1];
                        at -= 1;
                    }
                    stack[at] = (node.child[lane], entry[lane]);
                    size += 1;
                }
                continue;
            }
            for block in &self.blocks[(reference & !LEAF) as usize..] {
                let (mut found, row) = sheared.intersect(block);
                while found != 0 {
                    let lane = found.trailing_zeros() as usize;
                    found &= found - 1;
                    let position = block.position[lane];
                    if position == skip {
                        continue;
                    }
                    let hit = if row.exact >> lane & 1 == 1 {
                        let corner = |c: usize| [0, 1, 2].map(|axis| block.corner[c][axis].0[lane]);
                        ray.intersect(&[corner(0), corner(1), corner(2)])
                    } else {
                        Some(Hit { t: row.t.0[lane], u: row.u.0[lane], v: row.v.0[lane] })
                    };
                    if let Some(hit) = hit {
                        match visit(position, hit, limit) {
                            Some(new_limit) => {
                                (limit, latest) = (new_limit, slabs.latest_entry(new_limit));
                            }
                            None => return,
                        }
                    }
                }
                if !block.more {
                    break;
                }
            }
        }
    }

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

/// The hits of a block; where a bit of `exact` is set, [`Ray::intersect`] has to decide.
struct Hits {
    t: Row,
    u: Row,
    v: Row,
    exact: u32,
}

/// A ray's constants of [`Ray::intersect`].
struct Sheared<L> {
    origin: [L; 3],
    axes: [usize; 3],
    shear: [L; 3],
}

impl<L: Lanes> Sheared<L> {
    #[inline(always)]
    fn new(ray: &Ray) -> Self {
        let (axes, origin, shear) = (ray.axes(), ray.origin(), ray.shear());
        Sheared {
            origin: L::splat3([origin[axes[0]], origin[axes[1]], origin[axes[2]]]),
            axes,
            shear: L::splat3(shear),
        }
    }

    #[inline(always)]
    fn to_local(&self, corner: &[Row; 3]) -> [L; 3] {
        let x = L::load(&corner[self.axes[0]]) - self.origin[0];
        let y = L::load(&corner[self.axes[1]]) - self.origin[1];
        let z = L::load(&corner[self.axes[2]]) - self.origin[2];
        [x - self.shear[0] * z, y - self.shear[1] * z, self.shear[2] * z]
    }

    /// [`Ray::intersect`] for all triangles of a block, operation by operation; the lanes that may
    /// be hit, and how.
    #[inline(always)]
    fn intersect(&self, block: &Block) -> (u32, Hits) {
        let a = self.to_local(&block.corner[0]);
        let b = self.to_local(&block.corner[1]);
        let c = self.to_local(&block.corner[2]);
        let u = c[0] * b[1] - c[1] * b[0];
        let v = a[0] * c[1] - a[1] * c[0];
        let w = b[0] * a[1] - b[1] * a[0];
        let zero = L::splat(0.0);
        let on_edge = u.equal(zero) | v.equal(zero) | w.equal(zero);
        let below = u.less(zero) | v.less(zero) | w.less(zero);
        let above = zero.less(u) | zero.less(v) | zero.less(w);
        let inside = (on_edge | !(below & above)) & zero.less(L::load(&block.used));
        if L::bits(inside) == 0 {
            let none = Row([0.0; WIDTH]);
            return (0, Hits { t: none, u: none, v: none, exact: 0 });
        }
        let det = u + v + w;
        let extent = a[0].abs().max(a[1].abs()).max(b[0].abs()).max(b[1].abs());
        let extent = extent.max(c[0].abs()).max(c[1].abs());
        let size = det.abs();
        let sound = (extent * extent * L::splat(NEEDLE)).less_equal(size)
            & L::splat(1e-30).less_equal(size)
            & size.less_equal(L::splat(1e30));
        let exact = on_edge | !sound;
        let scale = L::splat(1.0) / det;
        let t = u * scale * a[2] + v * scale * b[2] + w * scale * c[2];
        let found = inside & (exact | zero.less(t));
        let hits =
            Hits { t: t.store(), u: (v * scale).store(), v: (w * scale).store(), exact: L::bits(exact) };
        (L::bits(found), hits)
    }
}
