# SPDX-License-Identifier: GPL-3.0-or-later
"""Caustics by brute force: light is traced from a lamp by way of smooth glass and metal to where it
falls on anything else, in numpy. Of the renderer it uses the tree of triangles alone: there is no
estimate, no radius and no aim."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
import photon_stream_native as native
from numpy.typing import NDArray

from addon.photon.scene import Light, Material, Scene

Points = NDArray[np.float64]
LONGEST = 24  # surfaces met
NEAREST = 1e-9  # of an index to 1, where nothing is refracted


class Arrivals(NamedTuple):
    """Where light falls."""

    at: Points  # (n, 3) [m]
    flux: Points  # (n, 3) [W]
    triangle: NDArray[np.int64]  # (n,)
    index: Points  # (n,) of the glass that it is in there, over that where it began


def arrivals(
    scene: Scene, light: Light, rays: int, middle: Any, radius: float, seed: int = 1
) -> Arrivals:
    """What a lamp sends through a ball that holds all glass and metal, and that comes to other
    surfaces by way of some."""
    rng = np.random.default_rng(seed)
    at, way, flux = _from_lamp(light, rays, np.asarray(middle, float), radius, rng)
    vertices = (scene.vertices - middle).astype(np.float32)  # the tree's float32 are finest there
    nodes, order, *_ = native.build_bvh(vertices, scene.triangles)
    corners = vertices[scene.triangles[order]]
    normals, worn = scene.corner_normals[order].astype(float), scene.material[order]
    at, last = at - middle, np.full(rays, -1, np.int32)
    found: list[Arrivals] = []
    index = np.ones(rays)
    for met in range(LONGEST):
        endless = np.full(len(at), np.inf, np.float32)
        t, hit, u, v = native.trace(
            nodes, corners, at.astype(np.float32), way.astype(np.float32), endless, last
        )
        there = hit >= 0
        t, hit, u, v = (x[there] for x in (t, hit, u, v))
        at, way, flux, index = (x[there] for x in (at, way, flux, index))
        at, last = at + t[:, None].astype(float) * way, hit
        bary = np.stack([1 - u - v, u, v], -1)[..., None].astype(float)
        normal = (normals[hit] * bary).sum(axis=1)
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        a, b, c = np.moveaxis(corners[hit].astype(float), 1, 0)
        flat = np.cross(b - a, c - a)
        goes_on = np.zeros(len(hit), bool)
        onward = np.zeros_like(way)
        for number in np.unique(worn[hit]):
            which = worn[hit] == number
            bent = _scattered(scene.materials[number], way[which], normal[which], flat[which], rng)
            if bent is None:
                if met:
                    there = at[which] + middle, flux[which], order[hit[which]], index[which]
                    found.append(Arrivals(*there))
                continue
            onward[which], weight, goes_on[which], times = bent
            index[which] *= times
            flux[which] *= weight * _by_normals(way[which], bent[0], normal[which], flat[which])
        at, way, flux, last = at[goes_on], onward[goes_on], flux[goes_on], last[goes_on]
        index = index[goes_on]
    return Arrivals(*(np.concatenate(x) for x in zip(*found, strict=True)))


def is_caster(material: Material) -> bool:
    """Whether it is smooth glass or metal."""
    return [lobe.kind for lobe in material.lobes] in (["glass"], ["ggx_metal"], ["mirror"])


def _from_lamp(
    light: Light, rays: int, middle: Points, radius: float, rng: np.random.Generator
) -> tuple[Points, Points, Points]:
    """Origins, unit directions and flux of rays through a ball, evenly over solid angle or area."""
    u, power = rng.random((rays, 4)), np.array(light.power)
    if light.kind == "sun":
        cosine, turn = 1.0 - u[:, 0] * light.parameters["widest"], 2 * math.pi * u[:, 1]
        way = _about(np.array(light.direction), cosine, turn)
        across = _about(way, np.zeros(rays), 2 * math.pi * u[:, 2])
        at = middle - 10 * radius * way + across * (radius * np.sqrt(u[:, 3:]))
        return at, way, np.broadcast_to(power * (math.pi * radius**2 / rays), (rays, 3)).copy()
    to = middle - light.position
    far = np.linalg.norm(to)
    least = math.sqrt(1.0 - (radius / far) ** 2)
    way = _about(to / far, 1.0 - u[:, 0] * (1.0 - least), 2 * math.pi * u[:, 1])
    flux = np.full(rays, (1.0 - least) / 2.0 / rays)  # of the sphere of directions
    if light.kind == "spot":
        axis = np.array(light.direction) / np.linalg.norm(light.direction)
        outer, inner = (light.parameters[x] for x in ("outer", "inner"))
        t = np.clip((outer - (1.0 - way @ axis)) / (outer - inner), 0.0, 1.0)
        flux *= t * t * (3.0 - 2.0 * t)
    disc = _about(way, np.zeros(rays), 2 * math.pi * u[:, 2])  # of a lamp of soft falloff
    at = light.position + disc * (light.parameters["radius"] * np.sqrt(u[:, 3:]))
    return at, way, flux[:, None] * power


def _about(axis: Points, cosine: Points, turn: Points) -> Points:
    """Unit vectors at an angle to an axis, or each to its own."""
    axis = np.broadcast_to(axis, (len(turn), 3))
    helper = np.where(np.abs(axis[:, :1]) < 0.9, (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    x = np.cross(axis, helper)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    y, sine = np.cross(axis, x), np.sqrt(np.maximum(0.0, 1.0 - cosine**2))[:, None]
    around = np.cos(turn)[:, None] * x + np.sin(turn)[:, None] * y
    return cosine[:, None] * axis + sine * around


def _by_normals(way: Points, onward: Points, normal: Points, flat: Points) -> Points:
    """(n, 1) what normals that are not the triangles' make of the flux (Veach 1997, sec. 5.3.2)."""
    met, left = ((x * normal).sum(axis=1) / (x * flat).sum(axis=1) for x in (way, onward))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.clip(np.nan_to_num(met / left), 0.0, 16.0)[:, None]


