# SPDX-License-Identifier: GPL-3.0-or-later
"""Our Scene in LuxCore: its path tracer without and with PhotonGI, and its bidirectional one with
vertex merging as contenders.

Perfect mirrors, smooth glass and diffuse surfaces are LuxCore's own; it has no Phong lobe, and
rough glass of another distribution, so scenes with one are refused. Blender's spotlight profile is
a light of type `mappoint`, a map over all directions.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pyluxcore

from addon.photon.scene import Camera, Light, Material, Scene

from ..plain import check_converted, cone_of, glass_of, specular_of
from ..spot import spot_profile
from .steps import Budget, Seconds, Step, now

METHODS = {"LuxCore path": "path", "LuxCore PhotonGI": "photongi", "LuxCore BiDirVM": "vcm"}
ROWS, COLUMNS = 4096, 8  # of a spotlight's map: angle from the axis by angle about it
BOUNCES = 64
EPSILON = {"min": 1e-5, "max": 1e-4}
FIRST = 0.25  # [s] until the first picture; then twice as long each time

_SETTINGS: dict[str, dict[str, Any]] = {
    "path": {"renderengine.type": "PATHCPU", "sampler.type": "SOBOL"},
    "photongi": {
        "renderengine.type": "PATHCPU",
        "sampler.type": "SOBOL",
        "path.photongi.indirect.enabled": True,
        "path.photongi.photon.maxcount": 2_000_000,  # the least it traces; 20 million by default
        "path.photongi.photon.maxdepth": BOUNCES,
        "path.photongi.caustic.updatespp": 8,  # BlendLuxCore's default
    },
    "vcm": {"renderengine.type": "BIDIRVMCPU", "sampler.type": "RANDOM"},
}


class Engine:
    """LuxCore with one scene loaded."""

    def __init__(self) -> None:
        pyluxcore.Init()
        self.about = f"LuxCore {pyluxcore.Version()}"

    def load(self, snapshot: Path, blend: Path, size: int) -> None:
        """Convert the snapshot; LuxCore builds its BVH when a render starts."""
        self.source, self.size = Scene.load(snapshot), size
        # A session's start without any rendering to speak of: BVH, light maps, threads
        self.overhead = min(self._start_up() for _ in range(3))

    def climb(self, method: str, seed: int, budget: Budget, **more: Any) -> Iterator[Step]:
        """Pictures after FIRST of rendering, then twice as long, ...; at least one.

        The seconds are wall time since the session's start less that of one that renders nothing;
        a photon map that is made first is in them.
        """
        session = self._session(method, seed, more)
        film, pixels = session.GetFilm(), np.zeros((self.size, self.size, 3), np.float32)
        begun = now() + self.overhead
        session.Start()
        budget.begin()  # photon maps are made before Start returns
        lap = FIRST
        due = (now() - begun).wall + lap
        try:
            while not session.HasDone():
                if (now() - begun).wall < due:
                    time.sleep(0.02)
                    continue
                session.Pause()
                seconds, stop = now() - begun, now()
                session.UpdateStats()
                film.GetOutputFloat(pyluxcore.FilmOutputType.RGB, pixels, 0, True)
                passes = session.GetStats().Get("stats.renderengine.pass").GetFloat()
                if passes > 0:
                    yield Step(passes, seconds, partial(pixels.astype, np.float64))
                    if not budget.fits():
                        return
                    lap *= 2
                due = seconds.wall + lap
                session.Resume()
                begun += now() - stop
        finally:
            session.Stop()

    def _start_up(self) -> Seconds:
        session = self._session("path", 1, {})
        begun = now()
        session.Start()
        spent = now() - begun
        session.Stop()
        return spent

    def _session(self, method: str, seed: int, more: dict[str, Any]) -> Any:
        properties = pyluxcore.Properties()
        bright = any(map(is_specular, self.source.materials))
        settings = {
            "path.photongi.caustic.enabled": method == "photongi" and bright,
            "film.width": self.size,
            "film.height": self.size,
            "film.filter.type": "BOX",
            "film.filter.width": 0.5,
            "film.imagepipelines.0.0.type": "NOP",
            "film.outputs.0.type": "RGB",
            "film.outputs.0.index": 0,
            "film.outputs.0.filename": "unused.exr",
            "renderengine.seed": seed + 1,
            "path.pathdepth.total": BOUNCES,
            "path.pathdepth.diffuse": BOUNCES,
            "path.pathdepth.glossy": BOUNCES,
            "path.pathdepth.specular": BOUNCES,
            "light.maxdepth": BOUNCES,
            "path.clamping.variance.maxvalue": 0.0,
            "sampler.sobol.adaptive.strength": 0.0,
            "sampler.random.adaptive.strength": 0.0,
        }
        for name, value in (settings | _SETTINGS[method] | more).items():
            properties.Set(pyluxcore.Property(name, value))
        config = pyluxcore.RenderConfig(properties, to_luxcore(self.source, self.size))
        return pyluxcore.RenderSession(config)


def to_luxcore(scene: Scene, size: int) -> Any:
    """The scene as LuxCore's."""
    made = pyluxcore.Scene()
    properties = pyluxcore.Properties()
    for name, value in EPSILON.items():
        properties.Set(pyluxcore.Property(f"scene.epsilon.{name}", value))
    for i, material in enumerate(scene.materials):
        for name, value in to_material(material.conserving()).items():
            properties.Set(pyluxcore.Property(f"scene.materials.m{i}.{name}", value))
    for i in range(len(scene.materials)):
        triangles = np.flatnonzero(scene.material == i)
        if not len(triangles):
            continue
        corners = scene.vertices[scene.triangles[triangles]].reshape(-1, 3)
        normals = scene.corner_normals[triangles].reshape(-1, 3).astype(float)
        indices = np.arange(3 * len(triangles)).reshape(-1, 3)
        made.DefineMesh(
            f"mesh{i}",
            [tuple(map(float, c)) for c in corners],
            [tuple(map(int, t)) for t in indices],
            [tuple(map(float, n)) for n in normals],
            None, None, None, None,
        )  # fmt: skip
        properties.Set(pyluxcore.Property(f"scene.objects.o{i}.shape", f"mesh{i}"))
        properties.Set(pyluxcore.Property(f"scene.objects.o{i}.material", f"m{i}"))
    for i, light in enumerate(scene.lights):
        for name, value in to_light(made, i, light).items():
            properties.Set(pyluxcore.Property(f"scene.lights.l{i}.{name}", value))
    for name, value in to_camera(scene.camera, size).items():
        properties.Set(pyluxcore.Property(f"scene.camera.{name}", value))
    made.Parse(properties)
    return made


