// SPDX-License-Identifier: GPL-3.0-or-later
//! Fits a window: the rectangle through which light from all around comes, by the variance that shadow rays
//! through it leave.

use std::f64::consts::PI;

use rayon::prelude::*;

use super::Climb;
use super::rectangle::Rectangle;
use crate::InvalidInput;
use crate::portals::Portal;
use crate::random::random4;
use crate::vector::{Vector, cross, dot};

/// How deep first rectangles are tried, of their shorter side.
const DEPTHS: [f32; 7] = [-0.6, -0.3, -0.12, 0.0, 0.12, 0.3, 0.6];
const STEPS: u32 = 120;
/// The shortest side of one that is fitted, and how much wider that is made.
const LEAST_SIDE: f32 = 1.0e-4;
const MARGIN: f32 = 1.01;
/// How much wider the one is made that is found, and how much more variance may be left where all ways go through it.
const WIDER: f32 = 1.03;
const LOOSER: f64 = 1.15;
const SEED: u32 = 2;

/// A place of the picture, and its normal.
pub struct Seen {
    pub position: Vector,
    pub normal: Vector,
}

/// A way from one of the places by which light may come.
pub struct Way {
    pub place: u32,
    pub direction: Vector,
    /// How much of all directions it stands for [sr].
    pub angle: f32,
}

/// What the rectangle is fitted to.
struct Fit<'a> {
    places: &'a [Seen],
    ways: &'a [Way],
    /// Of each way, what it adds to E[x^2] / E[x]^2 of its place, times its density.
    masses: Vec<f64>,
    /// Of each way, its density by what does not go through the rectangle [1/sr].
    densities: Vec<f64>,
    /// Places that ways begin at.
    lit: Vec<bool>,
    share: f64,
}

/// Places, seen from a rectangle.
struct Plane {
    /// Along its sides, and across it.
    axes: [Vector; 3],
    /// Where places are by those, from its middle.
    places: Vec<Vector>,
}

/// The rectangle of the least variance near a portal, or with the axis and the side of a frame, where a `share` of
/// shadow rays goes through it by solid angle and the others by the cosine, and errors are relative to what falls on
/// each place, or in the mean below a share of `dark` of that.
///
/// # Errors
/// A way from no place; an angle that is no number.
pub fn fit_window(
    portal: &Portal,
    places: &[Seen],
    ways: &[Way],
    frames: &[[Vector; 2]],
    share: f64,
    dark: f64,
) -> Result<Portal, InvalidInput> {
    if let Some(row) = ways.iter().position(|way| way.place as usize >= places.len()) {
        return Err(InvalidInput(format!("place[{row}] = {} is none of {}", ways[row].place, places.len())));
    }
    if let Some(row) = ways.iter().position(|way| !(way.angle.is_finite() && way.angle >= 0.0)) {
        return Err(InvalidInput(format!("angles[{row}] = {} is no solid angle", ways[row].angle)));
    }
    let fit = Fit::new(places, ways, share, dark);
    let own = Rectangle::of(portal);
    let shorter = own.sides[0].min(own.sides[1]).exp();
    let of_frame = |&[axis, across]: &[Vector; 2]| {
        DEPTHS.map(|depth| {
            let middle = std::array::from_fn(|k| own.middle[k] + depth * shorter * axis[k]);
            fit.fitted(Rectangle { middle, axis, across, sides: own.sides }, 0.0)
        })
    };
    let mut tried: Vec<Rectangle> = frames.iter().flat_map(of_frame).collect();
    tried.push(own);
    let (_, start) = tried
        .into_par_iter()
        .map(|one| (fit.variance(&one), one))
        .reduce_with(|one, other| if other.0 < one.0 { other } else { one })
        .unwrap_or((0.0, own));
    let (_, found) = fit.climbed(start, STEPS, |step, k| random4(SEED, 0, step, k));
    // Ways that are few, and brightest where a portal misses them, may be among none of these.
    let whole = fit.fitted(found, 0.0).wider(WIDER);
    let own = found.wider(WIDER);
    let found = if fit.variance(&whole) <= LOOSER * fit.variance(&own) { whole } else { own };
    Ok(found.portal())
}

