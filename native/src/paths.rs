// SPDX-License-Identifier: GPL-3.0-or-later
//! A pass's photons from the lights to where they end: what generator.glsl, tracer.glsl,
//! projector.glsl and reflector.glsl do in turns, with the same random numbers.

use std::f32::consts::PI;

use rayon::prelude::*;

use crate::aim;
use crate::bent::BRIGHTEST;
use crate::emission::{Emission, Photon, direction_from_versine, generate, sample_disc, shift_of};
use crate::lanes::widest;
use crate::packing::{flux_with_direction, pack_direction};
use crate::portals::{Portal, Portals};
use crate::random::{DIMENSION_REFLECT, random4};
use crate::trace::{T_MAX, Tree};
use crate::vector::{Vector, dot, from_frame, largest, normal_of, point_in};
use crate::watertight::{Hit, Ray, lift_at};
use crate::wide::Stack;

const FIRST_HIT: f32 = 0.5; // as in glsl/kernels/projector.glsl
const PHOTONS_A_TASK: usize = 1024;
/// Of what a diffuse surface scatters, what goes through portals at least, as in glsl/lib/photon_roulette.glsl.
const LEAST_BY_PORTAL: f32 = 0.2;

/// What photons meet: scenes whose materials have Lambert's lobe and a mirror or Phong's at most, and whose
/// lights are points and spots. The GLSL does all others.
#[derive(Clone, Copy)]
pub struct Scene<'a> {
    pub tree: &'a Tree,
    /// Of the triangles in leaf order; the fourth numbers are material, surface and the number in the scene.
    pub corners: &'a [[[f32; 4]; 3]],
    /// At the corners; the fourth numbers mean nothing.
    pub normals: &'a [[[f32; 4]; 3]],
    /// PlainMaterial of layouts.rs. A photon on a material that is not here ends.
    pub materials: &'a [[[f32; 4]; 2]],
    /// PlainLight of layouts.rs.
    pub lights: &'a [[[f32; 4]; 4]],
    /// LightAim of layouts.rs for each light, or none: nothing is aimed.
    pub aims: &'a [[f32; 4]],
    /// AimNode.
    pub aim_nodes: &'a [aim::Node],
    /// Through which photons go on from diffuse surfaces; none: by the cosine alone.
    pub portals: &'a [Portal],
}

/// Where photons landed on diffuse surfaces, in order of bounce and photon.
#[derive(Default)]
pub struct Landed {
    /// Positions, and surfaces plus one.
    pub places: Vec<[f32; 4]>,
    /// Fluxes, and packed normals.
    pub deposits: Vec<[f32; 4]>,
    /// How many of `places` each bounce ends at.
    ends: Vec<usize>,
    /// Photons that the limit of bounces cut off.
    pub unfinished: usize,
}

/// Trace photons until all are absorbed, have left, or have bounced as often as they may.
pub fn trace_photons(scene: &Scene, emission: &Emission) -> Landed {
    let chunks = (emission.photons as usize).div_ceil(PHOTONS_A_TASK);
    let parts: Vec<Landed> = (0..chunks)
        .into_par_iter()
        .map(|chunk| {
            let first = (chunk * PHOTONS_A_TASK) as u32;
            let count = (emission.photons - first).min(PHOTONS_A_TASK as u32);
            let mut landed = Landed::default();
            trace_chunk(scene, emission, first, count, &mut landed);
            landed
        })
        .collect();
    let mut all = Landed::default();
    let total = parts.iter().map(|part| part.places.len()).sum();
    all.places.reserve_exact(total);
    all.deposits.reserve_exact(total);
    for bounce in 0..parts.iter().map(|part| part.ends.len()).max().unwrap_or(0) {
        for part in parts.iter().filter(|part| bounce < part.ends.len()) {
            let first = if bounce > 0 { part.ends[bounce - 1] } else { 0 };
            all.places.extend_from_slice(&part.places[first..part.ends[bounce]]);
            all.deposits.extend_from_slice(&part.deposits[first..part.ends[bounce]]);
        }
        all.ends.push(all.places.len());
    }
    all.unfinished = parts.iter().map(|part| part.unfinished).sum();
    all
}

