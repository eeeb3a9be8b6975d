// SPDX-License-Identifier: GPL-3.0-or-later
//! The Python module: numpy arrays in, numpy arrays out.
//!
//! Every function checks its arrays, releases the GIL while it works and turns a panic, which
//! would be a bug here, into a RuntimeError.

use std::panic::{AssertUnwindSafe, catch_unwind};

use numpy::{
    AllowTypeChange, Element, PyArray1, PyArray2, PyArray3, PyArrayLike1, PyArrayMethods, PyReadonlyArrayDyn,
    PyUntypedArray, PyUntypedArrayMethods,
};
use pyo3::exceptions::{PyRuntimeError, PyTypeError, PyValueError};
use pyo3::prelude::*;

use crate::density;
use crate::filter::Filter;
use crate::radius;
use crate::trace::{Rays, Tree};
use crate::watertight::Triangle;
use crate::{InvalidInput, brute_force, bvh, coverage, cuts, paths, photons, refit};

type Stream<'py> = Bound<'py, PyArray3<f32>>;
type Rows<'py> = Bound<'py, PyArray2<f32>>;

type F32Array<'py> = Bound<'py, PyArray1<f32>>;
type I32Array<'py> = Bound<'py, PyArray1<i32>>;
type U32Array<'py> = Bound<'py, PyArray1<u32>>;
type F64Array<'py> = Bound<'py, PyArray1<f64>>;

impl From<InvalidInput> for PyErr {
    fn from(error: InvalidInput) -> PyErr {
        PyValueError::new_err(error.0)
    }
}

