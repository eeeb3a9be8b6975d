// SPDX-License-Identifier: GPL-3.0-or-later
//! How much photons count for a point, as in glsl/lib/density.glsl.

use std::f32::consts::PI;

use crate::InvalidInput;
use crate::lanes::{Lanes, Row};

/// Photons of a surface that bends away by more than 45 degrees say nothing about a point.
#[allow(clippy::approx_constant)] // the very number that the GLSL has
pub(crate) const SAME_ORIENTATION: f32 = 0.7071;
/// Nor do those of what lies above the point or below it, as nothing does that bends less; to what positions are
/// rounded [scene units^2].
pub(crate) const ROUNDED2: f32 = 1.0e-10;
/// Area of the inner disc over the disc's.
pub(crate) const INNER_AREA: f32 = 0.5;
const GAUSSIAN_BETA: f32 = 2.0;
const GAUSSIAN_TERMS: u32 = 12; // of a series

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Filter {
    Constant,
    Cone,
    Gaussian,
    Epanechnikov,
}

impl Filter {
    /// # Errors
    /// A name that is none of the four.
    pub fn named(name: &str) -> Result<Filter, InvalidInput> {
        match name {
            "constant" => Ok(Filter::Constant),
            "cone" => Ok(Filter::Cone),
            "gaussian" => Ok(Filter::Gaussian),
            "epanechnikov" => Ok(Filter::Epanechnikov),
            _ => Err(InvalidInput(format!(
                "filter = {name:?} is none of constant, cone, gaussian, epanechnikov"
            ))),
        }
    }

    /// The filter of radius^2 `r2` at the middle of its disc [1 / area].
    pub(crate) fn peak(self, r2: f32) -> f32 {
        let gaussian = GAUSSIAN_BETA / (1.0 - (-GAUSSIAN_BETA).exp());
        let scale = match self {
            Filter::Constant => 1.0,
            Filter::Cone => 3.0,
            Filter::Gaussian => gaussian,
            Filter::Epanechnikov => 2.0,
        };
        scale / (PI * r2)
    }

    /// The filter at (distance / radius)^2 = x2 <= 1, over its peak.
    pub(crate) fn shape(self, x2: f32) -> f32 {
        match self {
            Filter::Constant => 1.0,
            Filter::Cone => (1.0 - x2.sqrt()).max(0.0),
            Filter::Gaussian => (-GAUSSIAN_BETA * x2).exp(),
            Filter::Epanechnikov => (1.0 - x2).max(0.0),
        }
    }

    /// The share of the filter's mass within (distance / radius)^2 = x2 <= 1.
    pub(crate) fn mass_within(self, x2: f32) -> f32 {
        match self {
            Filter::Constant => x2,
            Filter::Cone => x2 * (3.0 - 2.0 * x2.sqrt()),
            Filter::Gaussian => (1.0 - (-GAUSSIAN_BETA * x2).exp()) / (1.0 - (-GAUSSIAN_BETA).exp()),
            Filter::Epanechnikov => x2 * (2.0 - x2),
        }
    }

    /// The integrals of the filter, times distance / radius, times its square, within x2 <= 1.
    pub(crate) fn moments_within(self, x2: f32) -> [f32; 3] {
        let x = x2.sqrt();
        let mass = self.mass_within(x2);
        let (first, second) = match self {
            Filter::Constant => (2.0 / 3.0 * x * x2, 0.5 * x2 * x2),
            Filter::Cone => (x * x2 * (2.0 - 1.5 * x), x2 * x2 * (1.5 - 1.2 * x)),
            Filter::Gaussian => {
                let y = GAUSSIAN_BETA * x2;
                let peak = 2.0 * GAUSSIAN_BETA / (1.0 - (-GAUSSIAN_BETA).exp());
                (peak * x * x2 * gaussian_first(y), peak * x2 * x2 * gaussian_second(y))
            }
            Filter::Epanechnikov => (x * x2 * (4.0 / 3.0 - 0.8 * x2), x2 * x2 * (1.0 - 2.0 / 3.0 * x2)),
        };
        [mass, first, second]
    }

    /// The filter at x2, and the one of the inner disc, both over the filter's peak.
    pub(crate) fn shape_and_inner(self, x2: f32) -> [f32; 2] {
        let inner = if x2 > INNER_AREA { 0.0 } else { self.shape(x2 / INNER_AREA) / INNER_AREA };
        [self.shape(x2), inner]
    }

    #[inline(always)]
    pub(crate) fn shapes<L: Lanes>(self, x2: L) -> L {
        match self {
            Filter::Constant => L::splat(1.0),
            Filter::Cone => (L::splat(1.0) - x2.sqrt()).max(L::splat(0.0)),
            Filter::Gaussian => L::load(&Row(x2.store().0.map(|x2| self.shape(x2)))),
            Filter::Epanechnikov => (L::splat(1.0) - x2).max(L::splat(0.0)),
        }
    }

    /// (distance / radius)^2 in [0, 1] distributed as the filter's mass over the disc.
    pub(crate) fn sample(self, u: f32) -> f32 {
        match self {
            Filter::Constant => u,
            Filter::Cone => (0.5 - ((1.0 - 2.0 * u).asin() / 3.0).sin()).powi(2),
            Filter::Gaussian => -(1.0 - u * (1.0 - (-GAUSSIAN_BETA).exp())).ln() / GAUSSIAN_BETA,
            Filter::Epanechnikov => 1.0 - (1.0 - u).sqrt(),
        }
    }
}

/// The integral of t^2 exp(-y t^2) from 0 to 1, for 0 <= y <= 2 to 1e-6: a series, as glsl/lib/density.glsl has it.
fn gaussian_first(y: f32) -> f32 {
    (0..GAUSSIAN_TERMS)
        .fold((0.0, 1.0), |(sum, term), k| (sum + term / (2 * k + 3) as f32, -term * y / (k + 1) as f32))
        .0
}

/// The same of t^3.
fn gaussian_second(y: f32) -> f32 {
    (0..GAUSSIAN_TERMS)
        .fold((0.0, 1.0), |(sum, term), k| (sum + term / (2 * k + 4) as f32, -term * y / (k + 1) as f32))
        .0
}
