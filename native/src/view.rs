// SPDX-License-Identifier: GPL-3.0-or-later
//! Where things are in what a picture shows: cells of space, each about as large as another in it.

use rayon::prelude::*;

use crate::packing::unpack_direction;
use crate::vector::{Vector64, dot64, minus64};

/// Odd, of many bits: by it cells' numbers differ, and few share one by chance.
const MIX: i64 = 0x2545_F491_4F6C_DD1D;
/// Nearer to the eye cells are no smaller.
const NEAREST: f64 = 1.0e-9;
/// As the bits of numbers have it.
const EXPONENT_OF_ONE: i64 = 1023;
/// No number of a cell.
const NONE: u32 = u32::MAX;

/// How large cells are.
pub struct Cells {
    /// Where the eye is; without one all places are as far as 1 from it.
    pub eye: Option<Vector64>,
    /// A cell's width at distance 1 from the eye; it doubles with the distance.
    pub width: f64,
}

impl Cells {
    /// The numbers of those that places are in. With `facing`, the packed normals there, there are six cells in each
    /// place's stead, of what faces about one way.
    pub fn of(&self, places: &[[f32; 4]], facing: Option<&[f32]>) -> Vec<i64> {
        let face = |row: usize| facing.map_or(0, |codes| face_of(unpack_direction(codes[row])));
        let of_one = |(row, place): (usize, &[f32; 4])| {
            let own = self.number([0, 1, 2].map(|k| f64::from(place[k])));
            if facing.is_some() { own.wrapping_mul(8).wrapping_add(face(row)) } else { own }
        };
        places.par_iter().enumerate().with_min_len(4096).map(of_one).collect()
    }

    fn number(&self, place: Vector64) -> i64 {
        let squared = self.eye.map_or(1.0, |eye| {
            let away = minus64(place, eye);
            dot64(away, away)
        });
        // What log2 and exp2 would tell, sooner.
        let level = ((squared.max(NEAREST * NEAREST).to_bits() >> 52) as i64 - EXPONENT_OF_ONE).div_euclid(2);
        let side = self.width * f64::from_bits(((level + EXPONENT_OF_ONE) as u64) << 52);
        place.iter().fold(level, |number, x| (number ^ floor(x / side)).wrapping_mul(MIX))
    }
}

/// The largest integer that is no larger; f64's own is a call on processors without SSE 4.1.
fn floor(x: f64) -> i64 {
    let toward_zero = x as i64;
    toward_zero.saturating_sub(i64::from(x < toward_zero as f64))
}

/// Which of six ways a normal goes most.
fn face_of(normal: [f32; 3]) -> i64 {
    let [x, y, z] = normal.map(f32::abs);
    let axis = if x >= y && x >= z {
        0
    } else if y >= z {
        1
    } else {
        2
    };
    2 * axis as i64 + i64::from(normal[axis] > 0.0)
}

/// Numbers of cells by what they are: mixed numbers, which need no such hash as the standard map's.
struct Table {
    slots: Vec<(i64, u32)>,
    shift: u32,
}

impl Table {
    fn for_so_many(cells: usize) -> Table {
        let slots = (2 * cells).next_power_of_two().max(2);
        Table { slots: vec![(0, NONE); slots], shift: 64 - slots.trailing_zeros() }
    }

    /// Where a cell is, or would be; and its number there, or NONE.
    fn find(&self, cell: i64) -> (usize, u32) {
        let mut slot = ((cell as u64).wrapping_mul(MIX as u64) >> self.shift) as usize;
        loop {
            let (own, number) = self.slots[slot];
            if number == NONE || own == cell {
                return (slot, number);
            }
            slot = (slot + 1) % self.slots.len();
        }
    }
}

/// Where each of cells is among others, which differ; -1: it is none of these.
pub fn among(others: &[i64], cells: &[i64]) -> Vec<i32> {
    let mut table = Table::for_so_many(others.len());
    for (number, &other) in others.iter().enumerate() {
        let (slot, _) = table.find(other);
        table.slots[slot] = (other, number as u32);
    }
    cells.par_iter().with_min_len(4096).map(|&cell| table.find(cell).1 as i32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::packing::pack_direction;

    /// Twice as far from the eye cells are twice as wide, on each side of a wall another one.
    #[test]
    fn cells_by_distance_and_face() {
        let cells = Cells { eye: Some([0.0; 3]), width: 0.1 };
        let along = |x: f32| [x, 0.01, 0.01, 7.0];
        let near = [along(1.01), along(1.09), along(1.11)];
        let far = [along(2.01), along(2.19), along(2.21)];
        let [a, b, c] = cells.of(&near, None).try_into().unwrap();
        assert!(a == b && b != c);
        let [a, b, c] = cells.of(&far, None).try_into().unwrap();
        assert!(a == b && b != c);
        let codes = [[0.0, 0.6, 0.8], [0.0, 0.5, 0.86], [0.0, -0.6, -0.8]].map(pack_direction);
        let [a, b, c] = cells.of(&[near[0]; 3], Some(&codes)).try_into().unwrap();
        assert!(a == b && b != c);
        let even = Cells { eye: None, width: 0.1 };
        assert_ne!(even.of(&[far[0]], None), even.of(&[far[1]], None));
    }

    #[test]
    fn places_among_cells() {
        assert_eq!(among(&[5, -3, 0], &[0, 4, -3, i64::MIN, 5]), [2, -1, 1, -1, 0]);
        assert_eq!(among(&[], &[0, 7]), [-1, -1]);
        let many: Vec<i64> = (0..1000).map(|k| k * 7 - 500).collect();
        assert_eq!(among(&many, &many), (0..1000).collect::<Vec<i32>>());
    }
}
