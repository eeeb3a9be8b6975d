// SPDX-License-Identifier: GPL-3.0-or-later
//! Photons in the cells of a grid.

use numpy::{AllowTypeChange, PyArray1, PyArrayLike1, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::arrays::{Stream, U32Array, array, new_stream, rows, streams};
use super::radius_field::RadiusField;
use super::run;
use crate::filter::Filter;
use crate::{density, photon_map, photons};

/// A pass's photons in the cells of a grid, for gathering.
///
/// PhotonMap(place, deposit, origin, cell_size, cells, directions=False): place float32[P, 4] (position, surface + 1),
/// deposit float32[P, 4] (flux, packed normal; with directions the flux carries that to the
/// light); the grid as for sort_photons, which says what is
/// refused.
#[pyclass(frozen, module = "photon_stream_native")]
pub(super) struct PhotonMap(photon_map::PhotonMap);

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
        Ok(PhotonMap(run(py, || photon_map::PhotonMap::new(place, deposit, grid, directions))?))
    }

    /// Sum the photons around each visible point.
    ///
    /// Takes points, the streams float32[H, W, 4] place (position, surface + 1; 0: no point), facing
    /// (normal, unused), cuts, coverage and tilt; radii, of which each is multiplied by radius_scale; filter
    /// (constant, cone, gaussian, epanechnikov); where normals are bent, shading (normal, unused) and base (normal
    /// of the smooth surface; 1: the normal is bent), of a map with directions. Returns float32[H, W, 4]:
    /// irradiance in three channels, and their mean within the inner radius; zeros where no photon can be.
    #[pyo3(signature = (points, radii, radius_scale, filter, bent=None))]
    fn gather<'py>(
        &self,
        py: Python<'py>,
        points: [Bound<'py, PyAny>; 5],
        radii: &RadiusField,
        radius_scale: f32,
        filter: &str,
        bent: Option<[Bound<'py, PyAny>; 2]>,
    ) -> PyResult<Stream<'py>> {
        let given = self.given(&points, bent)?;
        let points = given.points()?;
        let discs = density::Discs { radii: &radii.0, radius_scale, filter: Filter::named(filter)? };
        new_stream(py, given.place(), |out| {
            run(py, || {
                density::gather(&self.0, &points, &discs, out);
                Ok(())
            })
        })
    }

    /// The same for points with other lobes, of a map with directions.
    ///
    /// Takes besides the streams of lobes; see layouts.rs. Of Phong's: Gathered, PlainLobe, PlainPeak. Of
    /// microfacets: Gathered, RayDirection, and Scaled, Based and Dipped of each of two. Returns the irradiance
    /// and, alike, the radiance that lobes reflect.
    #[allow(clippy::too_many_arguments)]
    #[pyo3(signature = (points, lobes, radii, radius_scale, filter, bent=None))]
    fn gather_lobes<'py>(
        &self,
        py: Python<'py>,
        points: [Bound<'py, PyAny>; 5],
        lobes: Vec<Bound<'py, PyAny>>,
        radii: &RadiusField,
        radius_scale: f32,
        filter: &str,
        bent: Option<[Bound<'py, PyAny>; 2]>,
    ) -> PyResult<(Stream<'py>, Stream<'py>)> {
        self.check_directions()?;
        let given = self.given(&points, bent)?;
        let lobes =
            lobes.iter().map(|lobe| beside(given.place(), lobe, "lobes")).collect::<PyResult<Vec<_>>>()?;
        let (points, lobes) = (given.points()?, lobes_of(&lobes)?);
        let discs = density::Discs { radii: &radii.0, radius_scale, filter: Filter::named(filter)? };
        let mut irradiance = None;
        let reflected = new_stream(py, given.place(), |reflected| {
            irradiance = Some(new_stream(py, given.place(), |out| {
                run(py, || {
                    density::gather_lobes(&self.0, &points, &lobes, &discs, out, reflected);
                    Ok(())
                })
            })?);
            Ok(())
        })?;
        Ok((irradiance.expect("made with the other"), reflected))
    }
}

type Array<'py> = PyReadonlyArrayDyn<'py, f32>;

/// Streams of points: place, facing, cuts, coverage and tilt; Shading and Base, where normals are bent.
struct Given<'py>([Array<'py>; 5], Option<[Array<'py>; 2]>);

impl<'py> Given<'py> {
    fn place(&self) -> &Array<'py> {
        &self.0[0]
    }

    fn points(&self) -> PyResult<density::Points<'_>> {
        let [place, facing, cuts, coverage, tilt] = &self.0;
        let bent = self.1.as_ref();
        Ok(density::Points {
            places: rows(place)?,
            facings: rows(facing)?,
            cuts: rows(cuts)?,
            coverages: rows(coverage)?,
            tilts: rows(tilt)?,
            bent: bent.map(|[shading, base]| Ok::<_, PyErr>([rows(shading)?, rows(base)?])).transpose()?,
        })
    }
}

/// A stream of a point's size.
fn beside<'py>(place: &Array<'py>, object: &Bound<'py, PyAny>, name: &str) -> PyResult<Array<'py>> {
    array(object, name, &[Some(place.shape()[0]), Some(place.shape()[1]), Some(4)])
}

fn lobes_of<'a>(lobes: &'a [Array]) -> PyResult<density::Lobes<'a>> {
    let lobes = lobes.iter().map(rows).collect::<PyResult<Vec<_>>>()?;
    if let Ok(phong) = lobes.as_slice().try_into() {
        return Ok(density::Lobes::Phong(phong));
    }
    let of_microfacets = lobes
        .as_slice()
        .try_into()
        .map_err(|_| PyValueError::new_err(format!("lobes: expected 3 or 8 streams, got {}", lobes.len())))?;
    Ok(density::Lobes::Microfacets(of_microfacets))
}

impl PhotonMap {
    fn check_directions(&self) -> PyResult<()> {
        if self.0.has_directions() {
            return Ok(());
        }
        Err(PyValueError::new_err("the photons of this map have no directions"))
    }

    fn given<'py>(
        &self,
        points: &[Bound<'py, PyAny>; 5],
        bent: Option<[Bound<'py, PyAny>; 2]>,
    ) -> PyResult<Given<'py>> {
        let [place, facing, cuts, coverage, tilt] = points;
        let points = streams([
            ("place", place),
            ("facing", facing),
            ("cuts", cuts),
            ("coverage", coverage),
            ("tilt", tilt),
        ])?;
        let Some([shading, base]) = bent else { return Ok(Given(points, None)) };
        self.check_directions()?;
        let bent = [beside(&points[0], &shading, "shading")?, beside(&points[0], &base, "base")?];
        Ok(Given(points, Some(bent)))
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
