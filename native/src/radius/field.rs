// SPDX-License-Identifier: GPL-3.0-or-later
//! Radii between the nodes of the sides' grids.

use rayon::prelude::*;

use super::find::{Wanted, find_radii};
use super::grids::{Field, Fields, GRID_FLOATS};
use super::sides::{SIDES, sides_of};
use crate::InvalidInput;
use crate::packing::unpack_direction;
use crate::photons::Grid;

/// As many of the photons tell their median radius.
const TYPICAL: usize = 1 << 14;

const PHOTONS_A_TASK: usize = 1 << 14;

/// Radii of one side's surfaces at the nodes of a grid that lies over their photons.
struct Side {
    field: Field,
    /// At the corners of the cells, x fastest.
    nodes: Vec<f32>,
    /// The largest of `nodes`.
    largest: f32,
}

/// Radii, interpolated between the nodes of a grid for each side.
pub struct RadiusField {
    sides: [Side; SIDES],
    typical: f32,
}

impl RadiusField {
    /// The radii of discs that hold about as many photons as `wanted`, if photons fell as they do at
    /// `places`, on surfaces whose packed normals are the fourth numbers of `deposits`. Photons outside
    /// their side's grid don't count. Beyond it radii are those at its border.
    ///
    /// The count in a box of half size h about a node stands for a plane's, (2 h)^2 times the
    /// photons a unit area. Where the closest photons are denser or less dense than those in the
    /// box, light is uneven and a disc blurs it: by a share that goes with the radius squared. Noise
    /// goes with 1 / (photons in the disc), and the radius is the one of least mean square error.
    ///
    /// Radii are then lowered until no step along an axis changes them by more than a quarter of it:
    /// |r(x) - r(y)| <= sqrt(3) / 4 |x - y|, so that on one side r(y) <= 1.77 r(x) wherever
    /// |x - y| <= r(y).
    ///
    /// # Errors
    /// A place or what is wanted that is not finite; arrays of different lengths.
    pub fn new(
        places: &[[f32; 4]],
        deposits: &[[f32; 4]],
        fields: &[Field; SIDES],
        wanted: &Wanted,
    ) -> Result<RadiusField, InvalidInput> {
        if places.len() != deposits.len() {
            return Err(InvalidInput(format!(
                "deposits has {} rows, but places has {}",
                deposits.len(),
                places.len()
            )));
        }
        let numbers = [wanted.photons, wanted.times, wanted.most, wanted.pixel];
        if let Some(value) = numbers.iter().find(|value| !value.is_finite()) {
            return Err(InvalidInput(format!("{value} is not finite")));
        }
        if let Some(row) = places.iter().position(|place| !place[..3].iter().all(|x| x.is_finite())) {
            return Err(InvalidInput(format!("place[{row}] = {:?} is not finite", &places[row][..3])));
        }
        let by_side = |(places, deposits): (&[[f32; 4]], &[[f32; 4]])| {
            let mut places_of: [Vec<[f32; 3]>; SIDES] = Default::default();
            for (&[x, y, z, _], deposit) in places.iter().zip(deposits) {
                let place = [x, y, z];
                let inside = |&side: &usize| {
                    let Grid { origin, cell_size, cells } = &fields[side].grid;
                    (0..3).all(|k| (0.0..=cells[k] as f32).contains(&((place[k] - origin[k]) / cell_size)))
                };
                let sides = sides_of(unpack_direction(deposit[3])).filter(inside);
                sides.for_each(|side| places_of[side].push(place));
            }
            places_of
        };
        let parts: Vec<_> =
            places.par_chunks(PHOTONS_A_TASK).zip(deposits.par_chunks(PHOTONS_A_TASK)).map(by_side).collect();
        let new_side = |side: usize| {
            let places: Vec<&[[f32; 3]]> = parts.iter().map(|places_of| &places_of[side][..]).collect();
            Side::of(fields[side], find_radii(&places, side, &fields[side], wanted))
        };
        let sides: Vec<Side> = (0..SIDES).into_par_iter().map(new_side).collect();
        let sides = sides.try_into().unwrap_or_else(|_| unreachable!("as many as there are sides"));
        let mut field = RadiusField { sides, typical: 0.0 };
        field.typical = field.largest();
        if !places.is_empty() {
            let some = (0..places.len()).step_by(places.len().div_ceil(TYPICAL));
            let at = |i: usize| field.at([0, 1, 2].map(|k| places[i][k]), unpack_direction(deposits[i][3]));
            let mut radii: Vec<f32> = some.map(at).collect();
            let middle = radii.len() / 2;
            field.typical = *radii.select_nth_unstable_by(middle, f32::total_cmp).1;
        }
        Ok(field)
    }

