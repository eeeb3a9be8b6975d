// SPDX-License-Identifier: GPL-3.0-or-later
//! Trees over triangles, and rays through them, as functions of arrays.

use numpy::{Element, PyArray1, PyReadonlyArrayDyn};
use pyo3::prelude::*;

use super::arrays::{I32Array, Rows, array, new_matrix, new_rows, record_of, rows};
use super::run;
use crate::trace::{Rays, Tree};
use crate::watertight::Triangle;
use crate::{InvalidInput, brute_force, bvh, faces, few, refit};

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
    let tree = with_triangles(py, vertices, triangles, bvh::build)?;
    let order = tree.order.into_iter().map(|index| index as i32).collect();
    let nodes = new_matrix(py, tree.nodes, bvh::NODE_FLOATS)?;
    let order = PyArray1::from_vec(py, order);
    Ok((nodes, order, tree.skipped_not_finite, tree.skipped_degenerate, tree.cost))
}

/// Which triangles make quads with others, bound a solid, and have something lying on them.
///
/// Takes nodes float32[N, 16] and order int32[K], as build_bvh or refit_bvh gave them for triangles int32[T, 3],
/// indices into vertices float32[V, 3]; and of the triangles surfaces int32[T], of which corners in one place are
/// one, and materials int32[T]. Returns float32[T, 4], which native/src/faces.rs tells of.
///
/// Raises ValueError for an index outside [0, V), another number of surfaces or materials, an order as refit_bvh refuses
/// it, and nodes that are met whose references are out of range, not to a later node, or to one with two parents.
#[pyfunction]
pub(super) fn faces_of<'py>(
    py: Python<'py>,
    nodes: &Bound<'py, PyAny>,
    order: &Bound<'py, PyAny>,
    vertices: &Bound<'py, PyAny>,
    triangles: &Bound<'py, PyAny>,
    surfaces: &Bound<'py, PyAny>,
    materials: &Bound<'py, PyAny>,
) -> PyResult<Rows<'py>> {
    let surfaces = array::<i32>(surfaces, "surfaces", &[None])?;
    let materials = array::<i32>(materials, "materials", &[None])?;
    let (surfaces, materials) = (surfaces.as_slice()?, materials.as_slice()?);
    let nodes = array::<f32>(nodes, "nodes", &[None, Some(bvh::NODE_FLOATS)])?;
    let order = array::<i32>(order, "order", &[None])?;
    let (nodes, order) = (nodes.as_slice()?, order.as_slice()?);
    let found = with_triangles(py, vertices, triangles, |vertices, triangles| {
        faces::faces(nodes, order, vertices, triangles, surfaces, materials)
    })?;
    new_rows(py, found)
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
    let (nodes, order) = (nodes.as_slice()?, order.as_slice()?);
    let tree = with_triangles(py, vertices, triangles, |vertices, triangles| {
        refit::refit(nodes, order, vertices, triangles)
    })?;
    let Some(tree) = tree else { return Ok(None) };
    let nodes = new_matrix(py, tree.nodes, bvh::NODE_FLOATS)?;
    Ok(Some((nodes, tree.skipped_not_finite, tree.skipped_degenerate, tree.cost)))
}

/// What `work` makes of vertices float32[V, 3] and triangles int32[T, 3].
fn with_triangles<T: Send>(
    py: Python,
    vertices: &Bound<PyAny>,
    triangles: &Bound<PyAny>,
    work: impl FnOnce(&[[f32; 3]], &[[i32; 3]]) -> Result<T, InvalidInput> + Send,
) -> PyResult<T> {
    let vertices = array::<f32>(vertices, "vertices", &[None, Some(3)])?;
    let triangles = array::<i32>(triangles, "triangles", &[None, Some(3)])?;
    let (vertices, triangles) = (rows(&vertices)?, rows(&triangles)?);
    run(py, || work(vertices, triangles))
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
#[allow(clippy::too_many_arguments)]
pub(super) fn trace<'py>(
    py: Python<'py>,
    nodes: &Bound<'py, PyAny>,
    corners: &Bound<'py, PyAny>,
    origins: &Bound<'py, PyAny>,
    directions: &Bound<'py, PyAny>,
    t_max: &Bound<'py, PyAny>,
    skip: &Bound<'py, PyAny>,
) -> PyResult<Hits<'py, f32>> {
    let traced = Traced::new([corners, origins, directions, t_max, skip])?;
    let hits = traced.through(py, nodes, |tree, rays| tree.trace(rays))?;
    Ok(columns(py, hits.into_iter().map(|hit| hit.map(|(at, hit)| (at, [hit.t, hit.u, hit.v])))))
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
    let traced = Traced::new([corners, origins, directions, t_max, skip])?;
    Ok(PyArray1::from_vec(py, traced.through(py, nodes, |tree, rays| tree.occluded(rays))?))
}