/// Native core of Photon Stream: BVH build, CPU ray tracing and photon sorting.
#[pymodule]
fn photon_stream_native(module: &Bound<PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add("MAX_DEPTH", bvh::MAX_DEPTH)?;
    module.add("MAX_LEAF", bvh::MAX_LEAF)?;
    module.add_class::<Tracer>()?;
    module.add_class::<PhotonMap>()?;
    module.add_class::<RadiusField>()?;
    module.add_function(wrap_pyfunction!(radius_grids, module)?)?;
    module.add_function(wrap_pyfunction!(radius_grids_about, module)?)?;
    module.add_function(wrap_pyfunction!(build_bvh, module)?)?;
    module.add_function(wrap_pyfunction!(refit_bvh, module)?)?;
    module.add_function(wrap_pyfunction!(trace, module)?)?;
    module.add_function(wrap_pyfunction!(occluded, module)?)?;
    module.add_function(wrap_pyfunction!(trace_brute_force, module)?)?;
    module.add_function(wrap_pyfunction!(sort_photons, module)?)
}

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
fn build_bvh<'py>(
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
fn refit_bvh<'py>(
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
fn trace<'py>(
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
    let column = |get: &dyn Fn(&crate::watertight::Hit) -> f32, miss: f32| {
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
fn occluded<'py>(
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
fn trace_brute_force<'py>(
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

/// Traces the rays of streams through a scene's triangles.
///
/// Tracer(nodes, corners): nodes as from build_bvh; corners float32[K, 3, 4], the triangles in leaf
/// order, whose fourth numbers are material, surface and the triangle's number in the scene. Raises
/// ValueError as trace does.
#[pyclass(frozen, module = "photon_stream_native")]
struct Tracer {
    tree: Tree,
    corners: Vec<[[f32; 4]; 3]>,
}

#[pymethods]
impl Tracer {
    #[new]
    fn new(py: Python, nodes: &Bound<PyAny>, corners: &Bound<PyAny>) -> PyResult<Tracer> {
        let nodes = array::<f32>(nodes, "nodes", &[None, Some(bvh::NODE_FLOATS)])?;
        let corners = array::<f32>(corners, "corners", &[None, Some(3), Some(4)])?;
        let nodes = nodes.as_slice()?;
        let corners = rows::<f32, 4>(&corners)?.as_chunks::<3>().0.to_vec();
        run(py, || {
            let points: Vec<Triangle> = corners.iter().map(|t| t.map(|[x, y, z, _]| [x, y, z])).collect();
            let numbers = corners.iter().map(|t| t[2][3] as u32).collect();
            Ok(Tracer { tree: Tree::new(nodes, &points)?.numbered(numbers), corners })
        })
    }

    /// Find each ray's closest hit, or with any_hit some hit. Of hits at one distance that of the triangle
    /// with the smallest number is the closest, whatever the tree.
    ///
    /// Takes streams float32[H, W, 4]: origin (position, leaf position of a triangle to pass
    /// through or -1) and direction (vector, how far it goes). Returns hits float32[H, W, 4]: t,
    /// leaf position + 1, u, v; zeros for a miss.
    fn trace<'py>(
        &self,
        py: Python<'py>,
        origin: &Bound<'py, PyAny>,
        direction: &Bound<'py, PyAny>,
        any_hit: bool,
    ) -> PyResult<Stream<'py>> {
        let [origin, direction] = streams([("origin", origin), ("direction", direction)])?;
        new_stream(py, &origin, |out| {
            let (origin, direction) = (rows(&origin)?, rows(&direction)?);
            run(py, || {
                self.tree.trace_records(origin, direction, any_hit, out, |hit| match hit {
                    Some((position, hit)) => [hit.t, (position + 1) as f32, hit.u, hit.v],
                    None => [0.0; 4],
                });
                Ok(())
            })
        })
    }

    /// Trace a pass's photons: Generator, then Tracer, Projector and Reflector while any is alive.
    ///
    /// Takes the tables of the scene: normals float32[K, 3, 4] at the triangles' corners, materials
    /// float32[M, 2, 4] and lights float32[L, 4, 4] as glsl/lib/material.glsl and light.glsl read
    /// them; what random numbers depend on: seed, pass_index; how many photons; how often each may
    /// bounce; and whether first hits are stored, too. A photon on a material that is not there ends.
    ///
    /// Returns (place float32[P, 4], deposit float32[P, 4], unfinished): position and surface + 1,
    /// flux and packed normal, in order of bounce and photon; and how many the last bounce cut off.
    #[allow(clippy::too_many_arguments)]
    #[pyo3(signature = (normals, materials, lights, *, seed, pass_index, photons, bounces, first_hits))]
    fn photons<'py>(
        &self,
        py: Python<'py>,
        normals: &Bound<'py, PyAny>,
        materials: &Bound<'py, PyAny>,
        lights: &Bound<'py, PyAny>,
        seed: u32,
        pass_index: u32,
        photons: u32,
        bounces: u32,
        first_hits: bool,
    ) -> PyResult<(Rows<'py>, Rows<'py>, usize)> {
        let normals = array::<f32>(normals, "normals", &[Some(self.corners.len()), Some(3), Some(4)])?;
        let materials = array::<f32>(materials, "materials", &[None, Some(2), Some(4)])?;
        let lights = array::<f32>(lights, "lights", &[None, Some(4), Some(4)])?;
        let scene = paths::Scene {
            tree: &self.tree,
            corners: &self.corners,
            normals: rows::<f32, 4>(&normals)?.as_chunks().0,
            materials: rows::<f32, 4>(&materials)?.as_chunks().0,
            lights: rows::<f32, 4>(&lights)?.as_chunks().0,
        };
        let emission = paths::Emission { photons, seed, pass_index, bounces, first_hits };
        let landed = run(py, || Ok(paths::trace_photons(&scene, &emission)))?;
        Ok((new_rows(py, landed.places)?, new_rows(py, landed.deposits)?, landed.unfinished))
    }

    /// Find where each visible point's disc ends at what stands on its surface.
    ///
    /// Takes streams float32[H, W, 4]: place (position, surface + 1; 0: no point) and facing
    /// (normal, material); diffuse bool[M], which materials are of interest; radii, of which each is
    /// multiplied by shrink. Returns float32[H, W, 4]: two vectors in the plane of the disc; what has
    /// a scalar product of more than one with either is cut off. Zeros cut nothing.
    #[pyo3(signature = (place, facing, diffuse, radii, *, shrink))]
    fn cuts<'py>(
        &self,
        py: Python<'py>,
        place: &Bound<'py, PyAny>,
        facing: &Bound<'py, PyAny>,
        diffuse: &Bound<'py, PyAny>,
        radii: &RadiusField,
        shrink: f32,
    ) -> PyResult<Stream<'py>> {
        let [place, facing] = streams([("place", place), ("facing", facing)])?;
        let diffuse = array::<bool>(diffuse, "diffuse", &[None])?;
        new_stream(py, &place, |out| {
            let (place, facing, diffuse) = (rows(&place)?, rows(&facing)?, diffuse.as_slice()?);
            run(py, || {
                cuts::cuts(&self.tree, &self.corners, diffuse, &radii.0, shrink, place, facing, out);
                Ok(())
            })
        })
    }

    /// Estimate the share of a filter that lies on each visible point's own surface and is not cut off.
    ///
    /// Takes streams float32[H, W, 4]: place (position, surface + 1; 0: no point) and facing
    /// (normal, material), shading (unused, leaf position of the triangle), cuts; diffuse bool[M], which
    /// materials are of interest; radii, of which each is multiplied by shrink; filter (constant, cone,
    /// gaussian, epanechnikov); probes a point, and how many were sent before; what random numbers
    /// depend on: seed, depth, and of a pixel frame_size and region_origin (x, y).
    /// Returns float32[H, W, 4]: the filter's share, and the inner filter's.
    #[allow(clippy::too_many_arguments)]
    #[pyo3(signature = (place, facing, shading, cuts, diffuse, radii, *, shrink, filter, probes, first_probe, seed, depth, frame_size, region_origin))]
    fn coverage<'py>(
        &self,
        py: Python<'py>,
        place: &Bound<'py, PyAny>,
        facing: &Bound<'py, PyAny>,
        shading: &Bound<'py, PyAny>,
        cuts: &Bound<'py, PyAny>,
        diffuse: &Bound<'py, PyAny>,
        radii: &RadiusField,
        shrink: f32,
        filter: &str,
        probes: u32,
        first_probe: u32,
        seed: u32,
        depth: u32,
        frame_size: (usize, usize),
        region_origin: (usize, usize),
    ) -> PyResult<Stream<'py>> {
        let named = [("place", place), ("facing", facing), ("shading", shading), ("cuts", cuts)];
        let [place, facing, shading, cuts] = streams(named)?;
        let diffuse = array::<bool>(diffuse, "diffuse", &[None])?;
        let probes = coverage::Probes {
            count: probes,
            shrink,
            filter: Filter::named(filter)?,
            first: first_probe,
            seed,
            depth,
            region_width: place.shape()[1],
            frame_width: frame_size.0,
            region_origin: [region_origin.0, region_origin.1],
        };
        new_stream(py, &place, |out| {
            let points = coverage::Points {
                places: rows(&place)?,
                facings: rows(&facing)?,
                shadings: rows(&shading)?,
                cuts: rows(&cuts)?,
            };
            let diffuse = diffuse.as_slice()?;
            run(py, || {
                coverage::coverage(&self.tree, &self.corners, diffuse, &radii.0, &points, &probes, out);
                Ok(())
            })
        })
    }
}

