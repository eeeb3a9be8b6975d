// SPDX-License-Identifier: GPL-3.0-or-later
//! The grids at whose nodes radii are found, one for each side over where its photons fall.

use rayon::prelude::*;

use super::sides::{SIDES, facing_bits};
use crate::InvalidInput;
use crate::bounds::Bounds;
use crate::packing::unpack_direction;
use crate::photons::Grid;

/// Cells along the longest axis, two of them to spare; and so many times as many, the first of which all
/// sides' nodes are no more than these: where light falls on few surfaces caustics are told finer.
const CELLS: f32 = 64.0;
const TIMES: [f32; 6] = [8.0, 6.0, 4.0, 3.0, 2.0, 1.5];
const MOST_NODES: f32 = 1_100_000.0;
/// Share of the photons that may lie beyond the grids, on either side of each axis: a far ground must not
/// coarsen a lit room on it.
const OUTSIDE: f64 = 0.005;
/// So many photons, or every so many-th of a sample's, tell where most are.
const ENOUGH: usize = 1 << 12;

/// Cells along an axis of the grid that counts photons, in one of the radii's.
pub(super) const FINE: usize = 2;

/// Numbers that tell a grid: RadiusGrid of [`crate::layouts`].
pub const GRID_FLOATS: usize = 16;

/// Where a side's radii are told.
#[derive(Debug, Clone, Copy)]
pub struct Field {
    pub(super) grid: Grid,
    /// The box about its photons.
    pub(super) low: [f32; 3],
    pub(super) high: [f32; 3],
}

impl Field {
    /// Where a node is.
    #[inline]
    pub(super) fn place_of(&self, node: [usize; 3]) -> [f32; 3] {
        let Grid { origin, cell_size, .. } = self.grid;
        std::array::from_fn(|k| origin[k] + cell_size * node[k] as f32)
    }
}

/// A field for each side over where its photons fall.
#[derive(Debug, Clone)]
pub struct Fields {
    pub sides: [Field; SIDES],
    /// Of the box about all.
    pub area: f32,
}

impl Fields {
    /// Over most of the photons of which `sample` are some: their positions, and the packed normals of the
    /// surfaces that they fall on.
    ///
    /// # Errors
    /// A position that is not finite.
    pub fn over(sample: &[[f32; 4]]) -> Result<Fields, InvalidInput> {
        if let Some(row) = sample.iter().position(|place| !place[..3].iter().all(|x| x.is_finite())) {
            return Err(InvalidInput(format!("sample[{row}] = {:?} is not finite", &sample[row][..3])));
        }
        let every = sample.len().div_ceil(ENOUGH).max(1);
        let bounds_along = |k: usize| {
            let mut along: Vec<f32> = sample.iter().step_by(every).map(|place| place[k]).collect();
            let beyond = (along.len() as f64 * OUTSIDE) as usize;
            let most = along.len().checked_sub(1 + beyond)?;
            let low = *along.select_nth_unstable_by(beyond, f32::total_cmp).1;
            Some((low, *along.select_nth_unstable_by(most, f32::total_cmp).1))
        };
        let bounds = [0, 1, 2].map(|k| bounds_along(k).unwrap_or_default());
        let low: [f32; 3] = std::array::from_fn(|k| bounds[k].0);
        let high: [f32; 3] = std::array::from_fn(|k| bounds[k].1);
        // By which sides they count for: no branch that a processor cannot foresee.
        let none = [Bounds::EMPTY; 1 << SIDES];
        let bounds_of = |part: &[[f32; 4]]| {
            let mut facing = none;
            for &[x, y, z, normal] in part {
                if (0..3).all(|k| (low[k]..=high[k]).contains(&[x, y, z][k])) {
                    let place = Bounds { min: [x, y, z, 0.0], max: [x, y, z, 0.0] };
                    let bounds = &mut facing[facing_bits(unpack_direction(normal))];
                    *bounds = bounds.union(&place);
                }
            }
            facing
        };
        let both =
            |a: [Bounds; 1 << SIDES], b: [Bounds; 1 << SIDES]| std::array::from_fn(|i| a[i].union(&b[i]));
        let facing = sample.par_chunks(1 << 12).map(bounds_of).reduce(|| none, both);
        let side_of = |side: usize| {
            let counting = facing.iter().enumerate().filter(|(bits, _)| bits >> side & 1 == 1);
            counting.fold(Bounds::EMPTY, |whole, (_, bounds)| whole.union(bounds))
        };
        let of_side = |side: usize| {
            let Bounds { min: [x, y, z, _], max: [x1, y1, z1, _] } = side_of(side);
            [[x, y, z], [x1, y1, z1]]
        };
        Fields::about([low, high], std::array::from_fn(of_side))
    }

