// SPDX-License-Identifier: GPL-3.0-or-later
//! How much of a picture is denoised.

use numpy::{PyArray1, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;

use super::arrays::{Rows, Stream, array, rows};
use super::run;
use crate::mixture::{Halves, Measure, box_mean as mean_about, mix, split};

/// The mean over the square of `reach` pixels around each of image float32[h, w], as far as there are.
#[pyfunction]
pub(super) fn box_mean<'py>(py: Python<'py>, image: &Bound<'py, PyAny>, reach: usize) -> PyResult<Rows<'py>> {
    let image = array::<f32>(image, "image", &[None, None])?;
    let (width, pixels) = (image.shape()[1], image.as_slice()?);
    let means =
        run(py, || Ok(if pixels.is_empty() { Vec::new() } else { mean_about(pixels, width, reach) }))?;
    PyArray1::from_vec(py, means).reshape([image.shape()[0], width])
}

/// Both halves of a picture as a denoiser is given them: float32[h, w, 3] each, in units of a light, without what is
/// below zero.
///
/// Takes float32[h, w, 3]: plain, the picture; half, the mean of the first half of its passes, which are this share
/// of all. Raises ValueError for images of other sizes.
#[pyfunction]
pub(super) fn split_halves<'py>(
    py: Python<'py>,
    plain: &Bound<'py, PyAny>,
    half: &Bound<'py, PyAny>,
    share: f32,
    unit: f32,
) -> PyResult<(Stream<'py>, Stream<'py>)> {
    let plain = array::<f32>(plain, "plain", &[None, None, Some(3)])?;
    let (height, width) = (plain.shape()[0], plain.shape()[1]);
    let half = array::<f32>(half, "half", &[Some(height), Some(width), Some(3)])?;
    let (of_plain, of_half) = (rows(&plain)?, rows(&half)?);
    let [first, other] = run(py, || split(of_plain, of_half, share, unit))?;
    let image =
        |pixels: Vec<[f32; 3]>| PyArray1::from_vec(py, pixels.into_flattened()).reshape([height, width, 3]);
    Ok((image(first)?, image(other)?))
}

/// A picture mixed with what a denoiser makes of its halves, as far as these tell that it is better.
///
/// Takes float32[h, w, 3]: plain, the picture; half, the mean of the first half of its passes, which are this share
/// of all; clean, what the denoiser makes of that; other_clean, of the other half, both in units of a light. reach:
/// pixels on each side over which errors are averaged; dark: what of the mean counts as dark. Returns the mixture
/// float32[h, w, 3], and how much of the squared noise is left in each pixel, float32[h, w], 0 to 1. Raises ValueError
/// for images of other sizes.
#[pyfunction]
#[pyo3(signature = (plain, half, share, clean, other_clean, *, unit, reach, dark))]
#[allow(clippy::too_many_arguments)]
pub(super) fn mix_halves<'py>(
    py: Python<'py>,
    plain: &Bound<'py, PyAny>,
    half: &Bound<'py, PyAny>,
    share: f32,
    clean: &Bound<'py, PyAny>,
    other_clean: &Bound<'py, PyAny>,
    unit: f32,
    reach: usize,
    dark: f64,
) -> PyResult<(Stream<'py>, Rows<'py>)> {
    let plain = array::<f32>(plain, "plain", &[None, None, Some(3)])?;
    let (height, width) = (plain.shape()[0], plain.shape()[1]);
    let shape = [Some(height), Some(width), Some(3)];
    let half = array::<f32>(half, "half", &shape)?;
    let clean = array::<f32>(clean, "clean", &shape)?;
    let other_clean = array::<f32>(other_clean, "other_clean", &shape)?;
    let halves = Halves {
        plain: rows(&plain)?,
        half: rows(&half)?,
        share,
        clean: rows(&clean)?,
        other_clean: rows(&other_clean)?,
        width,
        unit,
    };
    let (picture, left) = run(py, || mix(&halves, &Measure { reach, dark }))?;
    let picture = PyArray1::from_vec(py, picture.into_flattened()).reshape([height, width, 3])?;
    Ok((picture, PyArray1::from_vec(py, left).reshape([height, width])?))
}
