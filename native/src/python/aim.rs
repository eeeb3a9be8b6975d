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

/// A window through which light comes from all around, float32[3, 4] laid out as LAYOUTS says of Portal: the rectangle,
/// near a portal float32[3, 4] or by an axis and a side of frames float32[k, 6], that leaves the least variance where a
/// `share` of shadow rays goes through it, errors relative to what falls on a place, or in the mean below a share of
/// `dark` of that. Takes places float32[m, 3] with their normals float32[m, 3], and ways by
/// which light comes: from which place uint32[n], unit directions float32[n, 3], and for how much of all directions
/// each stands, float32[n]. Raises ValueError for what is no place and no solid angle.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
pub(super) fn fit_window<'py>(
    py: Python<'py>,
    portal: &Bound<'py, PyAny>,
    places: &Bound<'py, PyAny>,
    normals: &Bound<'py, PyAny>,
    from_place: &Bound<'py, PyAny>,
    directions: &Bound<'py, PyAny>,
    angles: &Bound<'py, PyAny>,
    frames: &Bound<'py, PyAny>,
    share: f64,
    dark: f64,
) -> PyResult<Rows<'py>> {
    let portal = array::<f32>(portal, "portal", &[Some(3), Some(4)])?;
    let &[a, b, c] = rows::<f32, 4>(&portal)? else { unreachable!("three rows") };
    let places = array::<f32>(places, "places", &[None, Some(3)])?;
    let places = rows::<f32, 3>(&places)?;
    let normals = array::<f32>(normals, "normals", &[Some(places.len()), Some(3)])?;
    let normals = rows::<f32, 3>(&normals)?;
    let from_place = array::<u32>(from_place, "from_place", &[None])?;
    let from_place = from_place.as_slice()?;
    let directions = array::<f32>(directions, "directions", &[Some(from_place.len()), Some(3)])?;
    let directions = rows::<f32, 3>(&directions)?;
    let angles = array::<f32>(angles, "angles", &[Some(from_place.len())])?;
    let angles = angles.as_slice()?;
    let frames = array::<f32>(frames, "frames", &[None, Some(6)])?;
    let frames = rows::<f32, 6>(&frames)?;
    let found = run(py, || {
        let seen = |(&position, &normal)| portal_search::Seen { position, normal };
        let seen: Vec<_> = places.iter().zip(normals).map(seen).collect();
        let way = |((&place, &direction), &angle)| portal_search::Way { place, direction, angle };
        let ways: Vec<_> = from_place.iter().zip(directions).zip(angles).map(way).collect();
        let frames: Vec<_> = frames.iter().map(|&[a, b, c, d, e, f]| [[a, b, c], [d, e, f]]).collect();
        portal_search::fit_window(&[a, b, c], &seen, &ways, &frames, share, dark)
    })?;
    new_rows(py, found.to_vec())
}
