// SPDX-License-Identifier: GPL-3.0-or-later
//! The gather radius of the first pass at every place of a surface: where photons are dense it is small.

use rayon::prelude::*;

use crate::InvalidInput;
use crate::bounds::Bounds;
use crate::packing::unpack_direction;
use crate::photons::Grid;
use crate::vector::dot;

/// How much a radius may change a step along an axis, in steps: a photon's splat of 1.78 times its
/// radius (splat.glsl) then reaches every point whose own radius reaches the photon (see [`RadiusField::new`]).
const STEEPEST: f32 = 0.25;

/// Cells along an axis of the grid that counts photons, in one of the radii's.
const FINE: usize = 2;
/// Where no photon is within so many fine cells, as a power of two, there is no surface of interest.
const AROUND: usize = 2;
/// Photons in a box about a place of a plane, over those in the disc that touches its sides.
const BOX: f32 = 4.0 / std::f32::consts::PI;
/// As many photons tell a density to a seventh.
const TELLING: f32 = 50.0;
/// After about so many passes shall noise and blur be equal, where light is more uneven than UNEVEN,
/// a square. Measured on scenes of blend_scenes at 16 passes, against 0.2: relMSE falls by 40 %
/// (door_ajar), 27 % (mirror_caustic) and 15 % (caustic_in_mirror), and rises by 22 % where light is
/// even (cornell_classic), since at borders a box holds fewer photons however even they are. At the outer
/// ones its area tells: relMSE falls by 18 % (cornell_classic), 21 % (cornell_mirror), 12 % (caustic_in_mirror)
/// and 8 % (many_lights), and rises by 3 % (door_ajar) and 5 % (mirror_caustic).
const PASSES: f32 = 16.0;
const UNEVEN: f32 = 0.05;

/// Surfaces are told apart by the axes that they face: +x, -x, +y, -y, +z, -z. The light on one side of
/// a wall says nothing about the other.
const SIDES: usize = 6;
/// Surfaces and photons count for the axes to which their normal has at least this cosine: one to three
/// of them, since to the nearest it has 0.577 or more.
const FACING: f32 = 0.5;

/// As many of the photons tell their median radius.
const TYPICAL: usize = 1 << 14;

/// Cells along the longest axis, at most.
const MOST_CELLS: f32 = 64.0;
/// Share of the photons that may lie beyond the grids, on either side of each axis: a far ground must not
/// coarsen a lit room on it.
const OUTSIDE: f64 = 0.005;
/// So many photons, or every so many-th of a sample's, tell where most are.
const ENOUGH: usize = 1 << 12;

const PHOTONS_A_TASK: usize = 1 << 14;

/// Numbers that tell a grid, see [`RadiusField::table`].
pub const GRID_FLOATS: usize = 16;

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

/// Where a side's radii are told.
#[derive(Debug, Clone, Copy)]
pub struct Field {
    grid: Grid,
    /// The box about its photons.
    low: [f32; 3],
    high: [f32; 3],
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
        let cell_size = (size.iter().fold(0.0f32, |most, &x| most.max(x)) / (MOST_CELLS - 2.0)).max(1e-6);
        let sides = sides.map(|[least, most]| {
            let [least, most] =
                if (0..3).all(|k| low[k] <= least[k] && least[k] <= most[k] && most[k] <= high[k]) {
                    [least, most]
                } else {
                    [low, low]
                };
            // A cell to spare on both sides, also after rounding.
            let cells = std::array::from_fn(|k| ((most[k] - least[k]) / cell_size).ceil() as usize + 2);
            let origin = std::array::from_fn(|k| (least[k] + most[k] - cell_size * cells[k] as f32) / 2.0);
            Field { grid: Grid { origin, cell_size, cells }, low: least, high: most }
        });
        Ok(Fields { sides, area: 2.0 * (size[0] * size[1] + size[1] * size[2] + size[2] * size[0]) })
    }

    /// As in [`RadiusField::table`].
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
            Side::new(&places, side, fields[side], wanted)
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

    /// What glsl/lib/radius.glsl reads: for each side four texels, its grid's origin and which number here
    /// its first node is, cells and their size, the lowest corner of the box about its photons and which of
    /// all sides' corners of fine cells its first one is, the highest corner of the box; then the nodes.
    pub fn table(&self) -> Vec<f32> {
        let sides = std::array::from_fn(|side| self.sides[side].field);
        let mut table = Fields { sides, area: 0.0 }.table();
        self.sides.iter().for_each(|side| table.extend(&side.nodes));
        table.resize(table.len().next_multiple_of(4), 0.0);
        table
    }
}

