// SPDX-License-Identifier: GPL-3.0-or-later
//! A scene's triangles, and what rays through them find.

use numpy::PyUntypedArrayMethods;
use pyo3::prelude::*;

use super::arrays::{
    Rows, Stream, array, given, new_matrix, new_rows, new_stream, new_streams, record_of, rows, streams,
};
use super::radius_field::RadiusField;
use super::run;
use crate::filter::Filter;
use crate::trace::{Tree, Visible};
use crate::watertight::Triangle;
use crate::{bvh, coverage, cuts, emission, paths, walks};

/// Traces the rays of streams through a scene's triangles.
///
/// Tracer(nodes, corners, visible=None, flags=None): nodes as from build_bvh; corners float32[K, 3, 4], the
/// triangles in leaf order, whose fourth numbers are material, surface and the triangle's number in the
/// scene; visible uint8[K], a bit for each class of rays that meets a triangle, or None: all do; flags
/// uint8[K], see glsl/lib/triangle.glsl. Raises ValueError as trace does.
#[pyclass(frozen, module = "photon_stream_native")]
pub(super) struct Tracer {
    tree: Tree,
    corners: Vec<[[f32; 4]; 3]>,
    visible: Vec<u8>,
    flags: Vec<u8>,
}

/// What is told of each triangle, if it is.
fn of_each(values: Option<&Bound<PyAny>>, name: &str, count: usize) -> PyResult<Vec<u8>> {
    values
        .map_or(Ok(Vec::new()), |values| Ok(array::<u8>(values, name, &[Some(count)])?.as_slice()?.to_vec()))
}

#[pymethods]
impl Tracer {
    #[new]
    #[pyo3(signature = (nodes, corners, visible=None, flags=None))]
    fn new(
        py: Python,
        nodes: &Bound<PyAny>,
        corners: &Bound<PyAny>,
        visible: Option<&Bound<PyAny>>,
        flags: Option<&Bound<PyAny>>,
    ) -> PyResult<Tracer> {
        let nodes = array::<f32>(nodes, "nodes", &[None, Some(bvh::NODE_FLOATS)])?;
        let corners = array::<f32>(corners, "corners", &[None, Some(3), Some(4)])?;
        let nodes = nodes.as_slice()?;
        let corners = rows::<f32, 4>(&corners)?.as_chunks::<3>().0.to_vec();
        let count = corners.len();
        let visible = of_each(visible, "visible", count)?;
        let flags = of_each(flags, "flags", count)?;
        run(py, || {
            let points: Vec<Triangle> = corners.iter().map(|t| t.map(|[x, y, z, _]| [x, y, z])).collect();
            let numbers = corners.iter().map(|t| t[2][3] as u32).collect();
            Ok(Tracer { tree: Tree::new(nodes, &points)?.numbered(numbers), corners, visible, flags })
        })
    }

