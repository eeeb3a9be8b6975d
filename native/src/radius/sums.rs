// SPDX-License-Identifier: GPL-3.0-or-later
//! Photons counted in fine cells, and summed so that those in any box are four numbers a row.

use super::grids::FINE;
use crate::photons::Grid;

/// A row of nodes along x, and how many photons are about each.
pub(super) struct Row<'a> {
    sums: &'a Sums,
    /// Which row it is.
    yz: [usize; 2],
    /// Photons at lower x in the boxes of half size 2^step about all nodes, as far as asked for.
    slabs: Vec<Vec<u32>>,
    known: usize,
}

impl Row<'_> {
    pub(super) fn new(sums: &Sums) -> Row<'_> {
        Row { sums, yz: [0; 2], slabs: Vec::new(), known: 0 }
    }

    pub(super) fn go_to(&mut self, y: usize, z: usize) {
        (self.yz, self.known) = ([y, z], 0);
    }

    /// Photons in the box of half size 2^step about a node, in fine cells.
    #[inline]
    pub(super) fn photons_about(&mut self, node: usize, step: usize) -> u32 {
        while self.known <= step {
            self.find_slab();
        }
        let (low, high) = around(node, 1 << step, &self.sums.planes[0]);
        self.slabs[step][high].wrapping_sub(self.slabs[step][low])
    }

    /// The next step's.
    fn find_slab(&mut self) {
        let half = 1 << self.known;
        let (y0, y1) = around(self.yz[0], half, &self.sums.planes[1]);
        let (z0, z1) = around(self.yz[1], half, &self.sums.planes[2]);
        let [a, b, c, d] = [(y1, z1), (y0, z0), (y0, z1), (y1, z0)].map(|(y, z)| self.sums.row(y, z));
        if self.slabs.len() == self.known {
            self.slabs.push(vec![0; a.len()]);
        }
        // Sums wrap around, and their differences back.
        for (x, slab) in self.slabs[self.known].iter_mut().enumerate() {
            *slab = a[x].wrapping_add(b[x]).wrapping_sub(c[x]).wrapping_sub(d[x]);
        }
        self.known += 1;
    }
}

/// The planes of fine cells that are no further than `half` from a node.
#[inline]
fn around(node: usize, half: usize, planes: &[usize]) -> (usize, usize) {
    let (low, high) = ((FINE * node).saturating_sub(half), (FINE * node + half).min(planes.len() - 1));
    (planes[low], planes[high])
}

/// Photons in the cells below each of their corners, along all axes. Planes of cells without a photon add
/// nothing and are left out: surfaces fill few of those along the axis that they face.
pub(super) struct Sums {
    /// How many planes with photons are below each corner, along each axis.
    planes: [Vec<usize>; 3],
    below: Vec<u32>,
}

impl Sums {
    pub(super) fn new(places: &[&[[f32; 3]]], grid: &Grid) -> Sums {
        let mut planes = grid.cells.map(|n| vec![0; n + 1]);
        for place in places.iter().copied().flatten() {
            grid.cell_of(place).iter().zip(&mut planes).for_each(|(&i, planes)| planes[i as usize + 1] = 1);
        }
        for planes in &mut planes {
            (1..planes.len()).for_each(|i| planes[i] += planes[i - 1]);
        }
        let [row, rows, layers] = [0, 1, 2].map(|k| planes[k][grid.cells[k]] + 1);
        let layer = row * rows;
        let mut below = vec![0u32; layer * layers];
        for place in places.iter().copied().flatten() {
            let cell = grid.cell_of(place);
            let [x, y, z] = [0, 1, 2].map(|k| planes[k][cell[k] as usize] + 1);
            below[z * layer + y * row + x] += 1;
        }
        for z in 1..layers {
            for y in 1..rows {
                let (before, from) = below.split_at_mut(z * layer + y * row);
                let at = before.len();
                let [behind, under, both] =
                    [at - row, at - layer, at - layer - row].map(|at| &before[at..at + row]);
                let mut sum = 0u32;
                for (x, own) in from[..row].iter_mut().enumerate() {
                    sum = sum.wrapping_add(*own);
                    *own = sum.wrapping_add(behind[x]).wrapping_add(under[x]).wrapping_sub(both[x]);
                }
            }
        }
        Sums { planes, below }
    }

    /// The corners of a row along x.
    #[inline]
    fn row(&self, y: usize, z: usize) -> &[u32] {
        let [row, rows] = [0, 1].map(|k| self.planes[k][self.planes[k].len() - 1] + 1);
        &self.below[(z * rows + y) * row..][..row]
    }
}