def to_camera(camera: Camera, size: int) -> dict[str, Any]:
    left, right, bottom, top = camera.window
    if camera.kind != "PERSP" or not np.allclose([left, bottom], [-right, -top]):
        raise ValueError("only symmetric perspective cameras are converted")
    position, matrix = camera.matrix[:3, 3], camera.matrix[:3, :3]
    return {
        "type": "perspective",
        "lookat.orig": [float(x) for x in position],
        "lookat.target": [float(x) for x in position - matrix[:, 2]],
        "up": [float(x) for x in matrix[:, 1]],
        "fieldofview": math.degrees(2 * math.atan(right)),
        # Moved by a pixel, by which its pictures lie too low.
        "screenwindow": [-1.0, 1.0, -1.0 - 2.0 / size, 1.0 - 2.0 / size],
        "cliphither": max(camera.clip_start, 1e-3),
        "clipyon": min(camera.clip_end, 1e4),
        "autovolume.enable": False,
    }


def is_specular(material: Material) -> bool:
    return glass_of(material) is not None or max(specular_of(material)[0]) > 0


def to_material(material: Material) -> dict[str, Any]:
    emits = {"emission": list(material.emission)} if material.is_emissive else {}
    if glass := glass_of(material):
        if glass.alpha > 0.0:
            raise ValueError(f"material {material.name!r} is rough glass, which is not converted")
        colour = list(glass.colour)
        index = {"interiorior": glass.ior, "exteriorior": 1.0}
        return {"type": "glass", "kr": colour, "kt": colour} | index | emits
    specular, exponent = specular_of(material)
    diffuse = list(material.diffuse)
    if max(specular) <= 0:
        return {"type": "matte", "kd": diffuse} | emits
    if math.isfinite(exponent) or max(diffuse) > 0:
        raise ValueError(f"material {material.name!r} is neither diffuse nor a mirror")
    return {"type": "mirror", "kr": list(specular)}


def to_light(made: Any, index: int, light: Light) -> dict[str, Any]:
    check_converted(light)
    power = np.array(light.power)
    if light.kind == "sun":
        way = {"direction": list(map(float, light.direction)), "gain": list(map(float, power))}
        return {"type": "sharpdistant"} | way
    if light.kind == "point":  # emits gain * color / (4 pi) [W/sr]
        position = list(map(float, light.position))
        return {"type": "point", "position": position, "gain": list(map(float, power))}
    angle = (np.arange(ROWS) + 0.5) / ROWS * math.pi
    profile = spot_profile(angle, *cone_of(light))
    pixels = np.repeat(profile.astype(np.float32), COLUMNS)
    made.DefineImageMap(f"spot{index}", pixels, 1.0, 1, COLUMNS, ROWS)
    axis = np.array(light.direction)
    side = np.cross(axis, (1.0, 0.0, 0.0) if abs(axis[0]) < 0.9 else (0.0, 1.0, 0.0))
    side /= np.linalg.norm(side)
    matrix = np.eye(4)
    matrix[:3] = np.stack([side, np.cross(axis, side), axis, light.position], axis=1)
    # A `mappoint` emits gain * color * map / (the map's mean over directions) / (4 pi)^2.
    mean = float(profile @ np.sin(angle) / np.sin(angle).sum())
    return {
        "type": "mappoint",
        "gain": list(map(float, power * (4 * math.pi * mean))),
        "mapfile": f"spot{index}",
        "transformation": [float(x) for x in matrix.T.ravel()],
    }
