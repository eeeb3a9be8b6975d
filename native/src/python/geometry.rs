// SPDX-License-Identifier: GPL-3.0-or-later
//! Trees over triangles, and rays through them, as functions of arrays.

use numpy::{PyArray1, PyReadonlyArrayDyn};
use pyo3::prelude::*;

use super::arrays::{F32Array, F64Array, I32Array, Rows, array, new_matrix, rows};
use super::run;
use crate::trace::{Rays, Tree};
use crate::watertight::{Hit, Triangle};
use crate::{brute_force, bvh, refit};

/// Build a BVH over triangles, the same on any number of threads.
///
/// Takes vertices float32[V, 3] and triangles int32[T, 3], indices into vertices.
///
/// Returns (nodes float32[N, 16], order int32[K], skipped_not_finite, skipped_degenerate, cost).
/// A node is four RGBA32F texels: left.min.xyz, left_ref | left.max.xyz, left_count |
/// right.min.xyz, right_ref | right.max.xyz, right_count. References and counts are float values.
/// count == 0: ref is the index of an inner node, behind this one. count > 0: a leaf of the
/// triangles order[ref : ref + count], at most MAX_LEAF. Node 0 is the root and always there. A
/// missing child, which only the root can have, has min 3e38, max -3e38, ref -1 and count 0. No
/// path holds more than MAX_DEPTH nodes, so a traversal needs a stack of MAX_DEPTH entries.
///
/// cost is the SAH cost over the areas of the triangles' own boxes: see refit_bvh.
///
/// order lists the kept triangles in leaf order. Left out, and counted, are triangles with a
/// coordinate that is not finite or beyond 1e30, and triangles of exactly zero area.
///
/// Raises ValueError for an index outside [0, V) and for 2^24 or more triangles.
#[pyfunction]
pub(super) fn build_bvh<'py>(
    py: Python<'py>,
    vertices: &Bound<'py, PyAny>,
    triangles: &Bound<'py, PyAny>,
) -> PyResult<(Rows<'py>, I32Array<'py>, usize, usize, f64)> {
    let vertices = array::<f32>(vertices, "vertices", &[None, Some(3)])?;
    let triangles = array::<i32>(triangles, "triangles", &[None, Some(3)])?;
    let (vertices, triangles) = (rows::<f32, 3>(&vertices)?, rows::<i32, 3>(&triangles)?);
    let tree = run(py, || bvh::build(vertices, triangles))?;
    let order = tree.order.into_iter().map(|index| index as i32).collect();
    let nodes = new_matrix(py, tree.nodes, bvh::NODE_FLOATS)?;
    let order = PyArray1::from_vec(py, order);
    Ok((nodes, order, tree.skipped_not_finite, tree.skipped_degenerate, tree.cost))
}

/// Fit a BVH's boxes to triangles whose vertices have moved.
///
/// Takes nodes float32[N, 16] and order int32[K], as build_bvh or refit_bvh gave them for triangles
/// int32[T, 3]; and vertices float32[V, 3], where these are now.
///
/// Returns (nodes float32[N, 16], skipped_not_finite, skipped_degenerate, cost): the same tree about the
/// same triangles, with other boxes. Where its cost is above what it was when it was built, another tree
/// would be that much faster, about. None if not all of the triangles in order, or others, would be kept by
/// build_bvh.
///
/// Raises ValueError for an index outside [0, V), an order with a number outside [0, T) or twice, and
/// nodes whose references are out of range or not to a later node.
#[pyfunction]
#[allow(clippy::type_complexity)]
pub(super) fn refit_bvh<'py>(
    py: Python<'py>,
    nodes: &Bound<'py, PyAny>,
    order: &Bound<'py, PyAny>,
    vertices: &Bound<'py, PyAny>,
    triangles: &Bound<'py, PyAny>,
) -> PyResult<Option<(Rows<'py>, usize, usize, f64)>> {
    let nodes = array::<f32>(nodes, "nodes", &[None, Some(bvh::NODE_FLOATS)])?;
    let order = array::<i32>(order, "order", &[None])?;
    let vertices = array::<f32>(vertices, "vertices", &[None, Some(3)])?;
    let triangles = array::<i32>(triangles, "triangles", &[None, Some(3)])?;
    let (nodes, order) = (nodes.as_slice()?, order.as_slice()?);
    let (vertices, triangles) = (rows::<f32, 3>(&vertices)?, rows::<i32, 3>(&triangles)?);
    let Some(tree) = run(py, || refit::refit(nodes, order, vertices, triangles))? else {
        return Ok(None);
    };
    let nodes = new_matrix(py, tree.nodes, bvh::NODE_FLOATS)?;
    Ok(Some((nodes, tree.skipped_not_finite, tree.skipped_degenerate, tree.cost)))
}

