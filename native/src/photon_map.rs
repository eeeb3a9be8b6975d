// SPDX-License-Identifier: GPL-3.0-or-later
//! A pass's photons, in memory as they are gathered.

use rayon::prelude::*;

use crate::InvalidInput;
use crate::lanes::{Row, WIDTH};
use crate::packing::{direction_with_flux, unpack_direction};
use crate::photons::{self, Grid};

/// Eight photons in order of their cells, a row a quantity: together in memory where they are together in
/// space. A group may span cells, and the last one is filled up with zeros.
pub(crate) struct Group {
    pub(crate) position: [Row; 3], // [scene units]
    pub(crate) surface: Row,       // its number plus one
    pub(crate) normal: [Row; 3],   // of the surface, a unit vector
    pub(crate) flux: [Row; 3],     // [W]
}

/// A pass's photons, sorted into the cells of a grid.
pub struct PhotonMap {
    pub(crate) grid: Grid,
    pub(crate) cell_start: Vec<u32>,
    pub(crate) groups: Vec<Group>,
    /// To the light, of each group; empty if no lobe asks.
    pub(crate) directions: Vec<[Row; 3]>,
}

impl PhotonMap {
    /// `places` are positions and surfaces, `deposits` fluxes and packed normals; with `directions`
    /// fluxes carry the direction to the light.
    ///
    /// # Errors
    /// As [`photons::sort`]; arrays of different lengths.
    pub fn new(
        places: &[[f32; 4]],
        deposits: &[[f32; 4]],
        grid: Grid,
        directions: bool,
    ) -> Result<PhotonMap, InvalidInput> {
        if places.len() != deposits.len() {
            return Err(InvalidInput(format!(
                "deposits has {} rows, but places has {}",
                deposits.len(),
                places.len()
            )));
        }
        let (cell_start, order) = photons::sort(places.as_flattened(), 4, &grid)?;
        let groups = order.par_chunks(WIDTH).map(|photons| Group::of(photons, places, deposits)).collect();
        let directions = if directions {
            order.par_chunks(WIDTH).map(|photons| directions_of(photons, deposits)).collect()
        } else {
            Vec::new()
        };
        Ok(PhotonMap { grid, cell_start, groups, directions })
    }

    /// Whether photons have directions, if there are any.
    pub fn has_directions(&self) -> bool {
        self.directions.len() == self.groups.len()
    }

    /// The first and last cell along an axis that `radius` around a position may touch.
    pub(crate) fn reach(&self, position: f32, axis: usize, radius: f32) -> Option<(usize, usize)> {
        // The margin covers the rounding of photons to cells.
        let reach = radius * 1.00001 + 1.0e-7;
        let cell = |x: f32| ((x - self.grid.origin[axis]) / self.grid.cell_size).floor();
        let (low, high) = (cell(position - reach), cell(position + reach));
        let last = self.grid.cells[axis] - 1;
        // False for NaN.
        (low <= last as f32 && high >= 0.0).then(|| (low.max(0.0) as usize, (high as usize).min(last)))
    }
}

impl Group {
    /// Photons by their numbers, eight or, at the end, fewer.
    fn of(photons: &[u32], places: &[[f32; 4]], deposits: &[[f32; 4]]) -> Group {
        let none = Row([0.0; WIDTH]);
        let mut group = Group { position: [none; 3], surface: none, normal: [none; 3], flux: [none; 3] };
        for (lane, &photon) in photons.iter().enumerate() {
            let (place, deposit) = (&places[photon as usize], &deposits[photon as usize]);
            let normal = unpack_direction(deposit[3]);
            for axis in 0..3 {
                group.position[axis].0[lane] = place[axis];
                group.normal[axis].0[lane] = normal[axis];
                group.flux[axis].0[lane] = deposit[axis];
            }
            group.surface.0[lane] = place[3];
        }
        group
    }
}

/// Of photons by their numbers, eight or fewer.
fn directions_of(photons: &[u32], deposits: &[[f32; 4]]) -> [Row; 3] {
    let mut rows = [Row([0.0; WIDTH]); 3];
    for (lane, &photon) in photons.iter().enumerate() {
        let [r, g, b, _] = deposits[photon as usize];
        let direction = direction_with_flux([r, g, b]);
        for axis in 0..3 {
            rows[axis].0[lane] = direction[axis];
        }
    }
    rows
}