/// A pass's photons in the cells of a grid, for gathering.
///
/// PhotonMap(place, deposit, origin, cell_size, cells): place float32[P, 4] (position, surface + 1),
/// deposit float32[P, 4] (flux, packed normal); the grid as for sort_photons, which says what is
/// refused.
#[pyclass(frozen, module = "photon_stream_native")]
struct PhotonMap(density::PhotonMap);

#[pymethods]
impl PhotonMap {
    #[new]
    fn new(
        py: Python,
        place: &Bound<PyAny>,
        deposit: &Bound<PyAny>,
        origin: [f32; 3],
        cell_size: f32,
        cells: [usize; 3],
    ) -> PyResult<PhotonMap> {
        let place = array::<f32>(place, "place", &[None, Some(4)])?;
        let deposit = array::<f32>(deposit, "deposit", &[None, Some(4)])?;
        let (place, deposit) = (rows(&place)?, rows(&deposit)?);
        let grid = photons::Grid { origin, cell_size, cells };
        Ok(PhotonMap(run(py, || density::PhotonMap::new(place, deposit, grid))?))
    }

    /// Sum the photons around each visible point.
    ///
    /// Takes streams float32[H, W, 4]: place (position, surface + 1; 0: no point), facing
    /// (normal, unused) and cuts; radii, of which each is multiplied by shrink; filter (constant, cone, gaussian, epanechnikov). Returns
    /// float32[H, W, 4]: irradiance in three channels, and their mean within the inner radius; zeros
    /// where no photon can be.
    #[allow(clippy::too_many_arguments)]
    fn gather<'py>(
        &self,
        py: Python<'py>,
        place: &Bound<'py, PyAny>,
        facing: &Bound<'py, PyAny>,
        cuts: &Bound<'py, PyAny>,
        radii: &RadiusField,
        shrink: f32,
        filter: &str,
    ) -> PyResult<Stream<'py>> {
        let [place, facing, cuts] = streams([("place", place), ("facing", facing), ("cuts", cuts)])?;
        let filter = Filter::named(filter)?;
        new_stream(py, &place, |out| {
            let (place, facing, cuts) = (rows(&place)?, rows(&facing)?, rows(&cuts)?);
            run(py, || {
                self.0.gather(place, facing, cuts, &radii.0, shrink, filter, out);
                Ok(())
            })
        })
    }
}

