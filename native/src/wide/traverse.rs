// SPDX-License-Identifier: GPL-3.0-or-later
//! Rays through the tree: its boxes one node at a time, its triangles one block at a time.

use super::{Block, LEAF, Node, STACK, Stack, Wide};
use crate::lanes::{Lanes, Row, WIDTH};
use crate::watertight::{Hit, NEEDLE, Ray, Slabs};

impl Wide {
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
                size = push_entered(stack, size, node, &entry.store().0, L::bits(entered));
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
                    if let Some(hit) = hit_in(block, lane, &row, ray) {
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
}

/// Put the children that a ray has `entered` on a stack of `size`, the nearest on top. The new size.
#[inline(always)]
fn push_entered(
    stack: &mut [(u32, f32); STACK],
    mut size: usize,
    node: &Node,
    entry: &[f32; WIDTH],
    mut entered: u32,
) -> usize {
    let bottom = size;
    while entered != 0 {
        let lane = entered.trailing_zeros() as usize;
        entered &= entered - 1;
        // Insertion sort.
        let mut at = size;
        while at > bottom && stack[at - 1].1 < entry[lane] {
            stack[at] = stack[at - 1];
            at -= 1;
        }
        stack[at] = (node.child[lane], entry[lane]);
        size += 1;
    }
    size
}

/// The hit in one lane of those that [`Sheared::intersect`] found.
#[inline(always)]
fn hit_in(block: &Block, lane: usize, row: &Hits, ray: &Ray) -> Option<Hit> {
    if row.exact >> lane & 1 == 1 {
        let corner = |c: usize| [0, 1, 2].map(|axis| block.corner[c][axis].0[lane]);
        ray.intersect(&[corner(0), corner(1), corner(2)])
    } else {
        Some(Hit { t: row.t.0[lane], u: row.u.0[lane], v: row.v.0[lane] })
    }
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
