// SPDX-License-Identifier: GPL-3.0-or-later
//! Finds portals by hill climbing over rectangles. The paths of photons that contributed to the picture estimate
//! the variance that a rectangle would leave: it changes the pdf of each path by a known factor.

use std::f32::consts::PI;

use rayon::prelude::*;

use crate::InvalidInput;
use crate::portals::{MOST_PORTALS, Portal, Seen};
use crate::random::random4;
use crate::vector::{cross, dot};

/// What a surface is taken to reflect; the rest goes through portals.
const ALBEDO: f32 = 0.5;
/// Rectangles that are tried at first, how many of them are made better, and in how many steps.
const TRIED: std::ops::RangeInclusive<usize> = 200..=2000;
/// Segments that are looked at for those, of which there are fewer where paths are longer.
const LOOKED_AT: usize = 1_000_000;
const PROMISING: usize = 6;
const STEPS: u32 = 100;
/// The same of those that are found, once more.
const LAST_STEPS: u32 = 200;
/// How much longer a photon would take if it saw one from everywhere: who does is not absorbed.
const LONGER: f64 = 2.0;
/// What the first one must gain, and what each after it: few paths promise more than there is.
const LEAST_GAIN: f32 = 1.25;
const LEAST_GAIN_OF_MORE: f32 = 2.0;
/// Sides of those that are tried [scene units].
const LEAST_SIDE: f32 = 0.04;
const MOST_SIDE: f32 = 1.2;
const SEED: u32 = 1;
/// Where a rectangle is fitted: how much of what comes through may be beyond each side, how much wider the one
/// is that it is fitted to, of halves of sides, how much wider it is made, and by how many segments at least.
const BEYOND: [f64; 3] = [0.0, 0.004, 0.02];
const LOOSE: f32 = 0.75;
const MARGIN: f32 = 1.05;
const FEWEST: usize = 8;

type Vector = [f32; 3];

/// From a place on a surface straight to the next one.
struct Segment {
    place: Vector,
    normal: Vector,
    direction: Vector,
    length: f32,
    cosine: f32,
    /// Whether it is the first one of a photon.
    is_first: bool,
    /// What the photon adds to the variance where it ends.
    mass: f64,
    /// What it adds there and after.
    after: f64,
}

/// Through which rectangles photons shall go, and how much less variance that leaves.
///
/// `places` and `normals` are those of photons that counted, one photon's after the other in the order of its
/// path, `photons` their numbers, and `masses` what each adds to the variance there.
///
/// # Errors
/// Arrays of different lengths; a mass that is not finite, or below 0.
pub fn search(
    places: &[Vector],
    normals: &[Vector],
    photons: &[u32],
    masses: &[f32],
) -> Result<(Vec<Portal>, f32), InvalidInput> {
    if [normals.len(), photons.len(), masses.len()] != [places.len(); 3] {
        return Err(InvalidInput("places, normals, photons and masses differ in length".into()));
    }
    if let Some(row) = masses.iter().position(|mass| !(mass.is_finite() && *mass >= 0.0)) {
        return Err(InvalidInput(format!("masses[{row}] = {} is no mass", masses[row])));
    }
    let segments = segments_of(places, normals, photons, masses);
    let whole: f64 = segments.iter().map(|segment| segment.mass).sum();
    let mut trials: Vec<Trial> = Vec::new();
    let mut gain = 1.0;
    while whole > 0.0 && trials.len() < MOST_PORTALS {
        let mut others = trials.clone();
        let number = trials.len() as u32;
        let ways = ways_by(&segments, &others);
        let Some((_, found)) = (Judge { segments: &segments, ways: &ways, whole }).best(number) else {
            break;
        };
        others.push(found);
        // Each again, now that there are the others.
        let mut better = 0.0;
        for at in 0..others.len() {
            let own = others.remove(at);
            let ways = ways_by(&segments, &others);
            let judge = Judge { segments: &segments, ways: &ways, whole };
            let (its_own, own) = judge.climbed(own, LAST_STEPS, number << 4 | at as u32 | 1 << 16);
            others.insert(at, own);
            better = its_own;
        }
        if better < gain * if trials.is_empty() { LEAST_GAIN } else { LEAST_GAIN_OF_MORE } {
            break;
        }
        (trials, gain) = (others, better);
    }
    Ok((trials.iter().map(Trial::portal).collect(), gain))
}

fn ways_by(segments: &[Segment], trials: &[Trial]) -> Vec<Way> {
    let portals: Vec<Portal> = trials.iter().map(Trial::portal).collect();
    let none = Way { angle: 0.0, met: 0.0 };
    let of_one = |segment| portals.iter().fold(none, |way, portal| way.with(segment, portal));
    segments.iter().map(of_one).collect()
}