widest! {
    fn trace_chunk<L>(scene: &Scene, emission: &Emission, first: u32, count: u32, landed: &mut Landed) {
        let mut stack = Stack::new();
        let mut paths = Vec::with_capacity(count as usize);
        let shift = shift_of(emission);
        for number in first..first + count {
            paths.extend(generate(scene, emission, number, shift));
        }
        for bounce in 0..=emission.bounces {
            let mut alive = 0;
            for at in 0..paths.len() {
                let photon: Photon = paths[at];
                let Some(ray) = Ray::new(photon.origin, photon.direction) else { continue };
                let Some((position, hit)) = scene.tree.closest::<L>(&ray, T_MAX, photon.source, |_| true, &mut stack)
                else {
                    continue;
                };
                let Some(surface) = Surface::at(scene, position, hit, photon.direction) else { continue };
                if (bounce > 0 || emission.first_hits) && surface.gathers {
                    let [x, y, z] = surface.position;
                    let to_light = photon.direction.map(|x| -x);
                    let [r, g, b] = if emission.directions {
                        flux_with_direction(photon.flux, to_light)
                    } else {
                        photon.flux
                    };
                    let flux = if emission.numbered {
                        [r + g + b, photon.number as f32 + if bounce == 0 { FIRST_HIT } else { 0.0 }, 0.0]
                    } else {
                        [r, g, b]
                    };
                    landed.places.push([x, y, z, surface.side * (surface.surface + 1.0)]);
                    landed.deposits.push([flux[0], flux[1], flux[2], pack_direction(surface.geometric)]);
                }
                if let Some(next) = reflect(scene, emission, bounce, &photon, &surface, position) {
                    paths[alive] = next;
                    alive += 1;
                }
            }
            paths.truncate(alive);
            landed.ends.push(landed.places.len());
            if paths.is_empty() {
                break;
            }
        }
        landed.unfinished = paths.len();
    }
}

/// Where a photon meets a triangle (glsl/lib/surface.glsl and material.glsl).
struct Surface {
    position: Vector,
    geometric: Vector,
    shading: Vector,
    side: f32,
    surface: f32,
    diffuse: Vector,
    specular: Vector,
    exponent: f32,
    gathers: bool,
}

impl Surface {
    fn at(scene: &Scene, position: i32, hit: Hit, direction: Vector) -> Option<Surface> {
        let triangle = &scene.corners[position as usize];
        let material = triangle[0][3];
        let [[dr, dg, db, exponent], [sr, sg, sb, gathers]] = *scene.materials.get(material as usize)?;
        let geometric = normal_of(triangle);
        let side = if dot(geometric, direction) > 0.0 { -1.0 } else { 1.0 };
        let geometric = geometric.map(|n| n * side);
        let shading = point_in(&scene.normals[position as usize], hit.u, hit.v);
        let length2 = dot(shading, shading);
        let shading = if length2 > 1.0e-30 { shading.map(|n| n / length2.sqrt()) } else { geometric };
        let shading = if dot(shading, geometric) < 0.0 { shading.map(|n| -n) } else { shading };
        Some(Surface {
            position: point_in(triangle, hit.u, hit.v),
            geometric,
            shading,
            side,
            surface: triangle[1][3],
            diffuse: [dr, dg, db],
            specular: [sr, sg, sb],
            exponent,
            gathers: largest([dr, dg, db]) > 0.0 || gathers > 0.0,
        })
    }
}

/// How Lambert's lobe scatters: by the cosine, and through portals whom it would absorb.
struct Scattering<'a> {
    surface: &'a Surface,
    by_cosine: f32,
    by_portal: f32,
    portals: Option<Portals>,
}

impl Scattering<'_> {
    /// `diffuse`, `specular`: what the lobes leave of a photon's flux.
    fn of<'a>(scene: &Scene, surface: &'a Surface, diffuse: f32, specular: f32) -> Scattering<'a> {
        let portals = if diffuse > 0.0 && !scene.portals.is_empty() {
            Portals::seen(scene.portals, surface.position, surface.geometric)
        } else {
            None
        };
        if portals.is_none() {
            return Scattering { surface, by_cosine: diffuse, by_portal: 0.0, portals };
        }
        let absorbed = (1.0 - diffuse - specular).max(0.0);
        let by_portal = absorbed.max(LEAST_BY_PORTAL * diffuse);
        Scattering { surface, by_cosine: diffuse - (by_portal - absorbed), by_portal, portals }
    }

    /// A direction, and what flux that goes there is multiplied by.
    fn to(&self, outgoing: Vector) -> (Vector, Vector) {
        let albedo = self.surface.diffuse;
        let Some(portals) = &self.portals else { return (outgoing, albedo.map(|k| k / self.by_cosine)) };
        let cosine = dot(outgoing, self.surface.geometric).max(0.0) / PI;
        let density = self.by_cosine * cosine + self.by_portal * portals.pdf(outgoing);
        let share = cosine / density.max(1.0e-30);
        (outgoing, albedo.map(|k| k * share))
    }
}

