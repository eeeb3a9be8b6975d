# SPDX-License-Identifier: GPL-3.0-or-later
"""Light tracing that sees a flat mirror's image of a caustic too: for references, no contender.

Mitsuba's ptracer connects each hit of a light path with the camera; what the camera sees in a
mirror it never finds, and a path tracer never finds a delta light's caustic. Here each hit is also
connected with the camera's mirror image behind every flat mirror, through that mirror. The estimate
is unbiased where the camera sees no curved mirror and no mirror in a mirror.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from addon.photon.scene import Scene

from ..plain import specular_of
from .mitsuba import BOUNCES, choose_variant, to_mitsuba, to_sensor
from .steps import Budget, Seconds, Step, doubling, now

METHODS = {"Light tracing with a mirrored camera": "light"}
LIGHT_PATHS = 8  # a pixel in one launch
SURVIVAL = 0.95  # of Russian roulette, at most
ROULETTE = 5  # bounces without it


class View(NamedTuple):
    """The camera, or its image in a flat mirror."""

    sensor: Any
    tint: Any  # reflectance of the mirror; 1 for the camera itself
    mirror: int  # index of the mirror's mesh in the scene; -1 for the camera itself


class Engine:
    """Light tracing in Mitsuba with one scene loaded."""

    def __init__(self) -> None:
        self.about = f"light tracing in Mitsuba {mi.__version__}, {choose_variant()}"

    def load(self, snapshot: Path, blend: Path, size: int) -> None:
        source = Scene.load(snapshot)
        self.scene, self.size = mi.load_dict(to_mitsuba(source, size)), size
        self.views = [View(self.scene.sensors()[0], mi.Color3f(1.0), -1)]
        names = [shape.id() for shape in self.scene.shapes()]
        for index, plane in flat_mirrors(source):
            matrix = reflection(*plane) @ source.camera.matrix
            sensor = mi.load_dict(to_sensor(replace(source.camera, matrix=matrix), size))
            tint = mi.Color3f(list(specular_of(source.materials[index])[0]))
            self.views.append(View(sensor, tint, names.index(f"mesh{index}")))

    def climb(self, method: str, seed: int, budget: Budget) -> Iterator[Step]:
        """Pictures of 8, 16, 32, ... light paths a pixel."""
        total, launches, seconds = 0.0, 0, Seconds()
        for effort in doubling():
            while launches < effort:
                start = now()
                total = total + self._launch(seed * 1_000_003 + launches)
                seconds += now() - start
                launches += 1
            yield Step(LIGHT_PATHS * launches, seconds, partial(np.divide, total, launches))
            if not budget.fits():
                return

    def _launch(self, seed: int) -> Any:
        paths = LIGHT_PATHS * self.size**2
        sampler = mi.load_dict({"type": "independent"})
        sampler.seed(seed % 2**32, paths)
        image = dr.zeros(mi.Float, 3 * self.size**2)
        self._trace(sampler, image)
        pixels = np.array(image, np.float64).reshape(self.size, self.size, 3)
        return pixels[::-1] / LIGHT_PATHS

    @dr.syntax
    def _trace(self, sampler: Any, image: Any) -> None:
        """Add light paths, one an element of the sampler, to the image."""
        index, weight, _ = self.scene.sample_emitter(sampler.next_1d())
        emitter = dr.gather(mi.EmitterPtr, self.scene.emitters_dr(), index)
        ray, flux = emitter.sample_ray(0.0, sampler.next_1d(), sampler.next_2d(), sampler.next_2d())
        throughput = flux * weight
        context = mi.BSDFContext(mi.TransportMode.Importance)
        depth, active = mi.UInt32(0), dr.max(throughput) > 0
        while active:
            si = self.scene.ray_intersect(ray, active)
            active &= si.is_valid()
            bsdf = si.bsdf(ray)
            for view in self.views:
                self._connect(view, si, bsdf, context, throughput, sampler, image, mi.Bool(active))
            bs, value = bsdf.sample(context, si, sampler.next_1d(), sampler.next_2d(), active)
            throughput *= value * adjoint(si, bs.wo)
            depth += 1
            survival = dr.minimum(dr.max(throughput) / dr.max(flux * weight), SURVIVAL)
            survival = dr.select(depth > ROULETTE, survival, 1.0)
            active &= (sampler.next_1d() < survival) & (depth < BOUNCES)
            throughput *= dr.rcp(dr.maximum(survival, 1e-12))
            active &= dr.max(throughput) > 0
            ray = si.spawn_ray(si.to_world(bs.wo))

    def _connect(
        self, view: View, si: Any, bsdf: Any, context: Any, throughput: Any, sampler: Any,
        image: Any, active: Any,
    ) -> None:  # fmt: skip
        """Add what the hits send into a view."""
        ds, importance = view.sensor.sample_direction(si, sampler.next_2d(), active)
        active &= (ds.pdf > 0) & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
        to_view = si.spawn_ray_to(ds.p)
        if view.mirror < 0:
            active &= ~self.scene.ray_test(to_view, active)
        else:
            glass = self.scene.ray_intersect(to_view, active)
            mirror = dr.gather(mi.ShapePtr, self.scene.shapes_dr(), mi.UInt32(view.mirror))
            active &= glass.is_valid() & (glass.shape == mirror)
            camera = mi.Point3f(self.views[0].sensor.world_transform().translation())
            active &= ~self.scene.ray_test(glass.spawn_ray_to(camera), active)
        wo = si.to_local(to_view.d)
        value = throughput * bsdf.eval(context, si, wo, active) * adjoint(si, wo)
        value *= importance * view.tint
        pixel = mi.Point2u(mi.Point2f(ds.uv))
        active &= (pixel.x < self.size) & (pixel.y < self.size)
        place = 3 * (pixel.y * self.size + pixel.x)
        for channel in range(3):
            dr.scatter_add(image, value[channel], place + channel, active)


def adjoint(si: Any, wo: Any) -> Any:
    """The factor by which shading normals make light's scattering differ (Veach 1997, 5.3.2)."""
    towards, away = dr.dot(si.to_world(si.wi), si.n), dr.dot(si.to_world(wo), si.n)
    below = mi.Frame3f.cos_theta(wo) * towards
    factor = dr.abs(mi.Frame3f.cos_theta(si.wi) * away / below)
    valid = (towards * mi.Frame3f.cos_theta(si.wi) > 0) & (away * mi.Frame3f.cos_theta(wo) > 0)
    return dr.select(valid, factor, 0.0)


def flat_mirrors(scene: Scene) -> list[tuple[int, tuple[Any, Any]]]:
    """(index of the material, (point, unit normal)) of every mirror that lies in one plane."""
    found = []
    for index, material in enumerate(scene.materials):
        corners = scene.vertices[scene.triangles[scene.material == index]].reshape(-1, 3)
        specular, exponent = specular_of(material)
        if max(specular) <= 0 or math.isfinite(exponent) or not len(corners):
            continue
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
        normal /= np.linalg.norm(normal)
        if np.abs((corners - corners[0]) @ normal).max() < 1e-5:
            found.append((index, (corners[0], normal)))
    return found


def reflection(point: Any, normal: Any) -> Any:
    """The 4x4 matrix that mirrors about a plane."""
    matrix = np.eye(4)
    matrix[:3, :3] -= 2 * np.outer(normal, normal)
    matrix[:3, 3] = 2 * (point @ normal) * normal
    return matrix