/// The grids over which a RadiusField tells radii, one for each side of surfaces (+x, -x, +y, -y, +z, -z).
///
/// Takes a sample float32[S, 4] of the photons: positions, and packed normals of the surfaces. Returns
/// (float32[6, 16], each row four texels as glsl/lib/radius_grid.glsl reads them; the area of the box about
/// most photons).
///
/// Raises ValueError for a position that is not finite.
#[pyfunction]
fn radius_grids<'py>(py: Python<'py>, sample: &Bound<'py, PyAny>) -> PyResult<(Rows<'py>, f32)> {
    let sample = array::<f32>(sample, "sample", &[None, Some(4)])?;
    let sample = rows(&sample)?;
    let grids = run(py, || radius::Fields::over(sample))?;
    Ok((new_matrix(py, grids.table(), radius::GRID_FLOATS)?, grids.area))
}

/// The same from boxes uint32[7, 6] as glsl/lib/photon_boxes.glsl finds them: of most photons, and of those of
/// them that count for each side.
///
/// Raises ValueError if the first is not finite.
#[pyfunction]
fn radius_grids_about<'py>(py: Python<'py>, boxes: &Bound<'py, PyAny>) -> PyResult<(Rows<'py>, f32)> {
    let boxes = array::<u32>(boxes, "boxes", &[Some(7), Some(6)])?;
    let boxes: &[[u32; 6]] = rows(&boxes)?;
    let corners = |at: usize| {
        let low = std::array::from_fn(|k| radius::of_ordered(!boxes[at][k]));
        [low, std::array::from_fn(|k| radius::of_ordered(boxes[at][3 + k]))]
    };
    let grids = radius::Fields::about(corners(0), std::array::from_fn(|side| corners(1 + side)))?;
    Ok((new_matrix(py, grids.table(), radius::GRID_FLOATS)?, grids.area))
}

/// The gather radius of the first pass at every place of a surface.
///
/// RadiusField(place, deposit, grids, *, photons, times, most, pixel, eye): place float32[P, 4], where
/// photons fall, of which those outside the grids don't count; deposit float32[P, 4], whose fourth
/// numbers are the surfaces' packed normals; grids as of radius_grids. Each radius is that of a disc
/// that would hold about `photons` of them, of which a pass has `times` so many; at most `most`, and at
/// least `pixel` times the distance from eye (None: times 1). It changes by less than half the way moved.
#[pyclass(frozen, module = "photon_stream_native")]
struct RadiusField(radius::RadiusField);

