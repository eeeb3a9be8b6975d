// SPDX-License-Identifier: GPL-3.0-or-later
//! Where photons start at lights, and through which portals they go.

use numpy::PyArray1;
use pyo3::prelude::*;

use super::arrays::{F32Array, Rows, array, new_rows, rows};
use super::run;
use crate::{aim, portal_search};

/// A tree of boxes in the numbers in [0, 1) that a light's photons are drawn by, with the probabilities of the
/// least variance.
///
/// Takes numbers float32[n, 4] that samples were drawn by, and of each a mass float32[n], the square of what it
/// brings over its pdf; least: the share of photons that goes by plain numbers, in [0, 1]; nearest: below 1
/// where the third number is the square of a distance: half of that share then looks at all distances from its
/// root on alike. Returns nodes
/// float32[m, 4] laid out as LAYOUTS says of AimNode, the root first, and the deviation that is left, over
/// that of plain numbers. Raises ValueError for what is no number in [0, 1) or no mass.
#[pyfunction]
#[pyo3(signature = (numbers, masses, least, nearest=1.0))]
pub(super) fn aim_tree<'py>(
    py: Python<'py>,
    numbers: &Bound<'py, PyAny>,
    masses: &Bound<'py, PyAny>,
    least: f64,
    nearest: f64,
) -> PyResult<(Rows<'py>, f64)> {
    let numbers = array::<f32>(numbers, "numbers", &[None, Some(4)])?;
    let numbers = rows(&numbers)?;
    let masses = array::<f32>(masses, "masses", &[Some(numbers.len())])?;
    let masses = masses.as_slice()?;
    let (nodes, deviation) = run(py, || aim::tree(numbers, masses, least, nearest))?;
    Ok((new_rows(py, nodes)?, deviation))
}

/// The pdf of numbers float32[n, 4] by a tree's nodes: float32[n]; without a tree it is 1.
#[pyfunction]
pub(super) fn aim_pdf<'py>(
    py: Python<'py>,
    nodes: &Bound<'py, PyAny>,
    numbers: &Bound<'py, PyAny>,
) -> PyResult<F32Array<'py>> {
    let nodes = array::<f32>(nodes, "nodes", &[None, Some(4)])?;
    let numbers = array::<f32>(numbers, "numbers", &[None, Some(4)])?;
    let (nodes, numbers) = (rows(&nodes)?, rows(&numbers)?);
    Ok(PyArray1::from_vec(py, run(py, || Ok(aim::pdf(nodes, numbers)))?))
}

/// The numbers of photons of a pass by the tree whose root is at a place of nodes: those that numbers
/// float32[n, 4] become of the photons uint32[n]. Returns them, and the photons' flux over what it is without.
#[pyfunction]
#[pyo3(signature = (nodes, root, numbers, photons, *, seed, pass_index))]
pub(super) fn aimed_numbers<'py>(
    py: Python<'py>,
    nodes: &Bound<'py, PyAny>,
    root: usize,
    numbers: &Bound<'py, PyAny>,
    photons: &Bound<'py, PyAny>,
    seed: u32,
    pass_index: u32,
) -> PyResult<(Rows<'py>, F32Array<'py>)> {
    let nodes = array::<f32>(nodes, "nodes", &[None, Some(4)])?;
    let numbers = array::<f32>(numbers, "numbers", &[None, Some(4)])?;
    let (nodes, numbers) = (rows(&nodes)?, rows(&numbers)?);
    let photons = array::<u32>(photons, "photons", &[Some(numbers.len())])?;
    let photons = photons.as_slice()?;
    let aimed = || Ok(aim::aimed_photons(nodes, root, seed, pass_index, photons, numbers));
    let (numbers, weights) = run(py, aimed)?;
    Ok((new_rows(py, numbers)?, PyArray1::from_vec(py, weights)))
}

/// Four numbers in [0, 1) of each of elements uint32[n]: float32[n, 4], as random4 of glsl/lib/rng.glsl.
#[pyfunction]
pub(super) fn random_numbers<'py>(
    py: Python<'py>,
    elements: &Bound<'py, PyAny>,
    seed: u32,
    pass_index: u32,
    dimension: u32,
) -> PyResult<Rows<'py>> {
    let elements = array::<u32>(elements, "elements", &[None])?;
    let elements = elements.as_slice()?;
    let draw = |&element: &u32| crate::random::random4(seed, pass_index, element, dimension);
    new_rows(py, elements.iter().map(draw).collect())
}

/// Portals through which photons shall go, float32[3 m, 4] laid out as LAYOUTS says of Portal, and how much less
/// variance that leaves. Takes the paths of photons that counted, one after the other: places float32[n, 3], normals
/// float32[n, 3], the photons' numbers uint32[n], and what each
/// adds to the variance there, float32[n]. Raises ValueError for what is no mass.
#[pyfunction]
pub(super) fn photon_portals<'py>(
    py: Python<'py>,
    places: &Bound<'py, PyAny>,
    normals: &Bound<'py, PyAny>,
    photons: &Bound<'py, PyAny>,
    masses: &Bound<'py, PyAny>,
) -> PyResult<(Rows<'py>, f32)> {
    let places = array::<f32>(places, "places", &[None, Some(3)])?;
    let places = rows::<f32, 3>(&places)?;
    let normals = array::<f32>(normals, "normals", &[Some(places.len()), Some(3)])?;
    let photons = array::<u32>(photons, "photons", &[Some(places.len())])?;
    let masses = array::<f32>(masses, "masses", &[Some(places.len())])?;
    let (normals, photons, masses) = (rows::<f32, 3>(&normals)?, photons.as_slice()?, masses.as_slice()?);
    let (portals, gain) = run(py, || portal_search::search(places, normals, photons, masses))?;
    Ok((new_rows(py, portals.into_iter().flatten().collect())?, gain))
}
