// SPDX-License-Identifier: GPL-3.0-or-later
//! The Python module: numpy arrays in, numpy arrays out.
//!
//! Every function checks its arrays. Those whose work takes long do it in [run]: without the GIL, and a panic,
//! which would be a bug here, becomes a RuntimeError.

mod aim;
mod arrays;
mod geometry;
mod mixture;
mod photon_map;
mod radius_field;
mod tracer;
mod view;

use std::collections::HashMap;
use std::panic::{AssertUnwindSafe, catch_unwind};

use pyo3::exceptions::{PyRuntimeError, PyValueError};
use pyo3::prelude::*;

use crate::layouts::LAYOUTS;
use crate::{InvalidInput, bvh};

impl From<InvalidInput> for PyErr {
    fn from(error: InvalidInput) -> PyErr {
        PyValueError::new_err(error.0)
    }
}

/// Native core of Photon Stream: BVH, ray tracing, photon paths, gather radii and gathering on the CPU.
#[pymodule]
fn photon_stream_native(module: &Bound<PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("MAX_DEPTH", bvh::MAX_DEPTH)?;
    module.add("MAX_LEAF", bvh::MAX_LEAF)?;
    module.add("LAYOUTS", LAYOUTS.into_iter().collect::<HashMap<_, _>>())?;
    module.add_class::<tracer::Tracer>()?;
    module.add_class::<photon_map::PhotonMap>()?;
    module.add_class::<radius_field::RadiusField>()?;
    module.add_function(wrap_pyfunction!(radius_field::radius_grids, module)?)?;
    module.add_function(wrap_pyfunction!(radius_field::radius_grids_about, module)?)?;
    for function in [
        wrap_pyfunction!(aim::aim_tree, module)?,
        wrap_pyfunction!(aim::aim_pdf, module)?,
        wrap_pyfunction!(aim::aimed_numbers, module)?,
        wrap_pyfunction!(aim::random_numbers, module)?,
        wrap_pyfunction!(aim::photon_portals, module)?,
        wrap_pyfunction!(aim::fit_window, module)?,
        wrap_pyfunction!(view::view_cells, module)?,
        wrap_pyfunction!(view::cells_among, module)?,
        wrap_pyfunction!(view::pack_directions, module)?,
        wrap_pyfunction!(view::unpack_directions, module)?,
        wrap_pyfunction!(view::disc_about, module)?,
    ] {
        module.add_function(function)?;
    }
    module.add_function(wrap_pyfunction!(geometry::build_bvh, module)?)?;
    module.add_function(wrap_pyfunction!(geometry::faces_of, module)?)?;
    module.add_function(wrap_pyfunction!(geometry::refit_bvh, module)?)?;
    module.add_function(wrap_pyfunction!(geometry::trace, module)?)?;
    module.add_function(wrap_pyfunction!(geometry::occluded, module)?)?;
    module.add_function(wrap_pyfunction!(geometry::trace_few, module)?)?;
    module.add_function(wrap_pyfunction!(geometry::trace_brute_force, module)?)?;
    module.add_function(wrap_pyfunction!(mixture::box_mean, module)?)?;
    module.add_function(wrap_pyfunction!(mixture::split_halves, module)?)?;
    module.add_function(wrap_pyfunction!(mixture::mix_halves, module)?)?;
    module.add_function(wrap_pyfunction!(photon_map::sort_photons, module)?)
}

/// Do work without the GIL; a panic becomes a RuntimeError.
fn run<T: Send>(py: Python, work: impl FnOnce() -> Result<T, InvalidInput> + Send) -> PyResult<T> {
    match py.detach(|| catch_unwind(AssertUnwindSafe(work))) {
        Ok(result) => Ok(result?),
        Err(panic) => {
            let text = panic.downcast_ref::<String>().map(String::as_str);
            let text = text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("unknown");
            Err(PyRuntimeError::new_err(format!("photon_stream_native failed: {text}")))
        }
    }
}
