// SPDX-License-Identifier: GPL-3.0-or-later
//! Where things are in what a picture shows.

use numpy::PyArray1;
use pyo3::prelude::*;

use super::arrays::{F32Array, I32Array, I64Array, Rows, array, new_matrix, rows};
use super::run;
use crate::packing::{pack_direction, unpack_direction_exactly};
use crate::vector::Vector64;
use crate::{aim, view};

/// The numbers int64[n] of cells that places float32[n, 4] are in, whose fourth number says nothing; they are `width`
/// wide at distance 1 from the eye, if there is one, and wider with the distance. With `facing`, packed normals
/// float32[n], cells of what faces about one way.
#[pyfunction]
#[pyo3(signature = (places, width, eye=None, facing=None))]
pub(super) fn view_cells<'py>(
    py: Python<'py>,
    places: &Bound<'py, PyAny>,
    width: f64,
    eye: Option<Vector64>,
    facing: Option<&Bound<'py, PyAny>>,
) -> PyResult<I64Array<'py>> {
    let places = array::<f32>(places, "places", &[None, Some(4)])?;
    let places = rows(&places)?;
    let facing = facing.map(|codes| array::<f32>(codes, "facing", &[Some(places.len())])).transpose()?;
    let facing = facing.as_ref().map(|codes| codes.as_slice()).transpose()?;
    let cells = view::Cells { eye, width };
    Ok(PyArray1::from_vec(py, run(py, || Ok(cells.of(places, facing)))?))
}

/// Where each of cells int64[n] is among others int64[m], which differ: int32[n], -1 if it is none of these.
#[pyfunction]
pub(super) fn cells_among<'py>(
    py: Python<'py>,
    others: &Bound<'py, PyAny>,
    cells: &Bound<'py, PyAny>,
) -> PyResult<I32Array<'py>> {
    let (others, cells) = (array::<i64>(others, "others", &[None])?, array::<i64>(cells, "cells", &[None])?);
    let (others, cells) = (others.as_slice()?, cells.as_slice()?);
    Ok(PyArray1::from_vec(py, run(py, || Ok(view::among(others, cells)))?))
}

/// Unit vectors float32[n, 3], packed: float32[n] (glsl/lib/packing.glsl).
#[pyfunction]
pub(super) fn pack_directions<'py>(
    py: Python<'py>,
    directions: &Bound<'py, PyAny>,
) -> PyResult<F32Array<'py>> {
    let directions = array::<f32>(directions, "directions", &[None, Some(3)])?;
    let packed = rows::<f32, 3>(&directions)?.iter().map(|n| pack_direction(*n)).collect();
    Ok(PyArray1::from_vec(py, packed))
}

/// The unit vectors float32[n, 3] that codes float32[n] stand for.
#[pyfunction]
pub(super) fn unpack_directions<'py>(py: Python<'py>, codes: &Bound<'py, PyAny>) -> PyResult<Rows<'py>> {
    let codes = array::<f32>(codes, "codes", &[None])?;
    new_matrix(py, codes.as_slice()?.iter().flat_map(|code| unpack_direction_exactly(*code)).collect(), 3)
}

/// By which two numbers float32[n, 2] rays float64[n, 6] of a light afar start on a disc about a place, and how much
/// larger it is than the one about the scene, float64[n].
#[pyfunction]
pub(super) fn disc_about<'py>(
    py: Python<'py>,
    middle: Vector64,
    rays: &Bound<'py, PyAny>,
) -> PyResult<(Rows<'py>, Bound<'py, PyArray1<f64>>)> {
    let rays = array::<f64>(rays, "rays", &[None, Some(6)])?;
    let rays = rows(&rays)?;
    let (numbers, larger) = run(py, || Ok(aim::discs_about(middle, rays)))?;
    let numbers = new_matrix(py, numbers.into_flattened(), 2)?;
    Ok((numbers, PyArray1::from_vec(py, larger)))
}