#[pymethods]
impl RadiusField {
    #[new]
    #[allow(clippy::too_many_arguments)]
    #[pyo3(signature = (place, deposit, grids, *, photons, times, most, pixel, eye))]
    fn new(
        py: Python,
        place: &Bound<PyAny>,
        deposit: &Bound<PyAny>,
        grids: &Bound<PyAny>,
        photons: f32,
        times: f32,
        most: f32,
        pixel: f32,
        eye: Option<[f32; 3]>,
    ) -> PyResult<RadiusField> {
        let place = array::<f32>(place, "place", &[None, Some(4)])?;
        let deposit = array::<f32>(deposit, "deposit", &[None, Some(4)])?;
        let (place, deposit) = (rows(&place)?, rows(&deposit)?);
        let grids = array::<f32>(grids, "grids", &[None, Some(radius::GRID_FLOATS)])?;
        let grids = radius::Fields::sides_of(rows(&grids)?)?;
        let wanted = radius::Wanted { photons, times, most, pixel, eye };
        let field = run(py, || radius::RadiusField::new(place, deposit, &grids, &wanted))?;
        Ok(RadiusField(field))
    }

    /// The same out of its table float32[texels, 4] and what typical() says.
    #[staticmethod]
    fn of_table(table: &Bound<PyAny>, typical: f32) -> PyResult<RadiusField> {
        let table = array::<f32>(table, "table", &[None, Some(4)])?;
        let texels: &[[f32; 4]] = rows(&table)?;
        Ok(RadiusField(radius::RadiusField::of_table(texels.as_flattened(), typical)?))
    }

    /// The radii float32[P] at place float32[P, 4] of surfaces with the normals facing float32[P, 4];
    /// the fourth numbers are ignored.
    fn at<'py>(
        &self,
        py: Python<'py>,
        place: &Bound<'py, PyAny>,
        facing: &Bound<'py, PyAny>,
    ) -> PyResult<F32Array<'py>> {
        let place = array::<f32>(place, "place", &[None, Some(4)])?;
        let facing = array::<f32>(facing, "facing", &[None, Some(4)])?;
        let both = rows::<f32, 4>(&place)?.iter().zip(rows::<f32, 4>(&facing)?);
        let radii = both.map(|(&[x, y, z, _], &[nx, ny, nz, _])| self.0.at([x, y, z], [nx, ny, nz]));
        Ok(PyArray1::from_iter(py, radii))
    }

    /// The median of the radii at the photons.
    fn typical(&self) -> f32 {
        self.0.typical()
    }

    /// The largest radius.
    fn largest(&self) -> f32 {
        self.0.largest()
    }

    /// What glsl/lib/radius.glsl reads, float32[texels, 4].
    fn table<'py>(&self, py: Python<'py>) -> PyResult<Rows<'py>> {
        new_matrix(py, self.0.table(), 4)
    }
}

