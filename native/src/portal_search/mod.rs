// SPDX-License-Identifier: GPL-3.0-or-later
//! Finds portals by hill climbing over rectangles. For photons, by the paths of those that contributed to the picture:
//! they estimate the variance that a rectangle would leave, for it changes the pdf of each path by a known factor. For
//! shadow rays, by those that come through a window.

mod rectangle;
mod segments;
mod window;

use rayon::prelude::*;

use crate::InvalidInput;
use crate::portals::{MOST_PORTALS, Portal};
use crate::random::random4;
use crate::vector::Vector;
use rectangle::{LEAST_SIDE, MOST_SIDE, Rectangle};
use segments::{Block, Segment, add, meet, segments_of, weights};
pub use window::{Seen, Way, fit_window};

/// Rectangles that are tried at first, how many of them are made better, and in how many steps.
const TRIED: std::ops::RangeInclusive<usize> = 200..=2000;
/// Segments that are looked at for those, of which there are fewer where paths are longer.
const LOOKED_AT: usize = 1_000_000;
const PROMISING: usize = 6;
const STEPS: u32 = 100;
/// The same of those that are found, once more.
const LAST_STEPS: u32 = 200;
/// Steps that are tried at once.
const MOST_AHEAD: usize = 8;
/// How much longer a photon would take if it saw one from everywhere: who does is not absorbed.
const LONGER: f64 = 2.0;
/// What the first one must gain, and what each after it: few paths promise more than there is.
const LEAST_GAIN: f32 = 1.25;
const LEAST_GAIN_OF_MORE: f32 = 2.0;
/// By how much all of them may be better than the last one promises, once each is climbed from again: far less, mostly.
const BETTER_AT_MOST: f32 = 1.5;
const SEED: u32 = 1;
/// Which nothing sees.
const NO_PORTAL: Portal = [[0.0; 4]; 3];
/// Where a rectangle is fitted: how much wider the one is that it is fitted to, of halves of sides, how much wider
/// it is made, and by how many segments at least.
const LOOSE: f32 = 0.75;
const MARGIN: f32 = 1.05;
const FEWEST: usize = 8;

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
    let mut found: Vec<Rectangle> = Vec::new();
    let mut gain = 1.0;
    while whole > 0.0 && found.len() < MOST_PORTALS {
        let mut others = found.clone();
        let number = found.len() as u32;
        let Some((promised, one_more)) = Search::beside(&others, &segments, whole).best(number) else {
            break;
        };
        let wanted = gain * if found.is_empty() { LEAST_GAIN } else { LEAST_GAIN_OF_MORE };
        if promised * BETTER_AT_MOST < wanted {
            break;
        }
        others.push(one_more);
        // Each again, now that there are the others.
        let mut better = 0.0;
        for at in 0..others.len() {
            let own = others.remove(at);
            let search = Search::beside(&others, &segments, whole);
            let (its_own, own) = search.better(own, LAST_STEPS, number << 4 | at as u32 | 1 << 16);
            others.insert(at, own);
            better = its_own;
        }
        if better < wanted {
            break;
        }
        (found, gain) = (others, better);
    }
    Ok((found.iter().map(Rectangle::portal).collect(), gain))
}

/// What rectangles are made better for.
trait Climb: Sync {
    /// Where one is fitted: how much of what comes through may be beyond each side.
    const BEYOND: [f64; 3];
    /// No side becomes longer.
    const MOST_SIDE: f32;

    /// More is better.
    fn gain(&self, rectangle: &Rectangle) -> f32;

    /// The rectangle in the plane of another one through which most comes.
    fn fitted(&self, rectangle: Rectangle, beyond: f64) -> Rectangle;