impl<'a> Fit<'a> {
    fn new(places: &'a [Seen], ways: &'a [Way], share: f64, dark: f64) -> Fit<'a> {
        let cosine = |way: &Way| f64::from(dot(places[way.place as usize].normal, way.direction)).max(0.0);
        let cosines: Vec<f64> = ways.iter().map(cosine).collect();
        let mut falls = vec![0.0; places.len()];
        for (way, cosine) in ways.iter().zip(&cosines) {
            falls[way.place as usize] += cosine * f64::from(way.angle);
        }
        let dark = dark * falls.iter().sum::<f64>() / falls.len().max(1) as f64;
        let mass = |(way, cosine): (&Way, &f64)| {
            let falls = falls[way.place as usize];
            cosine * cosine * f64::from(way.angle) / (falls * falls + dark * dark)
        };
        let masses = ways.iter().zip(&cosines).map(mass).collect();
        let densities = cosines.iter().map(|cosine| (1.0 - share) * cosine / PI).collect();
        let lit = falls.iter().map(|falls| *falls > 0.0).collect();
        Fit { places, ways, masses, densities, lit, share }
    }

    /// The mean over places of E[x^2] / E[x]^2.
    fn variance(&self, rectangle: &Rectangle) -> f64 {
        let plane = Plane::of(rectangle, self.places);
        let half = rectangle.sides.map(|side| 0.5 * side.exp());
        let by_portal = |(place, lit): (&Vector, &bool)| {
            if *lit { self.share / solid_angle(*place, half).max(1.0e-12) } else { 0.0 }
        };
        let by_portal: Vec<f64> = plane.places.iter().zip(&self.lit).map(by_portal).collect();
        let mut found = 0.0;
        for ((way, mass), by_cosine) in self.ways.iter().zip(&self.masses).zip(&self.densities) {
            let [x, y] = plane.met(way);
            let through = x.abs() <= half[0] && y.abs() <= half[1];
            let density = by_cosine + if through { by_portal[way.place as usize] } else { 0.0 };
            if density > 0.0 {
                found += mass / density;
            }
        }
        let mean = found / self.places.len() as f64;
        if mean.is_finite() { mean.max(1.0e-12) } else { f64::INFINITY }
    }
}

impl Climb for Fit<'_> {
    const BEYOND: [f64; 3] = [0.0, 0.005, 0.02];
    /// All that is there is within one scene unit of the middle.
    const MOST_SIDE: f32 = 4.0;

    fn gain(&self, rectangle: &Rectangle) -> f32 {
        (1.0 / self.variance(rectangle)) as f32
    }

    /// By ways that meet the plane.
    fn fitted(&self, rectangle: Rectangle, beyond: f64) -> Rectangle {
        let plane = Plane::of(&rectangle, self.places);
        let met = |way: &Way| Some(plane.met(way)).filter(|at| at.iter().all(|x| x.is_finite()));
        let met: Vec<[f32; 2]> = self.ways.iter().filter_map(met).collect();
        let few = (beyond * met.len() as f64) as usize;
        if met.len() <= 2 * few {
            return rectangle;
        }
        let ends = [0, 1].map(|k| {
            let mut along: Vec<f32> = met.iter().map(|at| at[k]).collect();
            [few, met.len() - 1 - few].map(|rank| *along.select_nth_unstable_by(rank, f32::total_cmp).1)
        });
        rectangle.resized(ends, MARGIN, [LEAST_SIDE, Self::MOST_SIDE])
    }
}

impl Plane {
    fn of(rectangle: &Rectangle, places: &[Seen]) -> Plane {
        let [_, [cx, cy, cz, _], [ax, ay, az, _]] = rectangle.portal();
        let (across, axis) = ([cx, cy, cz], [ax, ay, az]);
        let axes = [across, cross(axis, across), axis];
        let from_middle = |seen: &Seen| {
            let away: Vector = std::array::from_fn(|k| seen.position[k] - rectangle.middle[k]);
            axes.map(|along| dot(away, along))
        };
        Plane { axes, places: places.iter().map(from_middle).collect() }
    }