    /// Find each ray's closest hit, or with any_hit some hit. Of hits at one distance that of the triangle
    /// with the smallest number is the closest, whatever the tree.
    ///
    /// Takes streams float32[H, W, 4]: origin (position, leaf position of a triangle to pass
    /// through or -1) and direction (vector, how far it goes). Returns hits float32[H, W, 4]: t,
    /// leaf position + 1, u, v; zeros for a miss. The rays meet the triangles that are visible to one of the
    /// classes whose bits are set in rays, or with by_reach to what each ray is by how far it goes.
    #[pyo3(signature = (origin, direction, any_hit, rays=255, by_reach=false))]
    fn trace<'py>(
        &self,
        py: Python<'py>,
        origin: &Bound<'py, PyAny>,
        direction: &Bound<'py, PyAny>,
        any_hit: bool,
        rays: u8,
        by_reach: bool,
    ) -> PyResult<Stream<'py>> {
        let visible = Visible { bits: &self.visible, rays, by_reach };
        let [origin, direction] = streams([("origin", origin), ("direction", direction)])?;
        new_stream(py, &origin, |out| {
            let (origin, direction) = (rows(&origin)?, rows(&direction)?);
            run(py, || {
                self.tree.trace_records(origin, direction, any_hit, visible, out, record_of);
                Ok(())
            })
        })
    }

    /// Trace a pass's photons: Generator, then Tracer, Projector and Reflector while any is alive.
    ///
    /// Takes the tables of the scene: normals float32[K, 3, 4] at the triangles' corners, materials
    /// float32[M, 2, 4] and lights float32[L, 4, 4] laid out as LAYOUTS says of PlainMaterial and
    /// PlainLight; what random numbers depend on: seed, pass_index; how many photons; how often each may
    /// bounce; whether first hits are stored, too; and whether fluxes carry
    /// the direction to the light. A photon on a material that is not there ends. numbered: in place of
    /// its flux each deposit has the channels' sum, its photon's number, a half more before it has bounced, and
    /// 0. aims float32[L, 4] and aim_nodes float32[N, 4], as LightAim and AimNode: how photons start at lights.
    /// portals float32[n, 3, 4], as Portal: where they go from diffuse surfaces.
    ///
    /// Returns (place float32[P, 4], deposit float32[P, 4], unfinished): position and surface + 1,
    /// flux and packed normal, in order of bounce and photon; and how many the last bounce cut off.
    #[allow(clippy::too_many_arguments)]
    #[pyo3(signature = (normals, materials, lights, *, seed, pass_index, photons, bounces, first_hits, directions, numbered=false, aims=None, aim_nodes=None, portals=None))]
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
        directions: bool,
        numbered: bool,
        aims: Option<&Bound<'py, PyAny>>,
        aim_nodes: Option<&Bound<'py, PyAny>>,
        portals: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<(Rows<'py>, Rows<'py>, usize)> {
        let normals = array::<f32>(normals, "normals", &[Some(self.corners.len()), Some(3), Some(4)])?;
        let materials = array::<f32>(materials, "materials", &[None, Some(2), Some(4)])?;
        let lights = array::<f32>(lights, "lights", &[None, Some(4), Some(4)])?;
        let aims = given::<f32>(aims, "aims", &[Some(lights.shape()[0]), Some(4)])?;
        let aim_nodes = given::<f32>(aim_nodes, "aim_nodes", &[None, Some(4)])?;
        let portals = given::<f32>(portals, "portals", &[None, Some(3), Some(4)])?;
        let scene = paths::Scene {
            portals: portals.as_ref().map_or(Ok(&[][..]), rows::<f32, 4>)?.as_chunks().0,
            aims: aims.as_ref().map_or(Ok(&[][..]), rows)?,
            aim_nodes: aim_nodes.as_ref().map_or(Ok(&[][..]), rows)?,
            tree: &self.tree,
            corners: &self.corners,
            normals: rows::<f32, 4>(&normals)?.as_chunks().0,
            materials: rows::<f32, 4>(&materials)?.as_chunks().0,
            lights: rows::<f32, 4>(&lights)?.as_chunks().0,
        };
        let emission =
            emission::Emission { photons, seed, pass_index, bounces, first_hits, directions, numbered };
        let landed = run(py, || Ok(paths::trace_photons(&scene, &emission)))?;
        Ok((new_rows(py, landed.places)?, new_rows(py, landed.deposits)?, landed.unfinished))
    }

    /// Where photons start, and where they go to: float32[photons, 6], zeros for those that do not start. Takes
    /// what photons does.
    #[pyo3(signature = (lights, seed, pass_index, photons, aims=None, aim_nodes=None))]
    #[allow(clippy::too_many_arguments)]
    fn photon_starts<'py>(
        &self,
        py: Python<'py>,
        lights: &Bound<'py, PyAny>,
        seed: u32,
        pass_index: u32,
        photons: u32,
        aims: Option<&Bound<'py, PyAny>>,
        aim_nodes: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Rows<'py>> {
        let lights = array::<f32>(lights, "lights", &[None, Some(4), Some(4)])?;
        let aims = given::<f32>(aims, "aims", &[Some(lights.shape()[0]), Some(4)])?;
        let aim_nodes = given::<f32>(aim_nodes, "aim_nodes", &[None, Some(4)])?;
        let scene = paths::Scene {
            tree: &self.tree,
            corners: &[],
            normals: &[],
            materials: &[],
            lights: rows::<f32, 4>(&lights)?.as_chunks().0,
            aims: aims.as_ref().map_or(Ok(&[][..]), rows)?,
            aim_nodes: aim_nodes.as_ref().map_or(Ok(&[][..]), rows)?,
            portals: &[],
        };
        let of = emission::Emission { photons, seed, pass_index, ..emission::Emission::default() };
        let starts = run(py, || Ok(emission::photon_starts(&scene, &of)))?;
        new_matrix(py, starts.into_flattened().into_flattened(), 6)
    }

    /// Find where each visible point's disc ends at what stands on its surface.
    ///
    /// Takes streams float32[H, W, 4]: place (position, surface + 1; 0: no point), facing (normal) and
    /// diffuse (albedo, flags; 0: not of interest); radii, of which each is multiplied by radius_scale.
    /// Returns float32[H, W, 4]: two vectors in the plane of the disc; what has a scalar product of more
    /// than one with either is cut off. Zeros cut nothing.
    #[pyo3(signature = (place, facing, diffuse, radii, *, radius_scale))]
    fn cuts<'py>(
        &self,
        py: Python<'py>,
        place: &Bound<'py, PyAny>,
        facing: &Bound<'py, PyAny>,
        diffuse: &Bound<'py, PyAny>,
        radii: &RadiusField,
        radius_scale: f32,
    ) -> PyResult<Stream<'py>> {
        let named = [("place", place), ("facing", facing), ("diffuse", diffuse)];
        let [place, facing, diffuse] = streams(named)?;
        new_stream(py, &place, |out| {
            let (place, facing, diffuse) = (rows(&place)?, rows(&facing)?, rows(&diffuse)?);
            run(py, || {
                cuts::cuts(&self.tree, &self.corners, &radii.0, radius_scale, place, facing, diffuse, out);
                Ok(())
            })
        })
    }

    /// Estimate the share of a filter that lies on each visible point's own surface and is not cut off.
    ///
    /// Takes streams float32[H, W, 4]: pixel (column and row in the frame), place (position,
    /// surface + 1; 0: no point), facing (normal), shading (unused, leaf position of the triangle), cuts,
    /// diffuse (albedo, flags; 0: not of interest); radii, of which each is multiplied by radius_scale;
    /// filter (constant, cone, gaussian, epanechnikov); probes a point, and how many were sent before; how
    /// many more tell what is expected of the share, by which all is divided, and how much is at least; what
    /// random numbers depend on besides the pixel: seed, depth, frame_size; faces float32[K, 4], as faces_of
    /// tells them, in leaf order, or None: no triangle bounds a solid or makes a quad.
    /// Returns two float32[H, W, 4]: the filter's share, the inner filter's, and what scales either; how they
    /// are tilted.
    #[allow(clippy::too_many_arguments)]
    #[pyo3(signature = (pixel, place, facing, shading, cuts, diffuse, radii, *, radius_scale, filter, probes, first_probe, expecting, least_expected, seed, depth, frame_size, faces=None))]
    fn coverage<'py>(
        &self,
        py: Python<'py>,
        pixel: &Bound<'py, PyAny>,
        place: &Bound<'py, PyAny>,
        facing: &Bound<'py, PyAny>,
        shading: &Bound<'py, PyAny>,
        cuts: &Bound<'py, PyAny>,
        diffuse: &Bound<'py, PyAny>,
        radii: &RadiusField,
        radius_scale: f32,
        filter: &str,
        probes: u32,
        first_probe: u32,
        expecting: u32,
        least_expected: f32,
        seed: u32,
        depth: u32,
        frame_size: (usize, usize),
        faces: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<(Stream<'py>, Stream<'py>)> {
        let named = [
            ("pixel", pixel),
            ("place", place),
            ("facing", facing),
            ("shading", shading),
            ("cuts", cuts),
            ("diffuse", diffuse),
        ];
        let [pixel, place, facing, shading, cuts, diffuse] = streams(named)?;
        let probes = coverage::Probes {
            count: probes,
            radius_scale,
            filter: Filter::named(filter)?,
            first: first_probe,
            expecting,
            least_expected,
            seed,
            depth,
            frame_width: frame_size.0,
        };
        let count = self.corners.len();
        let faces = faces.map(|faces| array::<f32>(faces, "faces", &[Some(count), Some(4)])).transpose()?;
        let faces = faces.as_ref().map_or(Ok(&[][..]), rows)?;
        let points = coverage::Points {
            pixels: rows(&pixel)?,
            places: rows(&place)?,
            facings: rows(&facing)?,
            shadings: rows(&shading)?,
            diffuses: rows(&diffuse)?,
            cuts: rows(&cuts)?,
        };
        let triangles = coverage::Triangles { corners: &self.corners, faces, flags: &self.flags };
        let found = new_streams(py, &place, |[shares, tilts]| {
            run(py, || {
                coverage::coverage(&self.tree, &triangles, &radii.0, &points, &probes, shares, tilts);
                Ok(())
            })
        })?;
        Ok(found.into())
    }

    /// Follow rays that lobes send below surfaces to where they come out.
    ///
    /// Takes streams float32[H, W, 4]: pixel (column and row in the frame), origin (position, leaf position of
    /// the triangle that the ray leaves), direction (vector; zeros: no ray), throughput and walk (what a walk
    /// depends on, as glsl/lib/packed_walk.glsl has it, and 1; 0: the ray goes below no surface); what random
    /// numbers depend on besides the pixel: seed, pass_index, depth, frame_size.
    /// Returns three float32[H, W, 4]: directions, origins and throughputs of the rays that go on.
    #[allow(clippy::too_many_arguments)]
    #[pyo3(signature = (pixel, origin, direction, throughput, walk, *, seed, pass_index, depth, frame_size))]
    fn walk<'py>(
        &self,
        py: Python<'py>,
        pixel: &Bound<'py, PyAny>,
        origin: &Bound<'py, PyAny>,
        direction: &Bound<'py, PyAny>,
        throughput: &Bound<'py, PyAny>,
        walk: &Bound<'py, PyAny>,
        seed: u32,
        pass_index: u32,
        depth: u32,
        frame_size: (usize, usize),
    ) -> PyResult<(Stream<'py>, Stream<'py>, Stream<'py>)> {
        let named = [
            ("pixel", pixel),
            ("origin", origin),
            ("direction", direction),
            ("throughput", throughput),
            ("walk", walk),
        ];
        let [pixel, origin, direction, throughput, walk] = streams(named)?;
        let rays = walks::Rays {
            pixels: rows(&pixel)?,
            origins: rows(&origin)?,
            directions: rows(&direction)?,
            throughputs: rows(&throughput)?,
            walks: rows(&walk)?,
        };
        let draw = walks::Draw { seed, pass_index, depth, frame_width: frame_size.0 };
        let found = new_streams(py, &origin, |out| {
            run(py, || {
                walks::walk(&self.tree, &self.corners, &rays, draw, out);
                Ok(())
            })
        })?;
        Ok(found.into())
    }
}