    /// Over the box about most photons, by the boxes about those in it that count for each side, each by its
    /// lowest and its highest corner. One that is upside down, not a number or leaves the box about most is
    /// of a side without photons.
    ///
    /// # Errors
    /// A box about most that is not finite.
    pub fn about([low, high]: [[f32; 3]; 2], sides: [[[f32; 3]; 2]; SIDES]) -> Result<Fields, InvalidInput> {
        if !low.iter().chain(&high).all(|x| x.is_finite()) {
            return Err(InvalidInput(format!("the box {low:?} {high:?} is not finite")));
        }
        let size: [f32; 3] = std::array::from_fn(|k| high[k] - low[k]);
        let sides = sides.map(|[least, most]| {
            if (0..3).all(|k| low[k] <= least[k] && least[k] <= most[k] && most[k] <= high[k]) {
                [least, most]
            } else {
                [low, low]
            }
        });
        let longest = size.iter().fold(0.0f32, |most, &x| most.max(x));
        let size_of_cells = |times: f32| (longest / (times * CELLS - 2.0)).max(1e-6);
        // A cell to spare on both sides, also after rounding.
        let cells_between = |[least, most]: [[f32; 3]; 2], cell_size: f32| -> [usize; 3] {
            std::array::from_fn(|k| ((most[k] - least[k]) / cell_size).ceil() as usize + 2)
        };
        let nodes = |times: f32| -> f32 {
            let of = |side| {
                cells_between(side, size_of_cells(times)).map(|n| n as f32 + 1.0).iter().product::<f32>()
            };
            sides.into_iter().map(of).sum()
        };
        let cell_size =
            size_of_cells(TIMES.into_iter().find(|&times| nodes(times) <= MOST_NODES).unwrap_or(1.0));
        let sides = sides.map(|[least, most]| {
            let cells = cells_between([least, most], cell_size);
            let origin = std::array::from_fn(|k| (least[k] + most[k] - cell_size * cells[k] as f32) / 2.0);
            Field { grid: Grid { origin, cell_size, cells }, low: least, high: most }
        });
        Ok(Fields { sides, area: 2.0 * (size[0] * size[1] + size[1] * size[2] + size[2] * size[0]) })
    }

    /// The sides' grids, each as RadiusGrid of [`crate::layouts`].
    pub fn table(&self) -> Vec<f32> {
        let (mut first, mut first_corner) = (GRID_FLOATS * SIDES, 0);
        let mut table = Vec::with_capacity(first);
        for Field { grid: Grid { origin: [x, y, z], cell_size, cells }, low, high } in self.sides {
            let [nx, ny, nz] = cells.map(|n| n as f32);
            table.extend([x, y, z, first as f32, nx, ny, nz, cell_size]);
            table.extend([low[0], low[1], low[2], first_corner as f32, high[0], high[1], high[2], 0.0]);
            first += cells.iter().map(|n| n + 1).product::<usize>();
            first_corner += cells.iter().map(|n| FINE * n + 1).product::<usize>();
        }
        table
    }

