// SPDX-License-Identifier: GPL-3.0-or-later
//! A picture mixed with what a denoiser makes of its halves, as far as these tell that it is better.
//!
//! What is made of one half is independent of the noise of the other: so the halves tell the squared error of the
//! plain picture, of the denoised one and of any mixture of both, but for what both have in common, such as blur.

use rayon::prelude::*;

use crate::InvalidInput;

type Colour = [f32; 3];

/// Of what is told to speak for the plain picture, so many standard errors count as chance.
const SURE: f32 = 3.0;
/// Where denoising gains less than this share of how far it moves the picture, less counts as chance.
const LEAST_GAIN: f32 = 0.25;
const ROWS: usize = 16; // that one task adds up

/// A picture of rows of `width` pixels.
#[derive(Clone, Copy)]
pub struct Halves<'a> {
    pub plain: &'a [Colour],
    /// The mean of the first half of its passes, and which share of all passes those are, in (0, 1).
    pub half: &'a [Colour],
    pub share: f32,
    /// What a denoiser makes of the first half, and of the other.
    pub clean: &'a [Colour],
    pub other_clean: &'a [Colour],
    pub width: usize,
    /// What these two are in units of.
    pub unit: f32,
}

/// Both halves in units of a light, without what is below zero: as a denoiser is given them.
///
/// # Errors
/// As [`mix`], of what it takes.
pub fn split(
    plain: &[Colour],
    half: &[Colour],
    share: f32,
    unit: f32,
) -> Result<[Vec<Colour>; 2], InvalidInput> {
    check(plain, &[("half", half)], share, unit)?;
    let given = |light: Colour| light.map(|x| x.max(0.0) / unit);
    let first = half.par_iter().map(|&half| given(half)).collect();
    let other = plain
        .par_iter()
        .zip(half)
        .map(|(plain, half)| given(std::array::from_fn(|k| (plain[k] - share * half[k]) / (1.0 - share))));
    Ok([first, other.collect()])
}

/// Whether images have the size of the plain one, and numbers make sense.
fn check(plain: &[Colour], images: &[(&str, &[Colour])], share: f32, unit: f32) -> Result<(), InvalidInput> {
    for (name, image) in images {
        if image.len() != plain.len() {
            let (have, want) = (image.len(), plain.len());
            return Err(InvalidInput(format!("{name} has {have} pixels, but plain has {want}")));
        }
    }
    if !(share > 0.0 && share < 1.0) {
        return Err(InvalidInput(format!("share = {share} is not between 0 and 1")));
    }
    if !(unit > 0.0 && unit.is_finite()) {
        return Err(InvalidInput(format!("unit = {unit} is no light")));
    }
    Ok(())
}

/// Over how many pixels to each side errors are averaged, and what of the mean counts as dark.
#[derive(Clone, Copy)]
pub struct Measure {
    pub reach: usize,
    pub dark: f64,
}

/// The mixture, and of each pixel how much of the squared noise is left, 0 to 1.
///
/// # Errors
/// Names what has another size than the plain picture, or a share that is none.
pub fn mix(halves: &Halves, measure: &Measure) -> Result<(Vec<Colour>, Vec<f32>), InvalidInput> {
    halves.check()?;
    let (width, height) = (halves.width, halves.plain.len() / halves.width);
    let mean = |image: &[f32]| box_mean(image, width, measure.reach);
    let [noise, gained, apart, of_plain] = halves.told(measure);
    let squares: Vec<f32> = of_plain.par_iter().map(|x| (x * x).min(f32::MAX)).collect();
    let [noise, gained, apart, of_plain, squares] =
        [noise, gained, apart, of_plain, squares].map(|x| mean(&x));
    // How much of the plain picture is kept by what speaks for it, less what may be chance.
    let kept = of_plain.par_iter().enumerate().map(|(i, &of_plain)| {
        let sure = over(gained[i], noise[i]).clamp(0.0, 1.0);
        let sure = sure * (over(gained[i], apart[i]) / LEAST_GAIN).clamp(0.0, 1.0);
        let pixels = within(i % width, width, measure.reach) * within(i / width, height, measure.reach);
        let error = SURE * sure * ((squares[i] - of_plain * of_plain).max(0.0) / pixels as f32).sqrt();
        if apart[i] > 0.0 { (shrunk(of_plain, error) / apart[i]).clamp(0.0, 1.0) } else { 1.0 }
    });
    let kept = mean(&kept.collect::<Vec<f32>>());
    let picture = kept.par_iter().enumerate().map(|(i, &kept)| {
        let (plain, smooth) = (halves.plain[i], halves.smooth(i));
        std::array::from_fn(|k| kept * plain[k] + (1.0 - kept) * smooth[k])
    });
    // The plain picture moved by w towards the other has the error noise - 2 w gained + w^2 apart.
    let left = kept.par_iter().enumerate().map(|(i, &kept)| {
        let moved = 1.0 - kept;
        noise[i] - moved * (2.0 * gained[i] - moved * apart[i])
    });
    // Once more: one by one they are uncertain, and none is less than nothing.
    let [left, noise] = [left.collect(), noise].map(|x: Vec<f32>| mean(&x));
    let share = |(left, noise): (&f32, &f32)| if *noise > 0.0 { (left / noise).clamp(0.0, 1.0) } else { 1.0 };
    Ok((picture.collect(), left.par_iter().zip(&noise).map(share).collect()))
}