    /// A rectangle near by that gains more, and its gain; `draw`: numbers of a step. Where threads are idle steps are
    /// tried ahead, as if none before them led on: the first that does is the one that is found without.
    fn climbed(
        &self,
        mut rectangle: Rectangle,
        steps: u32,
        draw: impl Fn(u32, u32) -> [f32; 4] + Sync,
    ) -> (f32, Rectangle) {
        let (mut gain, mut far) = (self.gain(&rectangle), 1.0f32);
        let ahead = rayon::current_num_threads().min(MOST_AHEAD);
        let mut step = 0;
        while step < steps {
            let fars = std::iter::successors(Some(far), |far| Some(nearer(*far)));
            let begun: Vec<(u32, f32)> = (step..steps).zip(fars).take(ahead).collect();
            let tried: Vec<(f32, Rectangle)> = begun
                .par_iter()
                .map(|&(step, far)| {
                    let mut other = rectangle.changed(far, Self::MOST_SIDE, |k| draw(step, k));
                    if let Some(&beyond) = Self::BEYOND.get(step as usize % (1 + Self::BEYOND.len())) {
                        other = self.fitted(other, beyond);
                    }
                    (self.gain(&other), other)
                })
                .collect();
            let better = tried.iter().position(|(its_own, _)| *its_own > gain);
            let (last, last_far) = begun[better.unwrap_or(begun.len() - 1)];
            (step, far) = (last + 1, nearer(last_far));
            if let Some(at) = better {
                ((gain, rectangle), far) = (tried[at], (1.5 * last_far).min(1.0));
            }
        }
        (gain, rectangle)
    }
}

/// The search for one more portal.
struct Search<'a> {
    segments: &'a [Segment],
    /// With what they see of the portals that there are.
    blocks: Vec<Block>,
    /// Sums of what segments matter still, up to each.
    chances: Vec<f64>,
    /// The variance without any portal.
    whole: f64,
}

impl<'a> Search<'a> {
    fn beside(others: &[Rectangle], segments: &'a [Segment], whole: f64) -> Search<'a> {
        let mut blocks = Block::all_of(segments);
        for rectangle in others {
            add(&mut blocks, &rectangle.portal());
        }
        let (mut weight, mut sum) = (1.0, 0.0);
        let (before, _) = weights_with(&blocks, &NO_PORTAL);
        let of_one = |(segment, own): (&Segment, f64)| {
            weight = if segment.is_first { own } else { weight * own };
            sum += segment.after * weight;
            sum
        };
        let chances = segments.iter().zip(before).map(of_one).collect();
        Search { segments, blocks, chances, whole }
    }

    /// The best of those that are drawn and climbed from, with its gain.
    fn best(&self, which: u32) -> Option<(f32, Rectangle)> {
        let count = (LOOKED_AT / self.segments.len().max(1)).clamp(*TRIED.start(), *TRIED.end());
        let mut tried: Vec<(f32, Rectangle)> = (0..count as u32)
            .into_par_iter()
            .map(|number| {
                let rectangle = self.drawn(|k| random4(SEED, which, number, k));
                let rectangle = self.fitted(rectangle, Self::BEYOND[number as usize % Self::BEYOND.len()]);
                (self.gain(&rectangle), rectangle)
            })
            .collect();
        tried.sort_by(|one, other| other.0.total_cmp(&one.0));
        tried.truncate(PROMISING);
        let better: Vec<(f32, Rectangle)> = tried
            .into_par_iter()
            .enumerate()
            .map(|(number, (_, rectangle))| self.better(rectangle, STEPS, which | (number as u32) << 8))
            .collect();
        better.into_iter().reduce(|one, other| if other.0 > one.0 { other } else { one })
    }

    /// A better one near by.
    fn better(&self, rectangle: Rectangle, steps: u32, which: u32) -> (f32, Rectangle) {
        self.climbed(rectangle, steps, |step, k| random4(SEED, which, step, 16 + k))
    }

    /// A rectangle about a place on a segment, half of them where another one is closest, as in a gap; across the
    /// segment or an axis of the scene's.
    fn drawn(&self, draw: impl Fn(u32) -> [f32; 4]) -> Rectangle {
        let (a, b) = (draw(0), draw(1));
        let segment_at = |u: f32| {
            let chance = f64::from(u) * self.chances.last().copied().unwrap_or(0.0);
            &self.segments[self.chances.partition_point(|sum| *sum <= chance).min(self.segments.len() - 1)]
        };
        let one @ Segment { place, direction, .. } = segment_at(a[0]);
        let far = if b[2] < 0.5 { a[1] * one.length } else { one.closest_to(segment_at(b[3])) };
        let middle = std::array::from_fn(|k| place[k] + far * direction[k]);
        let along = (3.5 * a[2]) as usize;
        let axis: Vector = match along {
            3 => direction.map(|x| -x),
            _ => std::array::from_fn(|k| if k == along { -direction[k].signum() } else { 0.0 }),
        };
        let flat = (0..3).min_by(|&i, &j| axis[i].abs().total_cmp(&axis[j].abs())).unwrap_or(0);
        let across = std::array::from_fn(|k| if k == flat { 1.0 } else { 0.0 });
        let side = |u: f32| LEAST_SIDE.ln() + u * (MOST_SIDE / LEAST_SIDE).ln();
        Rectangle { middle, axis, across, sides: [side(b[0]), side(b[1])] }
    }
}

impl Climb for Search<'_> {
    const BEYOND: [f64; 3] = [0.0, 0.004, 0.02];
    const MOST_SIDE: f32 = MOST_SIDE;

