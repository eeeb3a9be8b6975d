// SPDX-License-Identifier: GPL-3.0-or-later
//! The radius at a node by the photons in boxes about it.

use rayon::prelude::*;

use super::grids::{FINE, Field};
use super::sums::{Row, Sums};
use crate::photons::Grid;
use crate::vector::dot;

/// How much a radius may change a step along an axis, in steps: a photon's splat of 1.78 times its
/// radius (splat.glsl) then reaches every point whose own radius reaches the photon (see
/// [`super::RadiusField::new`]).
const STEEPEST: f32 = 0.25;
/// Where no photon is within so many fine cells, as a power of two, there is no surface of interest.
const AROUND: usize = 2;
/// Photons in a box about a place of a plane, over those in the disc that touches its sides.
const BOX: f32 = 4.0 / std::f32::consts::PI;
/// As many photons tell a density to a seventh.
const TELLING: f32 = 50.0;
/// After about so many passes shall noise and blur be equal, where light is more uneven than UNEVEN,
/// a square. A smaller UNEVEN lowers the error of caustics and of what leaks, and raises it where light is
/// even, since at borders a box holds fewer photons however even they are. At the outer ones its area tells.
const PASSES: f32 = 32.0;
const UNEVEN: f32 = 0.06;

/// How radii are to be.
#[derive(Debug, Clone, Copy)]
pub struct Wanted {
    /// Of the given photons in a disc, about.
    pub photons: f32,
    /// Photons of a pass for each one given.
    pub times: f32,
    /// No radius is larger, unless a pixel is.
    pub most: f32,
    /// A pixel's width, at distance 1 of `eye` if there is one, else everywhere: no radius is smaller.
    pub pixel: f32,
    pub eye: Option<[f32; 3]>,
}

impl Wanted {
    fn least(&self, position: [f32; 3]) -> f32 {
        let distance = self.eye.map_or(1.0, |eye| {
            let away: [f32; 3] = std::array::from_fn(|k| position[k] - eye[k]);
            dot(away, away).sqrt()
        });
        self.pixel * distance
    }
}

/// The radii at the nodes of a side's grid, x fastest, by its photons, which are in parts and all within the
/// grid.
pub(super) fn find_radii(places: &[&[[f32; 3]]], side: usize, field: &Field, wanted: &Wanted) -> Vec<f32> {
    let Grid { origin, cell_size, cells } = field.grid;
    let nodes = cells.map(|n| n + 1);
    let fine = Grid { origin, cell_size: cell_size / FINE as f32, cells: cells.map(|n| n * FINE) };
    let sums = Sums::new(places, &fine);
    let search = Search::new(side, field, wanted, &fine);
    let mut radii = vec![0.0f32; nodes.iter().product()];
    let new_row = || Row::new(&sums);
    radii.par_chunks_mut(nodes[0]).enumerate().for_each_init(new_row, |row, (number, radii)| {
        let (y, z) = (number % nodes[1], number / nodes[1]);
        row.go_to(y, z);
        radii.iter_mut().enumerate().for_each(|(x, radius)| *radius = search.radius_at([x, y, z], row));
    });
    flatten(&mut radii, nodes, STEEPEST * cell_size);
    radii
}

/// A box about a node.
#[derive(Clone, Copy)]
struct NodeBox {
    /// Its half size, in fine cells.
    half: usize,
    photons: f32,
}

/// What the radii of a side depend on besides its photons.
struct Search<'a> {
    side: usize,
    field: &'a Field,
    wanted: &'a Wanted,
    /// Photons in a box, so that a disc in it holds those wanted.
    needed: f32,
    /// Width of a fine cell.
    fine_size: f32,
    /// Fine cells along the longest axis.
    widest: usize,
    /// The largest of the least radii at the grid's corners.
    coarsest: f32,
}