impl Halves<'_> {
    fn check(&self) -> Result<(), InvalidInput> {
        if self.plain.is_empty() || !self.plain.len().is_multiple_of(self.width) {
            let (pixels, width) = (self.plain.len(), self.width);
            return Err(InvalidInput(format!("plain has {pixels} pixels, which are no rows of {width}")));
        }
        let images = [("half", self.half), ("clean", self.clean), ("other_clean", self.other_clean)];
        check(self.plain, &images, self.share, self.unit)
    }

    /// What the denoiser makes of both halves together.
    #[inline(always)]
    fn smooth(&self, at: usize) -> Colour {
        let (one, other) = (self.clean[at], self.other_clean[at]);
        std::array::from_fn(|k| self.unit * (self.share * one[k] + (1.0 - self.share) * other[k]))
    }

    /// Of each pixel, relative to the denoised picture: by its own value a bright speck would count for little. The
    /// variance of the plain mean; that, less its covariance with the denoised one's error; the squared distance
    /// of both; and what of that speaks for the plain one.
    fn told(&self, measure: &Measure) -> [Vec<f32>; 4] {
        let (share, rest) = (f64::from(self.share), 1.0 - f64::from(self.share));
        let floor = measure.dark * self.mean();
        let of = |at: usize| {
            let (plain, half, smooth) = (self.plain[at], self.half[at], self.smooth(at));
            let (mut noise, mut gained, mut apart) = (0.0, 0.0, 0.0);
            for k in 0..3 {
                let [plain, half, smooth] = [plain[k], half[k], smooth[k]].map(f64::from);
                let scale = 1.0 / (smooth * smooth + floor * floor);
                let between = (half - plain) / rest; // of the halves
                let clean_between = f64::from(self.clean[at][k]) - f64::from(self.other_clean[at][k]);
                let clean_between = f64::from(self.unit) * clean_between;
                noise += share * rest * between * between * scale;
                gained += share * rest * between * (between - clean_between) * scale;
                apart += (smooth - plain) * (smooth - plain) * scale;
            }
            [noise, gained, apart, apart - gained].map(|x| (x / 3.0) as f32)
        };
        let found: Vec<[f32; 4]> = (0..self.plain.len()).into_par_iter().map(of).collect();
        std::array::from_fn(|k| found.par_iter().map(|x| x[k]).collect())
    }

    /// The denoised picture's mean, or 1 if that is black.
    fn mean(&self) -> f64 {
        let of_row = |row: usize| -> f64 {
            let pixels = row * self.width..(row + 1) * self.width;
            pixels.map(|at| self.smooth(at).into_iter().map(f64::from).sum::<f64>()).sum()
        };
        // Rows in their order: floats do not add up in any.
        let sums: Vec<f64> = (0..self.plain.len() / self.width).into_par_iter().map(of_row).collect();
        let mean = sums.iter().sum::<f64>() / (3.0 * self.plain.len() as f64);
        if mean == 0.0 { 1.0 } else { mean }
    }
}

/// A mean, less the more uncertain it is (the non-negative garrote, Breiman 1995): else, where noise is strong, chance
/// alone would keep some of it.
fn shrunk(mean: f32, error: f32) -> f32 {
    (mean - over(error * error, mean.max(0.0))).max(0.0)
}

/// a / b, or zero unless b is positive.
fn over(a: f32, b: f32) -> f32 {
    if b > 0.0 { a / b } else { 0.0 }
}

/// How many lines there are within `reach` of one.
fn within(line: usize, count: usize, reach: usize) -> usize {
    (line + reach + 1).min(count) - line.saturating_sub(reach)
}

/// The mean over the square of `reach` pixels around each, as far as there are.
pub fn box_mean(image: &[f32], width: usize, reach: usize) -> Vec<f32> {
    let (height, mut along) = (image.len() / width, vec![0.0; image.len()]);
    let rows = along.par_chunks_mut(width).zip(image.par_chunks(width));
    rows.for_each(|(out, row)| {
        let mut window = Window::new(1, width, reach, 0);
        for (x, out) in out.iter_mut().enumerate() {
            window.move_to(x, |at| &row[at..=at]);
            *out = window.mean(0);
        }
    });
    let mut means = vec![0.0; image.len()];
    means.par_chunks_mut(ROWS * width).enumerate().for_each(|(task, out)| {
        let mut window = Window::new(width, height, reach, task * ROWS);
        for (y, out) in out.chunks_mut(width).enumerate() {
            window.move_to(task * ROWS + y, |at| &along[at * width..][..width]);
            for (x, out) in out.iter_mut().enumerate() {
                *out = window.mean(x);
            }
        }
    });
    means
}

/// Sums over the lines within `reach` of one that moves on by one.
struct Window {
    sums: Vec<f64>,
    /// The lines that are in the sums.
    lines: std::ops::Range<usize>,
    count: usize,
    reach: usize,
}

impl Window {
    /// Of lines of so many pixels, `count` of them; it begins at one.
    fn new(pixels: usize, count: usize, reach: usize, first: usize) -> Window {
        let begin = first.saturating_sub(reach);
        Window { sums: vec![0.0; pixels], lines: begin..begin, count, reach }
    }

    fn move_to<'a>(&mut self, line: usize, pixels: impl Fn(usize) -> &'a [f32]) {
        while self.lines.end < (line + self.reach + 1).min(self.count) {
            self.add(pixels(self.lines.end), 1.0);
            self.lines.end += 1;
        }
        while self.lines.start + self.reach < line {
            self.add(pixels(self.lines.start), -1.0);
            self.lines.start += 1;
        }
    }

    fn add(&mut self, line: &[f32], times: f64) {
        for (sum, &pixel) in self.sums.iter_mut().zip(line) {
            *sum += times * f64::from(pixel);
        }
    }

    fn mean(&self, pixel: usize) -> f32 {
        (self.sums[pixel] / self.lines.len() as f64) as f32
    }
}