    /// How much less variance one more portal leaves at equal time, over what there is without any.
    fn gain(&self, rectangle: &Rectangle) -> f32 {
        let (own, seeing) = weights_with(&self.blocks, &rectangle.portal());
        let (mut left, mut weight) = (0.0, 1.0);
        for (segment, own) in self.segments.iter().zip(own) {
            weight = if segment.is_first { own } else { weight * own };
            left += segment.mass * weight;
        }
        let longer = 1.0 + LONGER * f64::from(seeing) / self.segments.len() as f64;
        (self.whole / (left.max(1.0e-300) * longer)) as f32
    }

    /// By segments that come about through that: a share of what they matter may be beyond.
    fn fitted(&self, rectangle: Rectangle, beyond: f64) -> Rectangle {
        let mut met = Vec::with_capacity(self.segments.len());
        meet(&self.blocks, &rectangle.portal(), LOOSE, &mut met);
        let matters = |at: usize| self.chances[at] - if at > 0 { self.chances[at - 1] } else { 0.0 };
        let whole: f64 = met.iter().map(|&(number, _)| matters(number)).sum();
        if met.len() < FEWEST || whole <= 0.0 {
            return rectangle;
        }
        let ends = [0, 1].map(|k| {
            let mut ordered: Vec<(f32, f64)> =
                met.iter().map(|&(number, at)| (at[k], matters(number))).collect();
            ordered.sort_unstable_by(|one, other| one.0.total_cmp(&other.0).then(one.1.total_cmp(&other.1)));
            [edge(ordered.iter(), beyond * whole), edge(ordered.iter().rev(), beyond * whole)]
        });
        rectangle.resized(ends, MARGIN, [0.1 * LEAST_SIDE, MOST_SIDE])
    }
}

/// Photons' fluxes that took each segment, over what they are without portals, if there is one more; how many see any.
fn weights_with(blocks: &[Block], portal: &Portal) -> (impl Iterator<Item = f64> + use<>, u32) {
    let (mut found, mut seeing) = (Vec::with_capacity(blocks.len()), 0);
    weights(blocks, portal, &mut found, &mut seeing);
    (found.into_iter().flat_map(|row| row.0.map(f64::from)), seeing)
}

/// How far the step goes that follows one which led nowhere.
fn nearer(far: f32) -> f32 {
    (0.98 * far).max(0.05)
}

/// Where so much of what places matter is left behind.
fn edge<'a>(mut from: impl Iterator<Item = &'a (f32, f64)>, beyond: f64) -> f32 {
    let mut sum = 0.0;
    let found = from.find(|(_, matters)| {
        sum += matters;
        sum > beyond
    });
    found.map_or(0.0, |(at, _)| *at)
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
