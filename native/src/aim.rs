// SPDX-License-Identifier: GPL-3.0-or-later
//! Importance sampling of where photons start at a light: a tree of boxes over primary sample space, the four
//! random numbers in [0, 1) that a photon starts by (glsl/lib/aim.glsl), built from photons that reached the picture.

use std::cmp::Ordering;
use std::collections::BinaryHeap;

use rayon::prelude::*;

use crate::InvalidInput;
use crate::random::random4;
use crate::vector::{Vector64, dot64, frame_about64};

/// Where their dimensions of random numbers begin, as in glsl/lib/rng.glsl.
const DIMENSION_AIM: u32 = 0x10;
/// A box is split where its photons in so many parts of an axis differ.
const PARTS: usize = 8;
/// By more than chance alone makes them differ, times this.
const SIGNIFICANT: f64 = 2.0;
/// Photons that tell of a box at least.
const TELLING: usize = 24;
/// What a split gains at least, of all.
const LEAST_GAIN: f64 = 2e-4;
const MOST_BOXES: usize = 1024;
const MOST_DEPTH: u32 = 96;
/// No half of a box is less likely: each halving takes digits of the numbers.
const LEAST_SHARE: f64 = 1.0 / 4096.0;
/// A thread takes no fewer photons.
const FEW: usize = 1024;

/// AimNode of layouts.rs: the axis that it is halved along, the probability of the lower half, where both
/// halves are, the lower one first; or 0, if it is not halved.
pub type Node = [f32; 4];
pub type Numbers = [f32; 4];

/// What a photon's numbers have no digits for.
pub(crate) fn rest_of(seed: u32, pass_index: u32, photon: u32) -> Numbers {
    random4(seed, pass_index, photon, DIMENSION_AIM).map(|x| x / 16_777_216.0)
}

/// Numbers of a photon by the tree whose root is at a place, and its flux over what plain numbers give it; `rest`: what
/// these have no digits for, which each halving asks for more of.
#[inline]
pub fn aimed(nodes: &[Node], root: usize, numbers: Numbers, rest: Numbers) -> (Numbers, f32) {
    let (mut low, mut size, mut weight) = ([0.0f32; 4], [1.0f32; 4], 1.0f32);
    let (mut numbers, mut rest, mut at, mut depth) = (numbers, rest, root, 0u32);
    while let Some(&[axis, low_share, first, _]) = nodes.get(at)
        && first > 0.0
        && depth < MOST_DEPTH
    {
        let axis = axis as usize & 3;
        let is_low = numbers[axis] + rest[axis] < low_share;
        let share = if is_low { low_share } else { 1.0 - low_share };
        numbers[axis] = (numbers[axis] - if is_low { 0.0 } else { low_share }) / share;
        rest[axis] /= share;
        size[axis] *= 0.5;
        low[axis] += if is_low { 0.0 } else { size[axis] };
        weight *= 0.5 / share;
        at = first as usize + usize::from(!is_low);
        depth += 1;
    }
    let within = |k: usize| low[k] + size[k] * (numbers[k] + rest[k]).clamp(0.0, 1.0);
    (std::array::from_fn(|k| within(k).clamp(0.0, 1.0 - f32::EPSILON / 2.0)), weight)
}

/// The same for photons of a pass.
pub fn aimed_photons(
    nodes: &[Node],
    root: usize,
    seed: u32,
    pass_index: u32,
    photons: &[u32],
    numbers: &[Numbers],
) -> (Vec<Numbers>, Vec<f32>) {
    let of_one = |(&photon, &numbers): (&u32, &Numbers)| {
        aimed(nodes, root, numbers, rest_of(seed, pass_index, photon))
    };
    photons.par_iter().zip(numbers).with_min_len(FEW).map(of_one).unzip()
}

/// The pdf of numbers by a tree; without one it is 1.
pub fn pdf(nodes: &[Node], numbers: &[Numbers]) -> Vec<f32> {
    let of_one = |numbers: &Numbers| {
        let (mut low, mut size, mut pdf, mut at) = ([0.0f32; 4], [1.0f32; 4], 1.0f32, 0);
        while let Some(&[axis, share, first, _]) = nodes.get(at)
            && first > 0.0
        {
            let axis = axis as usize & 3;
            size[axis] *= 0.5;
            let is_low = numbers[axis] < low[axis] + size[axis];
            low[axis] += if is_low { 0.0 } else { size[axis] };
            pdf *= 2.0 * if is_low { share } else { 1.0 - share };
            at = first as usize + usize::from(!is_low);
        }
        pdf
    };
    numbers.par_iter().with_min_len(FEW).map(of_one).collect()
}