fn segments_of(places: &[Vector], normals: &[Vector], photons: &[u32], masses: &[f32]) -> Vec<Segment> {
    let mut segments: Vec<Segment> = Vec::new();
    let mut is_first = true;
    for end in 1..places.len() {
        if photons[end] != photons[end - 1] {
            is_first = true;
            continue;
        }
        let along: Vector = std::array::from_fn(|k| places[end][k] - places[end - 1][k]);
        let length = dot(along, along).sqrt().max(1.0e-9);
        let direction = along.map(|x| x / length);
        let (place, normal, mass) = (places[end - 1], normals[end - 1], f64::from(masses[end]));
        let cosine = dot(direction, normal).max(0.0);
        segments.push(Segment { place, normal, direction, length, cosine, is_first, mass, after: 0.0 });
        is_first = false;
    }
    let mut after = 0.0;
    for segment in segments.iter_mut().rev() {
        after += segment.mass;
        segment.after = after;
        if segment.is_first {
            after = 0.0;
        }
    }
    segments
}

impl Segment {
    /// How far along it the other one's line is closest.
    fn closest_to(&self, other: &Segment) -> f32 {
        let away: Vector = std::array::from_fn(|k| other.place[k] - self.place[k]);
        let both = dot(self.direction, other.direction);
        let far = dot(away, self.direction) - both * dot(away, other.direction);
        (far / (1.0 - both * both).max(1.0e-6)).clamp(0.0, self.length)
    }
}

/// How a segment's place sees portals.
#[derive(Clone, Copy)]
struct Way {
    /// Solid angles of all [sr].
    angle: f32,
    /// The sum of the densities of the segment's direction in each, times those.
    met: f32,
}

impl Way {
    fn with(self, segment: &Segment, portal: &Portal) -> Way {
        match Seen::of(portal, segment.place, segment.normal) {
            None => self,
            Some(seen) => {
                Way { angle: self.angle + seen.angle, met: self.met + seen.density(segment.direction) }
            }
        }
    }

    /// A photon's flux that took the segment over what it is without portals.
    fn weight(self, segment: &Segment) -> f64 {
        if self.angle <= 0.0 {
            return 1.0;
        }
        let by_cosine = ALBEDO * segment.cosine / PI;
        let all = by_cosine + (1.0 - ALBEDO) * self.met / self.angle;
        f64::from(by_cosine) / f64::from(all).max(1.0e-30)
    }
}

/// A rectangle by its middle, a normal, a vector about across it, and the logarithms of its sides.
#[derive(Clone, Copy)]
struct Trial {
    middle: Vector,
    axis: Vector,
    across: Vector,
    sides: [f32; 2],
}

impl Trial {
    fn portal(&self) -> Portal {
        let axis = unit(self.axis);
        let along = dot(self.across, axis);
        let across = unit(std::array::from_fn(|k| self.across[k] - along * axis[k]));
        let [width, height] = self.sides.map(f32::exp);
        let row = |v: Vector, w: f32| [v[0], v[1], v[2], w];
        [row(self.middle, width), row(across, height), row(axis, 0.0)]
    }

    /// Another one, changed in one way by as much as `far` tells: an edge is moved, or it is shifted across its
    /// plane, or turned.
    fn changed(&self, far: f32, draw: impl Fn(u32) -> [f32; 4]) -> Trial {
        let (a, b) = (draw(0), draw(1));
        // About normal: the sum of two even ones.
        let n = |u: f32, v: f32| 2.4 * far * (u + v - 1.0);
        let [[.., width], [cx, cy, cz, height], [ax, ay, az, _]] = self.portal();
        let (across, axis) = ([cx, cy, cz], [ax, ay, az]);
        let moved = |along: Vector, by: f32| std::array::from_fn(|k| self.middle[k] + by * along[k]);
        let mut other = Trial { middle: self.middle, axis, across, sides: self.sides };
        match (10.0 * a[0]) as usize {
            edge @ 0..4 => {
                let (side, length, along) =
                    if edge < 2 { (0, width, across) } else { (1, height, cross(axis, across)) };
                other.sides[side] = (other.sides[side] + 0.5 * n(a[1], a[2])).min(MOST_SIDE.ln());
                let longer = other.sides[side].exp() - length;
                other.middle = moved(along, if edge % 2 == 0 { 0.5 * longer } else { -0.5 * longer });
            }
            4..7 => other.middle = moved(axis, 0.5 * width.min(height) * n(a[1], a[2])),
            _ => {
                let turn = [n(a[1], a[2]), n(a[3], b[0]), n(b[1], b[2])];
                other.axis = std::array::from_fn(|k| axis[k] + 0.3 * turn[k]);
                other.across = std::array::from_fn(|k| across[k] + 0.3 * turn[(k + 1) % 3]);
            }
        }
        other
    }
}

