// SPDX-License-Identifier: GPL-3.0-or-later
//! Photons in the cells of a grid.

use numpy::{AllowTypeChange, PyArray1, PyArrayLike1, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::arrays::{Stream, U32Array, array, new_stream, rows, streams};
use super::radius_field::RadiusField;
use super::run;
use crate::filter::Filter;
use crate::{density, photons};

/// A pass's photons in the cells of a grid, for gathering.
///
/// PhotonMap(place, deposit, origin, cell_size, cells, directions=False): place float32[P, 4] (position, surface + 1),
/// deposit float32[P, 4] (flux, packed normal; with directions the flux carries that to the
/// light); the grid as for sort_photons, which says what is
/// refused.
#[pyclass(frozen, module = "photon_stream_native")]
pub(super) struct PhotonMap(density::PhotonMap);

#[pymethods]
impl PhotonMap {
    #[new]
    #[pyo3(signature = (place, deposit, origin, cell_size, cells, directions=false))]
    fn new(
        py: Python,
        place: &Bound<PyAny>,
        deposit: &Bound<PyAny>,
        origin: [f32; 3],
        cell_size: f32,
        cells: [usize; 3],
        directions: bool,
    ) -> PyResult<PhotonMap> {
        let place = array::<f32>(place, "place", &[None, Some(4)])?;
        let deposit = array::<f32>(deposit, "deposit", &[None, Some(4)])?;
        let (place, deposit) = (rows(&place)?, rows(&deposit)?);
        let grid = photons::Grid { origin, cell_size, cells };
        Ok(PhotonMap(run(py, || density::PhotonMap::new(place, deposit, grid, directions))?))
    }

    /// Sum the photons around each visible point.
    ///
    /// Takes streams float32[H, W, 4]: place (position, surface + 1; 0: no point), facing
    /// (normal, unused), cuts, coverage and tilt; radii, of which each is multiplied by radius_scale; filter
    /// (constant, cone, gaussian, epanechnikov); where normals are bent, shading (normal, unused) and base (normal
    /// of the smooth surface; 1: the normal is bent), of a map with directions. Returns float32[H, W, 4]:
    /// irradiance in three channels, and their mean within the inner radius; zeros where no photon can be.
    #[allow(clippy::too_many_arguments)]
    #[pyo3(signature = (place, facing, cuts, coverage, tilt, radii, radius_scale, filter, bent=None))]
    fn gather<'py>(
        &self,
        py: Python<'py>,
        place: &Bound<'py, PyAny>,
        facing: &Bound<'py, PyAny>,
        cuts: &Bound<'py, PyAny>,
        coverage: &Bound<'py, PyAny>,
        tilt: &Bound<'py, PyAny>,
        radii: &RadiusField,
        radius_scale: f32,
        filter: &str,
        bent: Option<[Bound<'py, PyAny>; 2]>,
    ) -> PyResult<Stream<'py>> {
        let [place, facing, cuts, coverage, tilt] = streams([
            ("place", place),
            ("facing", facing),
            ("cuts", cuts),
            ("coverage", coverage),
            ("tilt", tilt),
        ])?;
        let bent = self.bent(&place, bent)?;
        let points = points_of([&place, &facing, &cuts, &coverage, &tilt], bent.as_ref())?;
        let discs = density::Discs { radii: &radii.0, radius_scale, filter: Filter::named(filter)? };
        new_stream(py, &place, |out| {
            run(py, || {
                self.0.gather(&points, &discs, out);
                Ok(())
            })
        })
    }

    /// The same for points with Phong's lobes, of a map with directions.
    ///
    /// Takes besides the streams gathered (normal of the lobe, albedo; 0: no lobe), lobe (mirrored direction,
    /// exponent) and peak (BSDF there). Returns the irradiance and, alike, the radiance that lobes send on.
    #[allow(clippy::too_many_arguments)]
    #[pyo3(signature = (place, facing, cuts, coverage, tilt, gathered, lobe, peak, radii, radius_scale, filter, bent=None))]
    fn gather_gloss<'py>(
        &self,
        py: Python<'py>,
        place: &Bound<'py, PyAny>,
        facing: &Bound<'py, PyAny>,
        cuts: &Bound<'py, PyAny>,
        coverage: &Bound<'py, PyAny>,
        tilt: &Bound<'py, PyAny>,
        gathered: &Bound<'py, PyAny>,
        lobe: &Bound<'py, PyAny>,
        peak: &Bound<'py, PyAny>,
        radii: &RadiusField,
        radius_scale: f32,
        filter: &str,
        bent: Option<[Bound<'py, PyAny>; 2]>,
    ) -> PyResult<(Stream<'py>, Stream<'py>)> {
        let [place, facing, cuts, coverage, tilt, gathered, lobe, peak] = streams([
            ("place", place),
            ("facing", facing),
            ("cuts", cuts),
            ("coverage", coverage),
            ("tilt", tilt),
            ("gathered", gathered),
            ("lobe", lobe),
            ("peak", peak),
        ])?;
        let bent = self.bent(&place, bent)?;
        let points = points_of([&place, &facing, &cuts, &coverage, &tilt], bent.as_ref())?;
        let lobes = density::Lobes::Phong([rows(&gathered)?, rows(&lobe)?, rows(&peak)?]);
        let discs = density::Discs { radii: &radii.0, radius_scale, filter: Filter::named(filter)? };
        self.lobes_gather(py, &place, &points, &lobes, &discs)
    }

    /// The same with microfacets. Takes besides the streams gathered (normal of the lobes, albedo; 0: no lobe),
    /// direction (of the viewer's ray), and scaled, based and dipped of each of two lobes: see layouts.rs.
    #[allow(clippy::too_many_arguments)]
    #[pyo3(signature = (place, facing, cuts, coverage, tilt, gathered, direction, lobes, radii, radius_scale, filter, bent=None))]
    fn gather_microfacets<'py>(
        &self,
        py: Python<'py>,
        place: &Bound<'py, PyAny>,
        facing: &Bound<'py, PyAny>,
        cuts: &Bound<'py, PyAny>,
        coverage: &Bound<'py, PyAny>,
        tilt: &Bound<'py, PyAny>,
        gathered: &Bound<'py, PyAny>,
        direction: &Bound<'py, PyAny>,
        lobes: [Bound<'py, PyAny>; 6],
        radii: &RadiusField,
        radius_scale: f32,
        filter: &str,
        bent: Option<[Bound<'py, PyAny>; 2]>,
    ) -> PyResult<(Stream<'py>, Stream<'py>)> {
        let [a, b, c, d, e, f] = &lobes;
        let [place, facing, cuts, coverage, tilt, gathered, direction, a, b, c, d, e, f] = streams([
            ("place", place),
            ("facing", facing),
            ("cuts", cuts),
            ("coverage", coverage),
            ("tilt", tilt),
            ("gathered", gathered),
            ("direction", direction),
            ("scaled0", a),
            ("based0", b),
            ("dipped0", c),
            ("scaled1", d),
            ("based1", e),
            ("dipped1", f),
        ])?;
        let bent = self.bent(&place, bent)?;
        let points = points_of([&place, &facing, &cuts, &coverage, &tilt], bent.as_ref())?;
        let lobes = density::Lobes::Microfacets([
            rows(&gathered)?,
            rows(&direction)?,
            rows(&a)?,
            rows(&b)?,
            rows(&c)?,
            rows(&d)?,
            rows(&e)?,
            rows(&f)?,
        ]);
        let discs = density::Discs { radii: &radii.0, radius_scale, filter: Filter::named(filter)? };
        self.lobes_gather(py, &place, &points, &lobes, &discs)
    }
}

/// Shading and Base of the points, where normals are bent.
type BentArrays<'py> = [PyReadonlyArrayDyn<'py, f32>; 2];