/// A float out of glsl/lib/ordered.glsl.
pub fn of_ordered(number: u32) -> f32 {
    f32::from_bits(if number >> 31 == 1 { number & !(1 << 31) } else { !number })
}

/// The sides for which a surface or a photon counts.
#[inline]
fn sides_of(normal: [f32; 3]) -> impl Iterator<Item = usize> {
    let facing = (0..3).filter(move |&axis: &usize| normal[axis].abs() >= FACING);
    facing.map(move |axis| 2 * axis + usize::from(normal[axis] < 0.0))
}

/// The same, a bit for each.
#[inline]
fn facing_bits(normal: [f32; 3]) -> usize {
    let bits = |k: usize| usize::from(normal[k] >= FACING) | usize::from(normal[k] <= -FACING) << 1;
    bits(0) | bits(1) << 2 | bits(2) << 4
}

impl Side {
    fn of(field: Field, nodes: Vec<f32>) -> Side {
        let largest = nodes.iter().fold(0.0f32, |most, &radius| most.max(radius));
        Side { field, nodes, largest }
    }

    /// From its photons, all within the grid, in parts.
    fn new(places: &[&[[f32; 3]]], side: usize, field: Field, wanted: &Wanted) -> Side {
        let Field { grid: Grid { origin, cell_size, cells }, low, high } = field;
        let nodes = cells.map(|n| n + 1);
        let fine = Grid { origin, cell_size: cell_size / FINE as f32, cells: cells.map(|n| n * FINE) };
        let sums = Sums::new(places, &fine);
        let widest = *fine.cells.iter().max().unwrap_or(&0);
        let place_of = |node: [usize; 3]| -> [f32; 3] {
            std::array::from_fn(|k| origin[k] + cell_size * node[k] as f32)
        };
        // Far from this side's surfaces, as most nodes are, or in the dark: as large as the next ones allow.
        let corner =
            |at: usize| place_of(std::array::from_fn(|k| if at >> k & 1 == 1 { nodes[k] } else { 0 }));
        let coarsest = (0..8).map(|at| wanted.least(corner(at))).fold(0.0, f32::max);
        let far = |node: [usize; 3]| {
            if coarsest <= wanted.most { wanted.most } else { wanted.most.max(wanted.least(place_of(node))) }
        };
        // Of the side's surfaces in a box, if they fill the box about all photons.
        let area_about = |node: [usize; 3], half: usize| -> f32 {
            let (place, size) = (place_of(node), half as f32 * fine.cell_size);
            let length = |k: usize| (place[k] + size).min(high[k]) - (place[k] - size).max(low[k]);
            (0..3).filter(|&k| k != side / 2).map(|k| length(k).max(fine.cell_size)).product()
        };
        let needed = wanted.photons * BOX;
        let mut radii = vec![0.0f32; nodes.iter().product()];
        let radius_at = |node: [usize; 3], row: &mut Row| {
            if row.photons_about(node[0], AROUND) == 0 {
                return far(node);
            }
            let (mut step, mut inner) = (0, None);
            let (half, found) = loop {
                let (half, found) = (1 << step, row.photons_about(node[0], step) as f32);
                if inner.is_none() && found >= TELLING {
                    inner = Some((half, found));
                }
                let size = half as f32 * fine.cell_size;
                if found >= needed.max(4.0 * TELLING) || size >= wanted.most || half >= widest {
                    break (half, found);
                }
                step += 1;
            };
            let size = half as f32 * fine.cell_size;
            let mut best = size * (needed / found.max(1e-6)).sqrt();
            if let Some((inner_half, inner_found)) = inner.filter(|&(inner_half, _)| inner_half < half) {
                // The share by which photons are denser, or less dense, close by than in the whole box,
                // and what of its square is chance.
                let density = inner_found / area_about(node, inner_half);
                let ratio = density / (found / area_about(node, half));
                let uneven = (ratio - 1.0) * (1.0 / ratio).min(1.0);
                // Continuous: a photon more or less must not change the picture.
                let square = uneven * uneven - 1.0 / inner_found - 1.0 / found - UNEVEN;
                if square > 0.0 {
                    let per_pass = wanted.times * density;
                    let balanced = size.powi(4) / (2.0 * square * std::f32::consts::PI * per_pass * PASSES);
                    best = best.min(balanced.powf(1.0 / 6.0));
                }
            }
            best.min(wanted.most).max(wanted.least(place_of(node)))
        };
        let new_row = || Row::new(&sums);
        radii.par_chunks_mut(nodes[0]).enumerate().for_each_init(new_row, |row, (number, radii)| {
            let (y, z) = (number % nodes[1], number / nodes[1]);
            row.go_to(y, z);
            radii.iter_mut().enumerate().for_each(|(x, radius)| *radius = radius_at([x, y, z], row));
        });
        flatten(&mut radii, nodes, STEEPEST * cell_size);
        Side::of(field, radii)
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

/// A row of nodes along x, and how many photons are about each.
struct Row<'a> {
    sums: &'a Sums,
    /// Which row it is.
    yz: [usize; 2],
    /// Photons at lower x in the boxes of half size 2^step about all nodes, as far as asked for.
    slabs: Vec<Vec<u32>>,
    known: usize,
}

impl Row<'_> {
    fn new(sums: &Sums) -> Row<'_> {
        Row { sums, yz: [0; 2], slabs: Vec::new(), known: 0 }
    }

    fn go_to(&mut self, y: usize, z: usize) {
        (self.yz, self.known) = ([y, z], 0);
    }

    /// Photons in the box of half size 2^step about a node, in fine cells.
    #[inline]
    fn photons_about(&mut self, node: usize, step: usize) -> u32 {
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
struct Sums {
    /// How many planes with photons are below each corner, along each axis.
    planes: [Vec<usize>; 3],
    below: Vec<u32>,
}

impl Sums {
    fn new(places: &[&[[f32; 3]]], grid: &Grid) -> Sums {
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

    /// Both ways to tell the sides that a normal counts for, at its bounds, too.
    #[test]
    fn sides_and_their_bits() {
        let some = [0.0, -0.0, 0.3, FACING.next_down(), FACING, 0.8, 1.0, f32::NAN];
        let values: Vec<f32> = some.iter().flat_map(|&x| [x, -x]).collect();
        for &x in &values {
            for &y in &values {
                for &z in &values {
                    let bits: usize = sides_of([x, y, z]).map(|side| 1 << side).sum();
                    assert_eq!(facing_bits([x, y, z]), bits, "{x} {y} {z}");
                }
            }
        }
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

    /// Few photons or many.
    #[test]
    fn most_photons_are_within_the_grids() {
        for count in [1usize, 3, 100, 800, 5000, 16384] {
            let places: Vec<[f32; 4]> = (0..count)
                .map(|i| [7919, 104729].map(|prime| (i * prime % count) as f32 / count as f32))
                .map(|[x, y]| [x, y, 0.0, pack_direction(UP)])
                .collect();
            let Field { low, high, .. } = Fields::over(&places).unwrap().sides[4];
            let inside = places.iter().filter(|p| (0..3).all(|k| (low[k]..=high[k]).contains(&p[k]))).count();
            assert!(
                inside as f64 >= (1.0 - 4.0 * OUTSIDE - 0.01) * count as f64 - 0.5,
                "{inside} of {count}"
            );
        }
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
        assert_eq!(field(&[], 1.0, 0.0, 0.7).at([0.0; 3], UP), 0.7);
    }
}
