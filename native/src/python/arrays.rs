// SPDX-License-Identifier: GPL-3.0-or-later
//! Numpy arrays: checked as arguments, made as results.

use numpy::{
    Element, PyArray1, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArray,
    PyUntypedArrayMethods,
};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

use crate::watertight::Hit;

pub(super) type Stream<'py> = Bound<'py, PyArray3<f32>>;
pub(super) type Rows<'py> = Bound<'py, PyArray2<f32>>;

pub(super) type F32Array<'py> = Bound<'py, PyArray1<f32>>;
pub(super) type I32Array<'py> = Bound<'py, PyArray1<i32>>;
pub(super) type U32Array<'py> = Bound<'py, PyArray1<u32>>;
pub(super) type I64Array<'py> = Bound<'py, PyArray1<i64>>;

/// Streams float32[H, W, 4] of one size.
pub(super) fn streams<'py, const N: usize>(
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
pub(super) fn new_matrix(py: Python, values: Vec<f32>, columns: usize) -> PyResult<Rows> {
    let shape = [values.len() / columns, columns];
    PyArray1::from_vec(py, values).reshape(shape)
}

pub(super) fn new_rows(py: Python, rows: Vec<[f32; 4]>) -> PyResult<Rows> {
    new_matrix(py, rows.into_flattened(), 4)
}

/// A hit as streams have it: t, leaf position + 1, u, v; zeros for a miss.
pub(super) fn record_of(hit: Option<(i32, Hit)>) -> [f32; 4] {
    hit.map_or([0.0; 4], |(position, hit)| [hit.t, (position + 1) as f32, hit.u, hit.v])
}

/// A stream of another's size, filled by `fill`.
pub(super) fn new_stream<'py>(
    py: Python<'py>,
    like: &PyReadonlyArrayDyn<'py, f32>,
    fill: impl FnOnce(&mut [[f32; 4]]) -> PyResult<()>,
) -> PyResult<Stream<'py>> {
    new_streams(py, like, |[out]| fill(out)).map(|[stream]| stream)
}

/// Several streams of another's size, filled by `fill`.
pub(super) fn new_streams<'py, const N: usize>(
    py: Python<'py>,
    like: &PyReadonlyArrayDyn<'py, f32>,
    fill: impl FnOnce([&mut [[f32; 4]]; N]) -> PyResult<()>,
) -> PyResult<[Stream<'py>; N]> {
    let (height, width) = (like.shape()[0], like.shape()[1]);
    let mut all: [Vec<[f32; 4]>; N] = std::array::from_fn(|_| vec![[0.0; 4]; height * width]);
    fill(all.each_mut().map(Vec::as_mut_slice))?;
    let made = all.map(|one| PyArray1::from_vec(py, one.into_flattened()).reshape([height, width, 4]));
    let made: Vec<Stream> = made.into_iter().collect::<PyResult<_>>()?;
    Ok(made.try_into().expect("as many as there were"))
}

/// A C-contiguous array of one type and shape (None: any number of rows), or an error naming it.
pub(super) fn array<'py, T: Element>(
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

/// The same of what may be left out.
pub(super) fn given<'py, T: Element>(
    object: Option<&Bound<'py, PyAny>>,
    name: &str,
    shape: &[Option<usize>],
) -> PyResult<Option<PyReadonlyArrayDyn<'py, T>>> {
    object.map(|object| array(object, name, shape)).transpose()
}

pub(super) fn rows<'a, T: Element, const N: usize>(
    array: &'a PyReadonlyArrayDyn<T>,
) -> PyResult<&'a [[T; N]]> {
    Ok(array.as_slice()?.as_chunks::<N>().0)
}