    /// Out of its table, and what [`RadiusField::typical`] says.
    ///
    /// # Errors
    /// What is no table.
    pub fn of_table(table: &[f32], typical: f32) -> Result<RadiusField, InvalidInput> {
        let (rows, _) = table.as_chunks::<GRID_FLOATS>();
        let fields = Fields::sides_of(&rows[..SIDES.min(rows.len())])?;
        let mut nodes = &table[GRID_FLOATS * SIDES..];
        let side_of = |field: Field| {
            let count = field.grid.cells.iter().map(|n| n + 1).product();
            let too_short = || InvalidInput(format!("table: {} numbers are too few", table.len()));
            let (own, rest) = nodes.split_at_checked(count).ok_or_else(too_short)?;
            nodes = rest;
            Ok(Side::of(field, own.to_vec()))
        };
        let sides: Vec<Side> = fields.into_iter().map(side_of).collect::<Result<_, InvalidInput>>()?;
        let sides = sides.try_into().unwrap_or_else(|_| unreachable!("as many as there are sides"));
        Ok(RadiusField { sides, typical })
    }

    /// The median at the photons: half of them lie where radii are smaller.
    pub fn typical(&self) -> f32 {
        self.typical
    }

    /// The radius at a position of a surface (glsl/lib/radius.glsl): the smallest of the sides that it
    /// counts for.
    #[inline]
    pub fn at(&self, position: [f32; 3], normal: [f32; 3]) -> f32 {
        let mut radius = f32::INFINITY;
        sides_of(normal).for_each(|side| radius = radius.min(self.sides[side].at(position)));
        if radius.is_finite() { radius } else { 0.0 } // no normal
    }

    /// The largest radius.
    pub fn largest(&self) -> f32 {
        self.sides.iter().fold(0.0, |most, side| most.max(side.largest))
    }

    /// What glsl/lib/radius.glsl reads: the sides' grids, then their nodes, four a texel.
    pub fn table(&self) -> Vec<f32> {
        let sides = std::array::from_fn(|side| self.sides[side].field);
        let mut table = Fields { sides, area: 0.0 }.table();
        self.sides.iter().for_each(|side| table.extend(&side.nodes));
        table.resize(table.len().next_multiple_of(4), 0.0);
        table
    }
}

impl Side {
    fn of(field: Field, nodes: Vec<f32>) -> Side {
        let largest = nodes.iter().fold(0.0f32, |most, &radius| most.max(radius));
        Side { field, nodes, largest }
    }

