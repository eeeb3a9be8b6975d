// SPDX-License-Identifier: GPL-3.0-or-later
//! A BVH of eight children a node and eight triangles a leaf: one vector instruction a step.
//!
//! Made from the binary tree by taking the largest inner child apart until there are eight
//! (Wald, Benthin & Boulos 2008, "Getting Rid of Packets"; Ernst & Greiner 2008).

mod crossing;
mod traverse;

use crate::bounds::Bounds;
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
}
