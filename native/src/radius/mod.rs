// SPDX-License-Identifier: GPL-3.0-or-later
//! The gather radius of the first pass at every place of a surface: where photons are dense it is small.
//!
//! [`Fields`] lays a grid over the photons of each side of surfaces, [`RadiusField`] finds radii at its nodes
//! by the photons in boxes about them, and tells the radius in between.

mod field;
mod find;
mod grids;
mod sides;
mod sums;

pub use field::RadiusField;
pub use find::Wanted;
pub use grids::{Field, Fields, GRID_FLOATS, of_ordered};