struct Judge<'a> {
    segments: &'a [Segment],
    ways: &'a [Way],
    whole: f64,
}

impl Judge<'_> {
    /// How much less variance one more portal leaves at equal time, over what there is without any.
    fn gain(&self, trial: &Trial) -> f32 {
        let portal = trial.portal();
        let (mut left, mut weight, mut led) = (0.0, 1.0, 0);
        for (segment, way) in self.segments.iter().zip(self.ways) {
            let way = way.with(segment, &portal);
            led += usize::from(way.angle > 0.0);
            let own = way.weight(segment);
            weight = if segment.is_first { own } else { weight * own };
            left += segment.mass * weight;
        }
        let longer = 1.0 + LONGER * led as f64 / self.segments.len() as f64;
        (self.whole / (left.max(1.0e-300) * longer)) as f32
    }

    fn best(&self, which: u32) -> Option<(f32, Trial)> {
        let chances = self.chances();
        let count = (LOOKED_AT / self.segments.len().max(1)).clamp(*TRIED.start(), *TRIED.end());
        let mut tried: Vec<(f32, Trial)> = (0..count as u32)
            .into_par_iter()
            .map(|number| {
                let trial = self.trial(&chances, |k| random4(SEED, which, number, k));
                let trial = self.fitted(&chances, trial, BEYOND[number as usize % BEYOND.len()]);
                (self.gain(&trial), trial)
            })
            .collect();
        tried.sort_by(|one, other| other.0.total_cmp(&one.0));
        tried.truncate(PROMISING);
        let better: Vec<(f32, Trial)> = tried
            .into_par_iter()
            .enumerate()
            .map(|(number, (_, trial))| self.climbed(trial, STEPS, which | (number as u32) << 8))
            .collect();
        better.into_iter().reduce(|one, other| if other.0 > one.0 { other } else { one })
    }

    /// A better one near by.
    fn climbed(&self, mut trial: Trial, steps: u32, which: u32) -> (f32, Trial) {
        let (mut gain, mut far, chances) = (self.gain(&trial), 1.0f32, self.chances());
        for step in 0..steps {
            let mut other = trial.changed(far, |k| random4(SEED, which, step, 16 + k));
            if let Some(&beyond) = BEYOND.get(step as usize % (1 + BEYOND.len())) {
                other = self.fitted(&chances, other, beyond);
            }
            let its_own = self.gain(&other);
            far = if its_own > gain { (1.5 * far).min(1.0) } else { (0.98 * far).max(0.05) };
            if its_own > gain {
                (gain, trial) = (its_own, other);
            }
        }
        (gain, trial)
    }

    /// The rectangle in the plane of another one through which most segments come that come about through that:
    /// on each side a share of what they matter may be beyond.
    fn fitted(&self, chances: &[f64], trial: Trial, beyond: f64) -> Trial {
        let [[x, y, z, width], [cx, cy, cz, height], [ax, ay, az, _]] = trial.portal();
        let (middle, across, axis) = ([x, y, z], [cx, cy, cz], [ax, ay, az]);
        let up = cross(axis, across);
        let mut met: Vec<([f32; 2], f64)> = Vec::new();
        let mut before = 0.0;
        for (segment, sum) in self.segments.iter().zip(chances) {
            let matters = sum - before;
            before = *sum;
            let away: Vector = std::array::from_fn(|k| segment.place[k] - middle[k]);
            let (above, toward) = (dot(away, axis), -dot(segment.direction, axis));
            if above > 0.0 && above < segment.length * toward {
                let far = above / toward;
                let at = [across, up].map(|side| dot(away, side) + far * dot(segment.direction, side));
                if at[0].abs() < LOOSE * width && at[1].abs() < LOOSE * height {
                    met.push((at, matters));
                }
            }
        }
        let whole: f64 = met.iter().map(|(_, matters)| matters).sum();
        if met.len() < FEWEST || whole <= 0.0 {
            return trial;
        }
        let (mut centre, mut sides) = (middle, [0.0; 2]);
        for (k, along) in [across, up].into_iter().enumerate() {
            met.sort_by(|one, other| one.0[k].total_cmp(&other.0[k]));
            let low = edge(met.iter(), k, beyond * whole);
            let high = edge(met.iter().rev(), k, beyond * whole);
            centre = std::array::from_fn(|i| centre[i] + 0.5 * (low + high) * along[i]);
            sides[k] = (MARGIN * (high - low)).clamp(0.1 * LEAST_SIDE, MOST_SIDE).ln();
        }
        Trial { middle: centre, axis, across, sides }
    }

    /// Sums of what segments matter still, up to each.
    fn chances(&self) -> Vec<f64> {
        let (mut weight, mut sum) = (1.0, 0.0);
        let of_one = |(segment, way): (&Segment, &Way)| {
            let own = way.weight(segment);
            weight = if segment.is_first { own } else { weight * own };
            sum += segment.after * weight;
            sum
        };
        self.segments.iter().zip(self.ways).map(of_one).collect()
    }

    /// A rectangle about a place on a segment, half of them where another one is closest, as in a gap; across the
    /// segment or an axis of the scene's.
    fn trial(&self, chances: &[f64], draw: impl Fn(u32) -> [f32; 4]) -> Trial {
        let (a, b) = (draw(0), draw(1));
        let drawn = |u: f32| {
            let chance = f64::from(u) * chances.last().copied().unwrap_or(0.0);
            &self.segments[chances.partition_point(|sum| *sum <= chance).min(chances.len() - 1)]
        };
        let one @ Segment { place, direction, .. } = drawn(a[0]);
        let far = if b[2] < 0.5 { a[1] * one.length } else { one.closest_to(drawn(b[3])) };
        let middle = std::array::from_fn(|k| place[k] + far * direction[k]);
        let along = (3.5 * a[2]) as usize;
        let axis: Vector = match along {
            3 => direction.map(|x| -x),
            _ => std::array::from_fn(|k| if k == along { -direction[k].signum() } else { 0.0 }),
        };
        let flat = (0..3).min_by(|&i, &j| axis[i].abs().total_cmp(&axis[j].abs())).unwrap_or(0);
        let across = std::array::from_fn(|k| if k == flat { 1.0 } else { 0.0 });
        let side = |u: f32| LEAST_SIDE.ln() + u * (MOST_SIDE / LEAST_SIDE).ln();
        Trial { middle, axis, across, sides: [side(b[0]), side(b[1])] }
    }
}

