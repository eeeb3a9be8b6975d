// SPDX-License-Identifier: GPL-3.0-or-later
//! A BVH of eight children a node and eight triangles a leaf: one vector instruction a step.
//!
//! Made from the binary tree by taking the largest inner child apart until there are eight
//! (Wald, Benthin & Boulos 2008, "Getting Rid of Packets"; Ernst & Greiner 2008).

mod crossing;
mod traverse;

use crate::bounds::Bounds;
use crate::bvh::{CHILDREN, NODE_FLOATS, box_at};
use crate::lanes::{Row, WIDTH};
use crate::watertight::Triangle;
pub(crate) use crossing::Lifted;

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
struct Child {
    bounds: Bounds,
    /// The inner node's, or of the first triangle.
    first: usize,
    /// 0: an inner node.
    count: usize,
}

impl Child {
    /// Those that a node of a checked tree has.
    fn all_of(node: &[f32; NODE_FLOATS]) -> impl Iterator<Item = Child> {
        CHILDREN.into_iter().filter(|at| node[at + 3] >= 0.0).map(|at| Child {
            bounds: box_at(node, at),
            first: node[at + 3] as usize,
            count: node[at + 7] as usize,
        })
    }
}

/// Children of a node, in order.
struct Few {
    all: [Child; WIDTH],
    count: usize,
}

impl Few {
    /// At most two.
    fn of(children: impl Iterator<Item = Child>) -> Few {
        let mut few = Few { all: [Child { bounds: Bounds::EMPTY, first: 0, count: 0 }; WIDTH], count: 0 };
        for child in children {
            few.all[few.count] = child;
            few.count += 1;
        }
        few
    }

    /// Put two at most in the place of one; none where an inner node has none.
    fn replace(&mut self, at: usize, with: impl Iterator<Item = Child>) {
        let mut with = with.peekable();
        if with.peek().is_none() {
            self.all[at..self.count].rotate_left(1);
            self.count -= 1;
        }
        for (k, child) in with.enumerate() {
            if k > 0 {
                self.all[at + 1..=self.count].rotate_right(1);
                self.count += 1;
            }
            self.all[at + k] = child;
        }
    }
}

/// Where a ray is going in a tree, kept from ray to ray: clearing it for each would take longer
/// than many rays do.
pub(crate) struct Stack([(u32, f32); STACK]);

impl Stack {
    pub(crate) fn new() -> Stack {
        Stack([(0, 0.0); STACK])
    }
}

impl Wide {
    /// From a checked binary tree, laid out as by [`crate::bvh::build`]: nodes after their parents, of at most 62
    /// levels.
    pub(crate) fn new(binary: &[[f32; NODE_FLOATS]], corners: &[Triangle]) -> Wide {
        // The triangles below each node, where they are a run of the leaf order; else none.
        let mut runs = vec![(0, 0); binary.len()];
        for (row, node) in binary.iter().enumerate().rev() {
            let run =
                |child: Child| if child.count > 0 { (child.first, child.count) } else { runs[child.first] };
            let mut parts = Child::all_of(node).map(run);
            let (first, count) = parts.next().unwrap_or_default();
            let whole =
                parts.next().map_or(
                    count,
                    |(next, more)| if more > 0 && next == first + count { count + more } else { 0 },
                );
            runs[row] = (first, if count > 0 { whole } else { 0 });
        }
        let bounds = Child::all_of(&binary[0]).fold(Bounds::EMPTY, |b, child| b.union(&child.bounds));
        let mut wide = Wide { nodes: Vec::new(), blocks: Vec::new(), bounds };
        wide.collapse(binary, &runs, 0, corners);
        wide
    }

    fn collapse(
        &mut self,
        binary: &[[f32; NODE_FLOATS]],
        runs: &[(usize, usize)],
        row: usize,
        corners: &[Triangle],
    ) -> u32 {
        // A subtree that fits a leaf becomes one.
        let as_leaf = |child: Child| match runs.get(child.first).filter(|_| child.count == 0) {
            Some(&(first, count @ 1..=WIDTH)) => Child { first, count, ..child },
            _ => child,
        };
        let mut children = Few::of(Child::all_of(&binary[row]).map(as_leaf));
        while children.count < WIDTH {
            let inner = (0..children.count).filter(|&i| children.all[i].count == 0);
            let area = |i: &usize| children.all[*i].bounds.half_area();
            let Some(largest) = inner.max_by(|a, b| area(a).total_cmp(&area(b))) else { break };
            let node = &binary[children.all[largest].first];
            children.replace(largest, Child::all_of(node).map(as_leaf));
        }
        let index = self.nodes.len();
        // An empty lane's box is inside out: no ray enters it.
        let empty = Node {
            min: [Row([f32::INFINITY; WIDTH]); 3],
            max: [Row([f32::NEG_INFINITY; WIDTH]); 3],
            child: [0; WIDTH],
        };
        self.nodes.push(empty);
        for (lane, child) in children.all[..children.count].iter().enumerate() {
            let reference = match child.count {
                0 => self.collapse(binary, runs, child.first, corners),
                count => self.leaf(child.first, count, corners),
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
}