    /// Where a way meets it, from its middle; infinite: nowhere.
    fn met(&self, way: &Way) -> [f32; 2] {
        let place = self.places[way.place as usize];
        let [x, y, toward] = self.axes.map(|along| dot(way.direction, along));
        let far = -place[2] / toward;
        if far.is_nan() || far <= 0.0 {
            return [f32::INFINITY; 2];
        }
        [place[0] + far * x, place[1] + far * y]
    }
}

/// Of a rectangle by halves of its sides, seen from a place by its axes [sr].
fn solid_angle(place: Vector, half: [f32; 2]) -> f64 {
    let ([x, y, z], [half_width, half_height]) = (place.map(f64::from), half.map(f64::from));
    let z = z.abs().max(1.0e-9);
    // The angles of the four corners, one minus the next: that of the product of complex numbers.
    let corner = |a: f64, b: f64| [z * (a * a + b * b + z * z).sqrt(), a * b];
    let times = |[a, b]: [f64; 2], [c, d]: [f64; 2]| [a * c - b * d, a * d + b * c];
    let [left, right, low, high] = [-half_width - x, half_width - x, -half_height - y, half_height - y];
    let minus = |[a, b]: [f64; 2]| [a, -b];
    let added = times(corner(right, high), corner(left, low));
    let [a, b] = times(added, minus(times(corner(right, low), corner(left, high))));
    let angle = b.atan2(a);
    if angle < 0.0 { angle + 2.0 * PI } else { angle }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Of a window in a wall, 1 wide and 0.5 high, from places on both sides of its axis: a tilted one that is
    /// too wide becomes that one.
    #[test]
    fn a_window_is_found() {
        let draw = |number: u32, k: u32| random4(7, 0, number, k);
        let places: Vec<Seen> = (0..60)
            .map(|number| {
                let u = draw(number, 0);
                let position = [2.0 * u[0] - 1.0, 2.0 * u[1] - 1.0, -1.0 - u[2]];
                Seen { position, normal: [0.0, 0.0, 1.0] }
            })
            .collect();
        let ways: Vec<Way> = (0..1200)
            .map(|number| {
                let (place, u) = (number % 60, draw(number, 1));
                let through = [u[0] - 0.5, 0.5 * (u[1] - 0.5), 0.0];
                let from = places[place as usize].position;
                let way: Vector = std::array::from_fn(|k| through[k] - from[k]);
                let length = dot(way, way).sqrt();
                let direction = way.map(|x| x / length);
                Way { place, direction, angle: 0.5 / 20.0 * direction[2] / (length * length) }
            })
            .collect();
        let tilted: Portal = [[0.05, 0.1, 0.1, 1.4], [0.98, 0.199, 0.0, 0.9], [0.0, 0.3, 0.954, 0.0]];
        // Without knowing what stands about it only nearly.
        for (frames, close) in [(&[[[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]][..], 0.05), (&[], 0.5)] {
            let found = fit_window(&tilted, &places, &ways, frames, 0.75, 0.1).unwrap();
            let fit = Fit::new(&places, &ways, 0.75, 0.1);
            let [before, after] = [tilted, found].map(|one| fit.variance(&Rectangle::of(&one)));
            assert!(after < 0.75 * before, "{before} {after}");
            let [[x, y, z, width], [.., height], [.., axis, _]] = found;
            assert!(x.abs() < close && y.abs() < close && z.abs() < close, "{found:?}");
            assert!((width - 1.0).abs() < close && (height - 0.5).abs() < close, "{found:?}");
            assert!(axis.abs() > 1.0 - close, "{found:?}");
        }
    }

    #[test]
    fn bad_input() {
        let portal = [[0.0, 0.0, 0.0, 1.0], [1.0, 0.0, 0.0, 1.0], [0.0, 0.0, 1.0, 0.0]];
        let places = [Seen { position: [0.0; 3], normal: [0.0, 0.0, 1.0] }];
        let way = |place, angle| [Way { place, direction: [0.0, 0.0, 1.0], angle }];
        assert!(fit_window(&portal, &places, &way(1, 1.0), &[], 0.75, 0.1).is_err());
        assert!(fit_window(&portal, &places, &way(0, f32::NAN), &[], 0.75, 0.1).is_err());
    }
}