/// reflector.glsl: None if the photon is absorbed.
fn reflect(
    scene: &Scene,
    emission: &Emission,
    bounce: u32,
    photon: &Photon,
    surface: &Surface,
    position: i32,
) -> Option<Photon> {
    let dimension = DIMENSION_REFLECT + bounce;
    let u = random4(emission.seed, emission.pass_index, photon.number, dimension);
    let specular = share_left(photon.flux, surface.specular);
    let diffuse = share_left(photon.flux, surface.diffuse);
    let scattering = Scattering::of(scene, surface, diffuse, specular);
    let diffuse = scattering.by_cosine;
    let (outgoing, weight) = if u[0] < diffuse {
        let disc = sample_disc([u[1], u[2]]);
        let up = (1.0 - disc[0] * disc[0] - disc[1] * disc[1]).max(0.0).sqrt();
        scattering.to(from_frame(surface.geometric, [disc[0], disc[1], up]))
    } else if u[0] < diffuse + specular {
        // What flux that fell on the triangle is on the lobe, and leaves it.
        let bent = |normal: Vector, outgoing: Vector, weight: Vector| {
            let falls = dot(photon.direction, normal) / dot(photon.direction, surface.geometric);
            let leaves = dot(outgoing, normal);
            let times = falls * dot(outgoing, surface.geometric) / leaves;
            weight.map(|w| if leaves > 0.0 { w * times.clamp(0.0, BRIGHTEST) } else { 0.0 })
        };
        let incoming = photon.direction;
        let normal = raised_normal(surface.shading, surface.geometric, incoming.map(|d| -d));
        let along = 2.0 * dot(incoming, normal);
        let mirrored: Vector = std::array::from_fn(|k| incoming[k] - along * normal[k]);
        let weight = surface.specular.map(|k| k / specular);
        if surface.exponent < 0.0 {
            (mirrored, bent(normal, mirrored, weight))
        } else {
            let cosine = (1.0 - u[1]).powf(1.0 / (surface.exponent + 1.0));
            let outgoing = from_frame(mirrored, direction_from_versine(1.0 - cosine, u[2]));
            let lobe = (surface.exponent + 2.0) / (surface.exponent + 1.0);
            let lobe = lobe * dot(outgoing, normal).max(0.0);
            (outgoing, bent(normal, outgoing, weight.map(|w| w * lobe)))
        }
    } else if let Some(portals) = &scattering.portals {
        let which = ((u[0] - diffuse - specular) / scattering.by_portal).clamp(0.0, 0.999_999_94);
        scattering.to(portals.sample([which, u[1]]))
    } else {
        return None;
    };
    let flux: Vector = std::array::from_fn(|k| photon.flux[k] * weight[k]);
    if dot(outgoing, surface.geometric) <= 0.0 || largest(flux) <= 0.0 {
        return None;
    }
    let lift = lift_at(surface.position);
    Some(Photon {
        origin: std::array::from_fn(|k| surface.position[k] + surface.geometric[k] * lift),
        source: position,
        direction: outgoing,
        flux,
        number: photon.number,
    })
}

/// The normal of lobes (glsl/lib/lobe.glsl).
fn raised_normal(shading: Vector, geometric: Vector, to_viewer: Vector) -> Vector {
    let up = dot(to_viewer, geometric).max(0.0);
    let least = (0.9 * up).min(0.01);
    let (along, above) = (2.0 * dot(shading, to_viewer), dot(shading, geometric));
    let mirrored: Vector = std::array::from_fn(|k| along * shading[k] - to_viewer[k]);
    let x: Vector = std::array::from_fn(|k| shading[k] - above * geometric[k]);
    let length2 = dot(x, x);
    if dot(mirrored, geometric) >= least || length2 < 1.0e-12 {
        return shading;
    }
    let x = x.map(|x| x / length2.sqrt());
    let aside = dot(to_viewer, x);
    let a = (aside * aside + up * up).max(1.0e-12);
    let (b, c) = (2.0 * (a + up * least), (least + up) * (least + up));
    let root = (b * b - 4.0 * a * c).max(0.0).sqrt();
    let z2 = (0.25 * (b + if aside < 0.0 { root } else { -root }) / a).clamp(0.0, 1.0);
    std::array::from_fn(|k| (1.0 - z2).sqrt() * x[k] + z2.sqrt() * geometric[k])
}

fn mean(v: Vector) -> f32 {
    (v[0] + v[1] + v[2]) * (1.0 / 3.0)
}

/// colour.glsl: what a colour leaves of a flux, in the mean of its channels.
fn share_left(flux: Vector, colour: Vector) -> f32 {
    mean(std::array::from_fn(|k| flux[k] * colour[k])) / mean(flux).max(1.0e-30)
}
