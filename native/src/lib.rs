// SPDX-License-Identifier: GPL-3.0-or-later
//! Native core of Photon Stream: pure functions over arrays.
//!
//! [`bvh::build`] writes the node array that the GLSL kernels traverse, [`refit::refit`] moves its boxes with
//! the triangles, [`photons::sort`] puts photons into the cells of a grid, [`radius`] finds the
//! gather radius at every place, [`aim`] and [`portal_search`] where photons had better go, [`view`] where that is
//! in the picture, [`mixture`] how much of a picture is denoised. Where OpenGL is software, [`trace`], [`emission`],
//! [`paths`], [`cuts`], [`coverage`] and [`density`] take the place of GLSL kernels. Python sees them through the
//! module `python` (cargo feature `python`).

pub mod aim;
mod bent;
mod bounds;
pub mod brute_force;
pub mod bvh;
pub mod coverage;
pub mod cuts;
pub mod density;
mod edges;
pub mod emission;
pub mod faces;
pub mod few;
pub mod filter;
mod lanes;
pub mod layouts;
mod lying;
mod microfacets;
pub mod mixture;
mod own;
mod packing;
pub mod paths;
mod phong;
pub mod photon_map;
pub mod photons;
pub mod portal_search;
pub mod portals;
#[cfg(feature = "python")]
mod python;
pub mod radius;
pub mod random;
pub mod refit;
mod solid;
pub mod trace;
mod vector;
pub mod view;
pub mod walks;
pub mod watertight;
mod wide;

use std::fmt;

/// Input that does not make sense; the text names the array, the index and the value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InvalidInput(pub String);

impl fmt::Display for InvalidInput {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl std::error::Error for InvalidInput {}