def _scattered(
    material: Material, way: Points, normal: Points, flat: Points, rng: np.random.Generator
) -> tuple[Points, Points, Any, Any] | None:
    """Directions, weights, whether it goes on, and by what the index changes, of light that meets
    smooth glass or metal; None: it is of another kind."""
    if not is_caster(material):
        return None
    (lobe,) = material.lobes
    enters = (way * flat).sum(axis=1) < 0
    outward = np.where(enters[:, None], 1.0, -1.0)
    normal, flat = normal * outward, flat * outward
    cosine = -(way * normal).sum(axis=1)
    faces = cosine > 0  # else its smooth normal looks away
    cosine = np.maximum(cosine, 1e-9)
    mirrored = way + 2 * cosine[:, None] * normal
    colour = np.array(lobe.colour)
    if lobe.kind != "glass":
        assert lobe.parameters.get("alpha_x", 0.0) == 0.0
        rises = (1.0 - colour) * (1.0 - cosine[:, None]) ** 5  # Schlick 1994
        weight = colour + rises if lobe.kind == "ggx_metal" else np.broadcast_to(colour, way.shape)
        return mirrored, weight, faces & ((mirrored * flat).sum(axis=1) > 0), 1.0
    ior = np.where(enters, lobe.parameters["ior"], 1.0 / lobe.parameters["ior"])
    below2 = 1.0 - (1.0 - cosine**2) / ior**2
    below = np.sqrt(np.maximum(below2, 0.0))
    s, p = (
        (cosine - ior * below) / (cosine + ior * below),
        (ior * cosine - below) / (ior * cosine + below),
    )
    reflected = np.where(below2 > 0.0, 0.5 * (s * s + p * p), 1.0)
    bounces = rng.random(len(way)) < reflected
    through = way / ior[:, None] + (cosine / ior - below)[:, None] * normal
    onward = np.where(bounces[:, None], mirrored, through)
    right = (onward * flat).sum(axis=1) * np.where(bounces, 1.0, -1.0) > 0
    crossed = np.where(bounces, 1.0, ior)
    if lobe.parameters["open"] == 0.0:
        return onward, np.broadcast_to(colour, way.shape), faces & right, crossed
    return onward, colour / crossed[:, None] ** 2, faces & right, 1.0  # sheets, as in Cycles