    /// The sides' fields out of their table.
    ///
    /// # Errors
    /// What is none.
    pub fn sides_of(table: &[[f32; GRID_FLOATS]]) -> Result<[Field; SIDES], InvalidInput> {
        let field_of = |row: &[f32; GRID_FLOATS]| {
            let three = |at: usize| [row[at], row[at + 1], row[at + 2]];
            let grid = Grid { origin: three(0), cell_size: row[7], cells: three(4).map(|n| n as usize) };
            grid.check().map(|_| Field { grid, low: three(8), high: three(12) })
        };
        let fields: Vec<Field> = table.iter().map(field_of).collect::<Result<_, _>>()?;
        fields
            .try_into()
            .map_err(|fields: Vec<_>| InvalidInput(format!("fields: {}, not {SIDES}", fields.len())))
    }
}

/// A float out of glsl/lib/ordered.glsl.
pub fn of_ordered(number: u32) -> f32 {
    f32::from_bits(if number >> 31 == 1 { number & !(1 << 31) } else { !number })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packing::pack_direction;

    /// Few photons or many.
    #[test]
    fn most_photons_are_within_the_grids() {
        for count in [1usize, 3, 100, 800, 5000, 16384] {
            let places: Vec<[f32; 4]> = (0..count)
                .map(|i| [7919, 104729].map(|prime| (i * prime % count) as f32 / count as f32))
                .map(|[x, y]| [x, y, 0.0, pack_direction([0.0, 0.0, 1.0])])
                .collect();
            let Field { low, high, .. } = Fields::over(&places).unwrap().sides[4];
            let inside = places.iter().filter(|p| (0..3).all(|k| (low[k]..=high[k]).contains(&p[k]))).count();
            assert!(
                inside as f64 >= (1.0 - 4.0 * OUTSIDE - 0.01) * count as f64 - 0.5,
                "{inside} of {count}"
            );
        }
    }

    /// A floor by its own, a cube by as many cells as there are at least.
    #[test]
    fn few_surfaces_are_told_finer() {
        let cells = |high: [f32; 3]| {
            let fields = Fields::about([[0.0; 3], high], [[[0.0; 3], high]; SIDES]).unwrap();
            let cells = fields.sides.map(|side| side.grid.cells);
            let nodes: usize = cells.iter().map(|n| n.iter().map(|n| n + 1).product::<usize>()).sum();
            (cells.as_flattened().iter().copied().max().unwrap(), nodes)
        };
        assert_eq!(cells([1.0; 3]), (64, 6 * 65usize.pow(3)));
        for high in [[1.0, 1.0, 0.0], [3.0, 1.0, 0.1], [9.0, 0.1, 0.1]] {
            let (longest, nodes) = cells(high);
            assert!(
                (96..=513).contains(&longest) && nodes <= MOST_NODES as usize,
                "{high:?}: {longest}, {nodes}"
            );
        }
    }

    #[test]
    fn bad_input() {
        assert!(Fields::over(&[[0.0, f32::NAN, 0.0, 1.0]]).is_err());
        assert!(Fields::about([[0.0; 3], [f32::INFINITY; 3]], [[[0.0; 3]; 2]; SIDES]).is_err());
        let nowhere = Fields::about([[0.0; 3], [1.0; 3]], [[[f32::NAN; 3]; 2]; SIDES]).unwrap().sides[0];
        assert_eq!((nowhere.low, nowhere.grid.cells), ([0.0; 3], [2; 3]));
        let mut grid = [0.0f32; GRID_FLOATS];
        grid[..8].copy_from_slice(&[0.0, 0.0, 0.0, 96.0, 2.0, 2.0, 2.0, 0.1]);
        assert!(Fields::sides_of(&[grid; SIDES]).is_ok());
        assert!(Fields::sides_of(&[grid; 2]).is_err());
        for (at, wrong) in
            [(7, 0.0), (7, f32::NAN), (4, 0.0), (4, -1.0), (4, f32::NAN), (4, 1e9), (0, f32::NAN)]
        {
            let mut bad = [grid; SIDES];
            bad[3][at] = wrong;
            assert!(Fields::sides_of(&bad).is_err(), "{at} {wrong}");
        }
    }
}