/// Find the closest hit of each ray, watertight (Woop, Benthin & Wald 2013).
///
/// Takes nodes as from build_bvh; corners float32[K, 3, 3], the triangles' vertices in leaf
/// order, i.e. vertices[triangles[order]]; origins and directions float32[R, 3]; t_max
/// float32[R]; skip int32[R], the leaf position of a triangle to pass through, or -1.
///
/// Returns (t float32[R], triangle int32[R], u float32[R], v float32[R]): the hit lies at
/// origin + t * direction = (1 - u - v) * v0 + u * v1 + v * v2 with 0 < t < t_max, and triangle is
/// a position in leaf order. Of hits at one distance the smallest position wins. A miss is t = inf,
/// triangle = -1, u = v = 0. Rays with NaN, infinite or zero directions (largest component outside
/// [1e-18, 1e18]), or origins beyond 1e30, miss.
///
/// Raises ValueError for nodes that do not describe a tree over corners, a skip outside [-1, K)
/// and arrays that do not fit together.
#[pyfunction]
#[allow(clippy::type_complexity, clippy::too_many_arguments)]
pub(super) fn trace<'py>(
    py: Python<'py>,
    nodes: &Bound<'py, PyAny>,
    corners: &Bound<'py, PyAny>,
    origins: &Bound<'py, PyAny>,
    directions: &Bound<'py, PyAny>,
    t_max: &Bound<'py, PyAny>,
    skip: &Bound<'py, PyAny>,
) -> PyResult<(F32Array<'py>, I32Array<'py>, F32Array<'py>, F32Array<'py>)> {
    let nodes = array::<f32>(nodes, "nodes", &[None, Some(bvh::NODE_FLOATS)])?;
    let corners = array::<f32>(corners, "corners", &[None, Some(3), Some(3)])?;
    let rays = RayArrays::new(origins, directions, t_max, skip)?;
    let (nodes, corners, rays) = (nodes.as_slice()?, triangles(&corners)?, rays.view()?);
    let hits = run(py, || {
        rays.check(corners.len())?;
        Ok(Tree::new(nodes, corners)?.trace(&rays))
    })?;
    let column = |get: &dyn Fn(&Hit) -> f32, miss: f32| {
        PyArray1::from_iter(py, hits.iter().map(|hit| hit.as_ref().map_or(miss, |(_, hit)| get(hit))))
    };
    let position = PyArray1::from_iter(py, hits.iter().map(|hit| hit.map_or(-1, |(position, _)| position)));
    Ok((column(&|hit| hit.t, f32::INFINITY), position, column(&|hit| hit.u, 0.0), column(&|hit| hit.v, 0.0)))
}

/// Tell which rays hit anything in 0 < t < t_max. Arguments and errors as for trace.
///
/// Returns bool[R].
#[pyfunction]
#[allow(clippy::too_many_arguments)]
pub(super) fn occluded<'py>(
    py: Python<'py>,
    nodes: &Bound<'py, PyAny>,
    corners: &Bound<'py, PyAny>,
    origins: &Bound<'py, PyAny>,
    directions: &Bound<'py, PyAny>,
    t_max: &Bound<'py, PyAny>,
    skip: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyArray1<bool>>> {
    let nodes = array::<f32>(nodes, "nodes", &[None, Some(bvh::NODE_FLOATS)])?;
    let corners = array::<f32>(corners, "corners", &[None, Some(3), Some(3)])?;
    let rays = RayArrays::new(origins, directions, t_max, skip)?;
    let (nodes, corners, rays) = (nodes.as_slice()?, triangles(&corners)?, rays.view()?);
    let found = run(py, || {
        rays.check(corners.len())?;
        Ok(Tree::new(nodes, corners)?.occluded(&rays))
    })?;
    Ok(PyArray1::from_vec(py, found))
}

/// Find the closest hit of each ray by testing every triangle in float64: an oracle for tests.
///
/// Arguments and errors as for trace, without nodes. Returns (t float64[R], triangle int32[R],
/// u float64[R], v float64[R]). Independent of trace's algorithm, and not watertight.
#[pyfunction]
#[allow(clippy::type_complexity)]
pub(super) fn trace_brute_force<'py>(
    py: Python<'py>,
    corners: &Bound<'py, PyAny>,
    origins: &Bound<'py, PyAny>,
    directions: &Bound<'py, PyAny>,
    t_max: &Bound<'py, PyAny>,
    skip: &Bound<'py, PyAny>,
) -> PyResult<(F64Array<'py>, I32Array<'py>, F64Array<'py>, F64Array<'py>)> {
    let corners = array::<f32>(corners, "corners", &[None, Some(3), Some(3)])?;
    let rays = RayArrays::new(origins, directions, t_max, skip)?;
    let (corners, rays) = (triangles(&corners)?, rays.view()?);
    let hits = run(py, || {
        rays.check(corners.len())?;
        Ok(brute_force::trace(corners, &rays))
    })?;
    let column = |get: &dyn Fn(&brute_force::Hit64) -> f64, miss: f64| {
        PyArray1::from_iter(py, hits.iter().map(|hit| hit.as_ref().map_or(miss, get)))
    };
    let position = PyArray1::from_iter(py, hits.iter().map(|hit| hit.map_or(-1, |hit| hit.0)));
    Ok((column(&|hit| hit.1, f64::INFINITY), position, column(&|hit| hit.2, 0.0), column(&|hit| hit.3, 0.0)))
}

fn triangles<'a>(array: &'a PyReadonlyArrayDyn<f32>) -> PyResult<&'a [Triangle]> {
    Ok(rows::<f32, 3>(array)?.as_chunks::<3>().0)
}

struct RayArrays<'py> {
    origins: PyReadonlyArrayDyn<'py, f32>,
    directions: PyReadonlyArrayDyn<'py, f32>,
    t_max: PyReadonlyArrayDyn<'py, f32>,
    skip: PyReadonlyArrayDyn<'py, i32>,
}

impl<'py> RayArrays<'py> {
    fn new(
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
        t_max: &Bound<'py, PyAny>,
        skip: &Bound<'py, PyAny>,
    ) -> PyResult<Self> {
        Ok(RayArrays {
            origins: array(origins, "origins", &[None, Some(3)])?,
            directions: array(directions, "directions", &[None, Some(3)])?,
            t_max: array(t_max, "t_max", &[None])?,
            skip: array(skip, "skip", &[None])?,
        })
    }

    fn view(&self) -> PyResult<Rays<'_>> {
        Ok(Rays {
            origins: rows(&self.origins)?,
            directions: rows(&self.directions)?,
            t_max: self.t_max.as_slice()?,
            skip: self.skip.as_slice()?,
        })
    }
}