/// Sort photons by grid cell, stably.
///
/// Takes positions float32[P, 3 or 4], of which a fourth column is ignored; origin, three
/// numbers; cell_size > 0, in the same unit; cells (nx, ny, nz), at most 2^27 in all. A photon's
/// cell is floor((p - origin) / cell_size) in float32, clamped to the grid, and numbered x fastest.
///
/// Returns (cell_start uint32[nx * ny * nz + 1], order uint32[P]): the photons of cell c are
/// order[cell_start[c] : cell_start[c + 1]], in ascending order.
///
/// Raises ValueError for a position that is not finite and for a grid that makes no sense.
#[pyfunction]
fn sort_photons<'py>(
    py: Python<'py>,
    positions: &Bound<'py, PyAny>,
    origin: PyArrayLike1<'py, f32, AllowTypeChange>,
    cell_size: f32,
    cells: (i64, i64, i64),
) -> PyResult<(U32Array<'py>, U32Array<'py>)> {
    let positions = array::<f32>(positions, "positions", &[None, None])?;
    let stride = positions.shape()[1];
    if stride != 3 && stride != 4 {
        return Err(PyValueError::new_err(format!("positions: expected 3 or 4 columns, got {stride}")));
    }
    let origin: [f32; 3] = origin
        .as_slice()
        .ok()
        .and_then(|origin| origin.try_into().ok())
        .ok_or_else(|| PyValueError::new_err("origin: expected three contiguous numbers"))?;
    let mut grid = photons::Grid { origin, cell_size, cells: [0; 3] };
    for (k, n) in [cells.0, cells.1, cells.2].into_iter().enumerate() {
        grid.cells[k] = usize::try_from(n)
            .map_err(|_| PyValueError::new_err(format!("cells[{k}] = {n} is not positive")))?;
    }
    let positions = positions.as_slice()?;
    let (cell_start, order) = run(py, || photons::sort(positions, stride, &grid))?;
    Ok((PyArray1::from_vec(py, cell_start), PyArray1::from_vec(py, order)))
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

/// Streams float32[H, W, 4] of one size.
fn streams<'py, const N: usize>(
    objects: [(&str, &Bound<'py, PyAny>); N],
) -> PyResult<[PyReadonlyArrayDyn<'py, f32>; N]> {
    let mut found: Vec<PyReadonlyArrayDyn<f32>> = Vec::with_capacity(N);
    for (name, object) in objects {
        let stream = array::<f32>(object, name, &[None, None, Some(4)])?;
        if let Some(first) = found.first().filter(|first| first.shape() != stream.shape()) {
            return Err(PyValueError::new_err(format!(
                "{name} has shape {:?}, but {} has {:?}",
                stream.shape(),
                objects[0].0,
                first.shape()
            )));
        }
        found.push(stream);
    }
    Ok(found.try_into().expect("as many as were asked for"))
}

/// An array of so many columns.
fn new_matrix(py: Python, values: Vec<f32>, columns: usize) -> PyResult<Rows> {
    let shape = [values.len() / columns, columns];
    PyArray1::from_vec(py, values).reshape(shape)
}

fn new_rows(py: Python, rows: Vec<[f32; 4]>) -> PyResult<Rows> {
    new_matrix(py, rows.into_flattened(), 4)
}

/// A stream of another's size, filled by `fill`.
fn new_stream<'py>(
    py: Python<'py>,
    like: &PyReadonlyArrayDyn<'py, f32>,
    fill: impl FnOnce(&mut [[f32; 4]]) -> PyResult<()>,
) -> PyResult<Stream<'py>> {
    let (height, width) = (like.shape()[0], like.shape()[1]);
    let mut out = vec![[0.0; 4]; height * width];
    fill(&mut out)?;
    PyArray1::from_vec(py, out.into_flattened()).reshape([height, width, 4])
}

/// A C-contiguous array of one type and shape (None: any number of rows), or an error naming it.
fn array<'py, T: Element>(
    object: &Bound<'py, PyAny>,
    name: &str,
    shape: &[Option<usize>],
) -> PyResult<PyReadonlyArrayDyn<'py, T>> {
    let dtype = numpy::dtype::<T>(object.py());
    let Ok(untyped) = object.cast::<PyUntypedArray>() else {
        let kind = object.get_type().name()?;
        return Err(PyTypeError::new_err(format!("{name}: expected a numpy array of {dtype}, got {kind}")));
    };
    let fits = untyped.ndim() == shape.len()
        && untyped.shape().iter().zip(shape).all(|(have, want)| want.is_none_or(|want| want == *have));
    if !fits {
        let want: Vec<_> = shape.iter().map(|n| n.map_or("any".to_string(), |n| n.to_string())).collect();
        return Err(PyValueError::new_err(format!(
            "{name}: expected shape [{}], got {:?}",
            want.join(", "),
            untyped.shape()
        )));
    }
    let Ok(array) = object.extract::<PyReadonlyArrayDyn<T>>() else {
        return Err(PyTypeError::new_err(format!("{name}: expected {dtype}, got {}", untyped.dtype())));
    };
    if !array.is_c_contiguous() {
        return Err(PyValueError::new_err(format!("{name}: expected a C-contiguous array")));
    }
    Ok(array)
}

fn rows<'a, T: Element, const N: usize>(array: &'a PyReadonlyArrayDyn<T>) -> PyResult<&'a [[T; N]]> {
    Ok(array.as_slice()?.as_chunks::<N>().0)
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