/// Find the closest hit of each of few rays, or with any_hit some hit: the same as Tracer.trace, sooner than a Tracer
/// is made.
///
/// Takes nodes and corners as Tracer does; origin and direction float32[R, 4] as rows of its streams. Returns hits
/// float32[R, 4] as it does. Raises ValueError where a ray comes to nodes that describe no tree over corners.
#[pyfunction]
pub(super) fn trace_few<'py>(
    py: Python<'py>,
    nodes: &Bound<'py, PyAny>,
    corners: &Bound<'py, PyAny>,
    origin: &Bound<'py, PyAny>,
    direction: &Bound<'py, PyAny>,
    any_hit: bool,
) -> PyResult<Rows<'py>> {
    let nodes = array::<f32>(nodes, "nodes", &[None, Some(bvh::NODE_FLOATS)])?;
    let corners = array::<f32>(corners, "corners", &[None, Some(3), Some(4)])?;
    let origin = array::<f32>(origin, "origin", &[None, Some(4)])?;
    let origin = rows::<f32, 4>(&origin)?;
    let direction = array::<f32>(direction, "direction", &[Some(origin.len()), Some(4)])?;
    let (nodes, direction) = (rows(&nodes)?, rows(&direction)?);
    let corners = rows::<f32, 4>(&corners)?.as_chunks::<3>().0;
    let hits = run(py, || few::trace(nodes, corners, origin, direction, any_hit))?;
    new_rows(py, hits.into_iter().map(record_of).collect())
}

/// Find the closest hit of each ray by testing every triangle in float64: an oracle for tests.
///
/// Arguments and errors as for trace, without nodes. Returns (t float64[R], triangle int32[R],
/// u float64[R], v float64[R]). Independent of trace's algorithm, and not watertight.
#[pyfunction]
pub(super) fn trace_brute_force<'py>(
    py: Python<'py>,
    corners: &Bound<'py, PyAny>,
    origins: &Bound<'py, PyAny>,
    directions: &Bound<'py, PyAny>,
    t_max: &Bound<'py, PyAny>,
    skip: &Bound<'py, PyAny>,
) -> PyResult<Hits<'py, f64>> {
    let traced = Traced::new([corners, origins, directions, t_max, skip])?;
    let hits = traced.run(py, |corners, rays| Ok(brute_force::trace(corners, rays)))?;
    Ok(columns(py, hits.into_iter().map(|hit| hit.map(|(at, t, u, v)| (at, [t, u, v])))))
}

/// (t, triangle, u, v) of rays.
type Hits<'py, T> =
    (Bound<'py, PyArray1<T>>, I32Array<'py>, Bound<'py, PyArray1<T>>, Bound<'py, PyArray1<T>>);

/// Of each ray's triangle and [t, u, v], or a miss.
fn columns<'py, T: Element + Copy + From<f32>>(
    py: Python<'py>,
    hits: impl Iterator<Item = Option<(i32, [T; 3])>>,
) -> Hits<'py, T> {
    let miss = (-1, [f32::INFINITY, 0.0, 0.0].map(T::from));
    let hits: Vec<_> = hits.map(|hit| hit.unwrap_or(miss)).collect();
    let column = |k: usize| PyArray1::from_iter(py, hits.iter().map(|(_, numbers)| numbers[k]));
    (column(0), PyArray1::from_iter(py, hits.iter().map(|&(at, _)| at)), column(1), column(2))
}

/// Triangles, and rays that may hit them.
struct Traced<'py> {
    corners: PyReadonlyArrayDyn<'py, f32>,
    origins: PyReadonlyArrayDyn<'py, f32>,
    directions: PyReadonlyArrayDyn<'py, f32>,
    t_max: PyReadonlyArrayDyn<'py, f32>,
    skip: PyReadonlyArrayDyn<'py, i32>,
}

impl<'py> Traced<'py> {
    /// Of the arguments after nodes.
    fn new([corners, origins, directions, t_max, skip]: [&Bound<'py, PyAny>; 5]) -> PyResult<Self> {
        Ok(Traced {
            corners: array(corners, "corners", &[None, Some(3), Some(3)])?,
            origins: array(origins, "origins", &[None, Some(3)])?,
            directions: array(directions, "directions", &[None, Some(3)])?,
            t_max: array(t_max, "t_max", &[None])?,
            skip: array(skip, "skip", &[None])?,
        })
    }

    /// What `work` finds of the triangles and the rays.
    fn run<T: Send>(
        &self,
        py: Python,
        work: impl FnOnce(&[Triangle], &Rays) -> Result<T, InvalidInput> + Send,
    ) -> PyResult<T> {
        let corners = rows::<f32, 3>(&self.corners)?.as_chunks::<3>().0;
        let rays = Rays {
            origins: rows(&self.origins)?,
            directions: rows(&self.directions)?,
            t_max: self.t_max.as_slice()?,
            skip: self.skip.as_slice()?,
        };
        run(py, || {
            rays.check(corners.len())?;
            work(corners, &rays)
        })
    }

    /// The same by a tree over the triangles.
    fn through<T: Send>(
        &self,
        py: Python,
        nodes: &Bound<PyAny>,
        work: impl FnOnce(&Tree, &Rays) -> T + Send,
    ) -> PyResult<T> {
        let nodes = array::<f32>(nodes, "nodes", &[None, Some(bvh::NODE_FLOATS)])?;
        let nodes = nodes.as_slice()?;
        self.run(py, |corners, rays| Ok(work(&Tree::new(nodes, corners)?, rays)))
    }
}
