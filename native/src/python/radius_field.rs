// SPDX-License-Identifier: GPL-3.0-or-later
//! Gather radii, and the grids that they are told over.

use numpy::PyArray1;
use pyo3::prelude::*;

use super::arrays::{F32Array, Rows, array, new_matrix, rows};
use super::run;
use crate::radius;

/// The grids over which a RadiusField tells radii, one for each side of surfaces (+x, -x, +y, -y, +z, -z).
///
/// Takes a sample float32[S, 4] of the photons: positions, and packed normals of the surfaces. Returns
/// (float32[6, 16], each row four texels as glsl/lib/radius_grid.glsl reads them; the area of the box about
/// most photons).
///
/// Raises ValueError for a position that is not finite.
#[pyfunction]
pub(super) fn radius_grids<'py>(py: Python<'py>, sample: &Bound<'py, PyAny>) -> PyResult<(Rows<'py>, f32)> {
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
pub(super) fn radius_grids_about<'py>(
    py: Python<'py>,
    boxes: &Bound<'py, PyAny>,
) -> PyResult<(Rows<'py>, f32)> {
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
pub(super) struct RadiusField(pub(super) radius::RadiusField);

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