/// A box that may be split.
struct Leaf {
    node: usize,
    low: [f64; 4],
    size: [f64; 4],
    depth: u32,
    /// Its samples, in `order`.
    samples: std::ops::Range<usize>,
    gain: f64,
    axis: usize,
}

impl PartialEq for Leaf {
    fn eq(&self, other: &Leaf) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for Leaf {}
impl PartialOrd for Leaf {
    fn partial_cmp(&self, other: &Leaf) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for Leaf {
    fn cmp(&self, other: &Leaf) -> Ordering {
        self.gain.total_cmp(&other.gain).then(other.node.cmp(&self.node))
    }
}

/// What a node is while the tree grows.
#[derive(Clone, Copy)]
struct Grown {
    axis: usize,
    first: usize,
    volume: f64,
    /// How likely it is before anything is known.
    prior: f64,
    /// The root of volume times mass: with a box's probability in proportion to it, the variance is least.
    deviation: f64,
}

/// How likely a box is before anything is known: by plain numbers, and where the third one is the square of a
/// distance, half by that and half as if all distances from the root of `nearest` on were as likely.
fn prior_of(low: &[f64; 4], size: &[f64; 4], nearest: f64) -> f64 {
    let below = |x: f64| (x.min(nearest) / nearest + (x.max(nearest) / nearest).ln()) / (1.0 - nearest.ln());
    let along = 0.5 * size[2] + 0.5 * (below(low[2] + size[2]) - below(low[2]));
    size[0] * size[1] * along * size[3]
}

/// A tree by which numbers are as likely as it takes for the least variance, if `masses` are how much the
/// squares of what numbers bring are where there are samples of them; `least`: the share of photons that
/// goes by what was likely before, `nearest` as of `prior_of`, or 1: plain numbers are. And by how much such
/// photons' root of variance is that of plain ones'.
///
/// # Errors
/// A number outside [0, 1), a mass that is not finite, or below 0, a `nearest` outside (0, 1].
pub fn tree(
    numbers: &[Numbers],
    masses: &[f32],
    least: f64,
    nearest: f64,
) -> Result<(Vec<Node>, f64), InvalidInput> {
    if !(nearest > 0.0 && nearest <= 1.0) {
        return Err(InvalidInput(format!("nearest = {nearest} is outside (0, 1]")));
    }
    if let Some(row) = numbers.iter().position(|at| !at.iter().all(|x| (0.0..1.0).contains(x))) {
        return Err(InvalidInput(format!("numbers[{row}] = {:?} is outside [0, 1)", numbers[row])));
    }
    if let Some(row) = masses.iter().position(|mass| !(mass.is_finite() && *mass >= 0.0)) {
        return Err(InvalidInput(format!("masses[{row}] = {} is no mass", masses[row])));
    }
    let mut order: Vec<u32> = (0..numbers.len() as u32).filter(|&i| masses[i as usize] > 0.0).collect();
    let total: f64 = order.iter().map(|&i| f64::from(masses[i as usize])).sum();
    let whole = Grown { axis: 0, first: 0, volume: 1.0, prior: 1.0, deviation: total.sqrt() };
    let mut grown = vec![whole];
    if total <= 0.0 {
        return Ok((nodes_of(&grown, least), 1.0));
    }
    let mut heap = BinaryHeap::new();
    let root = Leaf {
        node: 0,
        low: [0.0; 4],
        size: [1.0; 4],
        depth: 0,
        samples: 0..order.len(),
        gain: 0.0,
        axis: 0,
    };
    let samples = Samples { numbers, masses };
    heap.extend(samples.looked_at(root, &order, 1.0));
    while let Some(leaf) = heap.pop() {
        if leaf.gain < LEAST_GAIN * whole.deviation || grown.len() >= 2 * MOST_BOXES {
            break;
        }
        let (axis, first, volume) = (leaf.axis, grown.len(), grown[leaf.node].volume / 2.0);
        (grown[leaf.node].axis, grown[leaf.node].first) = (axis, first);
        for half in samples.halves(&leaf, first, &mut order) {
            let mass = samples.mass(&order[half.samples.clone()]);
            let prior = prior_of(&half.low, &half.size, nearest);
            grown.push(Grown { axis: 0, first: 0, volume, prior, deviation: (volume * mass).sqrt() });
            heap.extend(samples.looked_at(half, &order, volume));
        }
    }
    let leaves = grown.iter().filter(|node| node.first == 0);
    let aimed: f64 = leaves.map(|leaf| leaf.deviation).sum();
    Ok((nodes_of(&grown, least), aimed / whole.deviation))
}

#[derive(Clone, Copy)]
struct Samples<'a> {
    numbers: &'a [Numbers],
    masses: &'a [f32],
}

impl Samples<'_> {
    fn mass(&self, of: &[u32]) -> f64 {
        of.iter().map(|&i| f64::from(self.masses[i as usize])).sum()
    }