impl<'a> Search<'a> {
    fn new(side: usize, field: &'a Field, wanted: &'a Wanted, fine: &Grid) -> Search<'a> {
        let nodes = field.grid.cells.map(|n| n + 1);
        let corner =
            |at: usize| field.place_of(std::array::from_fn(|k| if at >> k & 1 == 1 { nodes[k] } else { 0 }));
        Search {
            side,
            field,
            wanted,
            needed: wanted.photons * BOX,
            fine_size: fine.cell_size,
            widest: *fine.cells.iter().max().unwrap_or(&0),
            coarsest: (0..8).map(|at| wanted.least(corner(at))).fold(0.0, f32::max),
        }
    }

    #[inline]
    fn radius_at(&self, node: [usize; 3], row: &mut Row) -> f32 {
        if row.photons_about(node[0], AROUND) == 0 {
            return self.far(node);
        }
        let (inner, outer) = self.boxes_about(node[0], row);
        let mut best = self.size_of(outer) * (self.needed / outer.photons.max(1e-6)).sqrt();
        let inner = inner.filter(|inner| inner.half < outer.half);
        if let Some(balanced) = inner.and_then(|inner| self.balanced(node, inner, outer)) {
            best = best.min(balanced);
        }
        best.min(self.wanted.most).max(self.wanted.least(self.field.place_of(node)))
    }

    /// Far from this side's surfaces, as most nodes are, or in the dark: as large as the next ones allow.
    #[inline]
    fn far(&self, node: [usize; 3]) -> f32 {
        let most = self.wanted.most;
        if self.coarsest <= most { most } else { most.max(self.wanted.least(self.field.place_of(node))) }
    }

    /// The smallest box whose photons tell a density, if any does, and the one whose photons are enough, or
    /// beyond which none is looked at.
    #[inline]
    fn boxes_about(&self, x: usize, row: &mut Row) -> (Option<NodeBox>, NodeBox) {
        let (mut step, mut inner) = (0, None);
        loop {
            let own = NodeBox { half: 1 << step, photons: row.photons_about(x, step) as f32 };
            if inner.is_none() && own.photons >= TELLING {
                inner = Some(own);
            }
            let enough = own.photons >= self.needed.max(4.0 * TELLING);
            if enough || self.size_of(own) >= self.wanted.most || own.half >= self.widest {
                return (inner, own);
            }
            step += 1;
        }
    }

    /// Where light is uneven, the radius at which its blur and noise are equal.
    #[inline]
    fn balanced(&self, node: [usize; 3], inner: NodeBox, outer: NodeBox) -> Option<f32> {
        // The share by which photons are denser, or less dense, close by than in the whole box,
        // and what of its square is chance.
        let density = inner.photons / self.area_about(node, inner);
        let ratio = density / (outer.photons / self.area_about(node, outer));
        let uneven = (ratio - 1.0) * (1.0 / ratio).min(1.0);
        // Continuous: a photon more or less must not change the picture.
        let square = uneven * uneven - 1.0 / inner.photons - 1.0 / outer.photons - UNEVEN;
        (square > 0.0).then(|| {
            let per_pass = self.wanted.times * density;
            let balanced =
                self.size_of(outer).powi(4) / (2.0 * square * std::f32::consts::PI * per_pass * PASSES);
            balanced.powf(1.0 / 6.0)
        })
    }

    /// Half of a box's width.
    #[inline]
    fn size_of(&self, own: NodeBox) -> f32 {
        own.half as f32 * self.fine_size
    }

    /// Of the side's surfaces in a box, if they fill the box about all photons.
    #[inline]
    fn area_about(&self, node: [usize; 3], own: NodeBox) -> f32 {
        let (place, size) = (self.field.place_of(node), self.size_of(own));
        let Field { low, high, .. } = self.field;
        let length = |k: usize| (place[k] + size).min(high[k]) - (place[k] - size).max(low[k]);
        (0..3).filter(|&k| k != self.side / 2).map(|k| length(k).max(self.fine_size)).product()
    }
}

/// Lower radii until none exceeds a neighbour's by more than `step`: one sweep up and one down
/// suffice, since what a node may have falls off along any path of axis-parallel steps.
fn flatten(radii: &mut [f32], [nx, ny, nz]: [usize; 3], step: f32) {
    let rows = ny * nz;
    for row in 0..rows {
        let (before, from) = radii.split_at_mut(row * nx);
        let own = &mut from[..nx];
        if row % ny > 0 {
            lower(own, &before[(row - 1) * nx..], step);
        }
        if row >= ny {
            lower(own, &before[(row - ny) * nx..], step);
        }
        if own.windows(2).any(|pair| pair[1] > pair[0] + step) {
            for x in 1..nx {
                own[x] = own[x].min(own[x - 1] + step);
            }
        }
    }
    for row in (0..rows).rev() {
        let (until, after) = radii.split_at_mut((row + 1) * nx);
        let own = &mut until[row * nx..];
        if row % ny + 1 < ny {
            lower(own, after, step);
        }
        if row + ny < rows {
            lower(own, &after[(ny - 1) * nx..], step);
        }
        if own.windows(2).any(|pair| pair[0] > pair[1] + step) {
            for x in (1..nx).rev() {
                own[x - 1] = own[x - 1].min(own[x] + step);
            }
        }
    }
}

/// Lower a row's radii to its neighbour's and a step.
fn lower(row: &mut [f32], neighbour: &[f32], step: f32) {
    for (radius, neighbour) in row.iter_mut().zip(neighbour) {
        *radius = radius.min(neighbour + step);
    }
}