    /// The radius at a position.
    #[inline]
    fn at(&self, position: [f32; 3]) -> f32 {
        let Side { field: Field { grid, .. }, nodes, .. } = self;
        let mut cell = [0; 3];
        let mut share = [0.0; 3];
        for k in 0..3 {
            let at = (position[k] - grid.origin[k]) / grid.cell_size;
            let at = at.max(0.0).min(grid.cells[k] as f32); // a NaN becomes 0
            cell[k] = (at as usize).min(grid.cells[k] - 1);
            share[k] = at - cell[k] as f32;
        }
        let row = grid.cells[0] + 1;
        let layer = row * (grid.cells[1] + 1);
        let first = cell[2] * layer + cell[1] * row + cell[0];
        let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
        let along_x = |at: usize| mix(nodes[at], nodes[at + 1], share[0]);
        let along_y = |at: usize| mix(along_x(at), along_x(at + row), share[1]);
        mix(along_y(first), along_y(first + layer), share[2])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packing::pack_direction;

    const UP: [f32; 3] = [0.0, 0.0, 1.0];

    /// Photons on surfaces that face up.
    fn field(places: &[[f32; 4]], photons: f32, pixel: f32, most: f32) -> RadiusField {
        let deposits = vec![[1.0, 1.0, 1.0, pack_direction(UP)]; places.len()];
        let wanted = Wanted { photons, times: 1.0, most, pixel, eye: None };
        let sample: Vec<[f32; 4]> =
            places.iter().map(|&[x, y, z, _]| [x, y, z, pack_direction(UP)]).collect();
        RadiusField::new(places, &deposits, &Fields::over(&sample).unwrap().sides, &wanted).unwrap()
    }

    /// A plane of even photons: every radius holds the number wanted.
    #[test]
    fn an_even_plane() {
        let places: Vec<[f32; 4]> = (0..256 * 256)
            .map(|i| [(i % 256) as f32 / 128.0 - 0.996, (i / 256) as f32 / 128.0 - 0.996, 0.0, 1.0])
            .collect();
        let field = field(&places, 300.0, 0.0, 1.0);
        let expected = (300.0 / (std::f32::consts::PI * 128.0 * 128.0)).sqrt();
        let found = field.at([0.1, 0.2, 0.0], UP);
        assert!((found / expected - 1.0).abs() < 0.02, "{found}");
        assert_eq!(field.at([0.1, 0.2, 0.0], [0.0, 0.0, -1.0]), 1.0, "no photon on its other side");
        assert_eq!(field.largest(), 1.0);
    }

    /// Along an axis the radius changes by a quarter of the way moved at most; `pixel` and `most` hold.
    #[test]
    fn changes_slowly_within_its_bounds() {
        let mut places: Vec<[f32; 4]> = (0..1000).map(|i| [0.5 + 4e-5 * i as f32, 0.3, -0.4, 1.0]).collect();
        places.extend((0..20).map(|i| [-1.0 + 0.075 * i as f32, 0.3, -0.4, 1.0]));
        let field = field(&places, 50.0, 0.01, 0.6);
        let mut last = field.at([-1.0, 0.3, -0.4], UP);
        let (mut smallest, mut largest) = (last, last);
        for i in 1..2000 {
            let radius = field.at([-1.0 + 0.001 * i as f32, 0.3, -0.4], UP);
            assert!((radius - last).abs() <= 0.000251, "{last} {radius}");
            (smallest, largest, last) = (smallest.min(radius), largest.max(radius), radius);
        }
        assert!((0.01..0.05).contains(&smallest) && (0.25..0.6).contains(&largest), "{smallest} {largest}");
        assert!(field.at([f32::NAN; 3], [f32::NAN; 3]).is_finite() && field.at([1e9; 3], UP).is_finite());
    }

    /// The table holds what `at` reads.
    #[test]
    fn table() {
        let field = field(&[[0.5, 0.3, -0.4, 1.0]; 100], 50.0, 0.01, 0.6);
        let table = field.table();
        let [x, y, z, first, nx, _, _, size]: [f32; 8] = table[GRID_FLOATS * 4..][..8].try_into().unwrap();
        assert_eq!((size, nx), (1e-6, 2.0));
        let first = first as usize;
        assert_eq!(field.at([x, y, z], UP), table[first]);
        assert_eq!(field.at([x + size, y, z], UP), table[first + 1]);
        let again = RadiusField::of_table(&table, field.typical()).unwrap();
        assert_eq!(again.table(), table);
        assert_eq!(again.at([0.5, 0.3, -0.4], UP), field.at([0.5, 0.3, -0.4], UP));
        for length in [0, 80, 96, table.len() - 8] {
            assert!(RadiusField::of_table(&table[..length], 1.0).is_err());
        }
    }

    #[test]
    fn bad_input() {
        let none = [0.0; 4];
        let sides = Fields::over(&[]).unwrap().sides;
        let new = |places: &[[f32; 4]], deposits: &[[f32; 4]], most: f32| {
            let wanted = Wanted { photons: 1.0, times: 1.0, most, pixel: 0.0, eye: None };
            RadiusField::new(places, deposits, &sides, &wanted)
        };
        assert!(new(&[[f32::NAN, 0.0, 0.0, 1.0]], &[none], 1.0).is_err());
        assert!(new(&[none], &[], 1.0).is_err());
        assert!(new(&[none], &[none], f32::NAN).is_err());
        assert_eq!(field(&[], 1.0, 0.0, 0.7).at([0.0; 3], UP), 0.7);
    }
}