    /// A box with the axis along which its photons differ most, if they do by more than chance.
    fn looked_at(&self, mut leaf: Leaf, order: &[u32], volume: f64) -> Option<Leaf> {
        let own = &order[leaf.samples.clone()];
        if own.len() < TELLING || leaf.depth + 1 >= MOST_DEPTH {
            return None;
        }
        let (mut parts, mut sum, mut squares) = ([[0.0f64; PARTS]; 4], 0.0, 0.0);
        for &i in own {
            let mass = f64::from(self.masses[i as usize]);
            (sum, squares) = (sum + mass, squares + mass * mass);
            for (axis, parts) in parts.iter_mut().enumerate() {
                let at = (f64::from(self.numbers[i as usize][axis]) - leaf.low[axis]) / leaf.size[axis];
                parts[((at * PARTS as f64) as usize).min(PARTS - 1)] += mass;
            }
        }
        let deviation = (volume * sum).sqrt();
        let chance = (PARTS - 1) as f64 / 8.0 * squares / (sum * sum);
        for (axis, parts) in parts.iter().enumerate() {
            // Halves of what is narrower than float32 tells are no halves.
            if leaf.size[axis] < 1e-9 || (leaf.low[axis] > 0.0 && leaf.size[axis] < 1e-6 * leaf.low[axis]) {
                continue;
            }
            let apart: f64 = parts.iter().map(|mass| (volume / PARTS as f64 * mass).sqrt()).sum();
            let gain = deviation - apart;
            if gain > SIGNIFICANT * chance * deviation && gain > leaf.gain {
                (leaf.gain, leaf.axis) = (gain, axis);
            }
        }
        (leaf.gain > 0.0).then_some(leaf)
    }

    /// Both halves of a box.
    fn halves(&self, leaf: &Leaf, first: usize, order: &mut [u32]) -> [Leaf; 2] {
        let (axis, range) = (leaf.axis, leaf.samples.clone());
        let mut size = leaf.size;
        size[axis] /= 2.0;
        let middle = leaf.low[axis] + size[axis];
        let own = &mut order[range.clone()];
        own.sort_by_key(|&i| f64::from(self.numbers[i as usize][axis]) >= middle);
        let lower = own.partition_point(|&i| f64::from(self.numbers[i as usize][axis]) < middle);
        let split = range.start + lower;
        [(leaf.low[axis], range.start..split), (middle, split..range.end)].map(|(begin, samples)| {
            let mut low = leaf.low;
            low[axis] = begin;
            let node = first + usize::from(begin == middle);
            Leaf { node, low, size, depth: leaf.depth + 1, samples, gain: 0.0, axis: 0 }
        })
    }
}

/// Nodes with their probabilities: those of leaves by their deviations, and a share as they were before.
fn nodes_of(grown: &[Grown], least: f64) -> Vec<Node> {
    let all: f64 = grown.iter().filter(|node| node.first == 0).map(|node| node.deviation).sum();
    let mut likely = vec![0.0; grown.len()];
    for (at, node) in grown.iter().enumerate().rev() {
        likely[at] = if node.first > 0 {
            likely[node.first] + likely[node.first + 1]
        } else if all > 0.0 {
            least * node.prior + (1.0 - least) * node.deviation / all
        } else {
            node.prior
        };
    }
    let of_one = |node: &Grown| {
        if node.first == 0 {
            return [0.0; 4];
        }
        let share = likely[node.first] / (likely[node.first] + likely[node.first + 1]);
        let share = share.clamp(LEAST_SHARE, 1.0 - LEAST_SHARE);
        [node.axis as f32, share as f32, node.first as f32, 0.0]
    };
    grown.iter().map(of_one).collect()
}

/// By which two numbers rays of a light afar, where they start and where to, start on a disc about a place, and how
/// much larger it is than the one about the scene (glsl/lib/aim.glsl).
pub fn discs_about(middle: Vector64, rays: &[[f64; 6]]) -> (Vec<[f32; 2]>, Vec<f64>) {
    rays.par_iter().with_min_len(FEW).map(|ray| disc_about(middle, ray)).unzip()
}