/// Of place, facing, cuts, coverage and tilt.
fn points_of<'a>(
    arrays: [&'a PyReadonlyArrayDyn<f32>; 5],
    bent: Option<&'a BentArrays>,
) -> PyResult<density::Points<'a>> {
    let [place, facing, cuts, coverage, tilt] = arrays;
    let bent = bent.map(|[shading, base]| Ok::<_, PyErr>([rows(shading)?, rows(base)?])).transpose()?;
    Ok(density::Points {
        places: rows(place)?,
        facings: rows(facing)?,
        cuts: rows(cuts)?,
        coverages: rows(coverage)?,
        tilts: rows(tilt)?,
        bent,
    })
}

impl PhotonMap {
    fn check_directions(&self) -> PyResult<()> {
        if self.0.has_directions() {
            return Ok(());
        }
        Err(PyValueError::new_err("the photons of this map have no directions"))
    }

    fn bent<'py>(
        &self,
        place: &PyReadonlyArrayDyn<'py, f32>,
        bent: Option<[Bound<'py, PyAny>; 2]>,
    ) -> PyResult<Option<BentArrays<'py>>> {
        let Some([shading, base]) = bent else { return Ok(None) };
        self.check_directions()?;
        let place: &Bound<PyAny> = place.as_any();
        let [_, shading, base] = streams([("place", place), ("shading", &shading), ("base", &base)])?;
        Ok(Some([shading, base]))
    }

    fn lobes_gather<'py>(
        &self,
        py: Python<'py>,
        place: &PyReadonlyArrayDyn<'py, f32>,
        points: &density::Points,
        lobes: &density::Lobes,
        discs: &density::Discs,
    ) -> PyResult<(Stream<'py>, Stream<'py>)> {
        self.check_directions()?;
        let mut irradiance = None;
        let gloss = new_stream(py, place, |gloss| {
            irradiance = Some(new_stream(py, place, |out| {
                run(py, || {
                    self.0.gather_gloss(points, lobes, discs, out, gloss);
                    Ok(())
                })
            })?);
            Ok(())
        })?;
        Ok((irradiance.expect("made with the gloss"), gloss))
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
pub(super) fn sort_photons<'py>(
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