/// Where on an axis so much is left behind.
fn edge<'a>(mut from: impl Iterator<Item = &'a ([f32; 2], f64)>, axis: usize, beyond: f64) -> f32 {
    let mut sum = 0.0;
    let found = from.find(|(_, matters)| {
        sum += matters;
        sum > beyond
    });
    found.map_or(0.0, |(at, _)| at[axis])
}

fn unit(v: Vector) -> Vector {
    let length = dot(v, v).sqrt().max(1.0e-20);
    v.map(|x| x / length)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Photons from one side of a wall to the other by a hole, which is found.
    #[test]
    fn a_hole_is_found() {
        let (mut places, mut normals, mut photons, mut masses) = (vec![], vec![], vec![], vec![]);
        for photon in 0..200 {
            let (a, b) = (random4(5, 0, photon, 0), random4(5, 0, photon, 1));
            let from = [2.0 * a[0] - 1.0, 2.0 * a[1] - 1.0, 1.0];
            let hole = [0.2 + 0.1 * (a[2] - 0.5), 0.3 + 0.3 * (a[3] - 0.5), 0.0];
            let far = 0.3 + b[0];
            let onward: Vector = std::array::from_fn(|k| hole[k] + far * (hole[k] - from[k]));
            places.extend([from, onward]);
            normals.extend([[0.0, 0.0, -1.0], [0.0, 0.0, 1.0]]);
            photons.extend([photon, photon]);
            masses.extend([0.0, 1.0]);
        }
        let (portals, gain) = search(&places, &normals, &photons, &masses).unwrap();
        let [[x, y, z, width], [.., height], [.., axis, _]] = portals[0];
        assert!(gain > 20.0, "{gain}");
        assert!((x - 0.2).abs() < 0.1 && (y - 0.3).abs() < 0.1 && z.abs() < 0.2, "{portals:?}");
        assert!(width * height < 0.2 && axis > 0.7, "{portals:?}");
    }

    #[test]
    fn bad_input() {
        assert!(search(&[[0.0; 3]], &[], &[0], &[0.0]).is_err());
        assert!(search(&[[0.0; 3]], &[[0.0; 3]], &[0], &[f32::NAN]).is_err());
        assert!(search(&[], &[], &[], &[]).unwrap().0.is_empty());
    }
}