fn disc_about(middle: Vector64, [ox, oy, oz, dx, dy, dz]: &[f64; 6]) -> ([f32; 2], f64) {
    let (origin, direction) = ([*ox, *oy, *oz], [*dx, *dy, *dz]);
    let (across, up) = frame_about64(direction);
    let radius = -dot64(origin, direction);
    let aside = [across, up].map(|axis| dot64(axis, middle));
    let place = [dot64(across, origin) - aside[0], dot64(up, origin) - aside[1]];
    let reach = radius + (aside[0] * aside[0] + aside[1] * aside[1]).sqrt();
    let reach = if reach > 0.0 { reach } else { 1.0 };
    let turn = (place[1].atan2(place[0]) / std::f64::consts::TAU).rem_euclid(1.0);
    let share = (place[0] * place[0] + place[1] * place[1]) / (reach * reach);
    let larger = reach / if radius > 0.0 { radius } else { 1.0 };
    ([share, turn].map(|x| (x as f32).clamp(0.0, 1.0 - f32::EPSILON / 2.0)), larger * larger)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Even numbers, which count in a small box alone.
    fn counting(high: f32) -> (Vec<Numbers>, Vec<f32>) {
        let numbers: Vec<Numbers> = (0..1 << 14).map(|i| random4(1, 2, i, 3)).collect();
        let masses = numbers.iter().map(|at| f32::from(at[0] < high && at[2] < high)).collect();
        (numbers, masses)
    }

    #[test]
    fn photons_go_where_they_count() {
        let (numbers, masses) = counting(0.125);
        let (nodes, deviation) = tree(&numbers, &masses, 0.25, 1.0).unwrap();
        assert!((deviation - 0.125).abs() < 0.02, "{deviation}");
        let photons: Vec<u32> = (0..numbers.len() as u32).collect();
        let (found, weights) = aimed_photons(&nodes, 0, 5, 6, &photons, &numbers);
        let counts = |at: &Numbers| at[0] < 0.125 && at[2] < 0.125;
        let share = found.iter().filter(|at| counts(at)).count() as f64 / found.len() as f64;
        assert!((share - 0.754).abs() < 0.03, "{share}");
        // As much flux as before, in the box and in all.
        let flux = |inside: bool| -> f64 {
            let both = found.iter().zip(&weights).filter(|(at, _)| !inside || counts(at));
            both.map(|(_, &weight)| f64::from(weight)).sum::<f64>() / found.len() as f64
        };
        assert!((flux(true) * 64.0 - 1.0).abs() < 0.03 && (flux(false) - 1.0).abs() < 0.03);
        for (pdf, weight) in pdf(&nodes, &found).iter().zip(&weights) {
            assert!((pdf * weight - 1.0).abs() < 1e-5 && *weight < 4.1);
        }
    }

    #[test]
    fn chance_alone_splits_nothing() {
        let (numbers, masses) = counting(1.0);
        assert_eq!(tree(&numbers, &masses, 0.25, 1.0).unwrap().0.len(), 1);
        assert_eq!(tree(&[], &[], 0.25, 1.0).unwrap(), (vec![[0.0; 4]], 1.0));
    }

    /// Of a disc's rings of double the radius each is as likely, though no sample was there.
    #[test]
    fn all_distances_are_looked_at() {
        let numbers: Vec<Numbers> = (0..4096).map(|i| random4(1, 2, i, 3)).collect();
        let near: Vec<Numbers> = numbers.iter().map(|&[a, b, c, d]| [a, b, 1e-6 * c, d]).collect();
        let (nodes, _) = tree(&near, &vec![1.0; near.len()], 0.25, 1e-6).unwrap();
        let ring = |radius2: f32| pdf(&nodes, &[[0.5, 0.5, 0.75 * radius2, 0.5]])[0] * radius2 * 0.5;
        for halvings in 1..18 {
            let share = ring(0.5f32.powi(halvings));
            assert!((0.004..0.03).contains(&share) || halvings == 1, "{halvings}: {share}");
        }
    }

    #[test]
    fn bad_input() {
        assert!(tree(&[], &[], 0.25, 0.0).is_err());
        assert!(tree(&[[0.0, 1.0, 0.0, 0.0]], &[1.0], 0.25, 1.0).is_err());
        assert!(tree(&[[0.0; 4]], &[f32::NAN], 0.25, 1.0).is_err());
        assert!(tree(&[[0.0; 4]], &[-1.0], 0.25, 1.0).is_err());
    }
}
