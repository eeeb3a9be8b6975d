# SPDX-License-Identifier: GPL-3.0-or-later
"""Our Scene in POV-Ray 3.7 (Debian's `povray`), with its photons and its radiosity, as a contender.

It has points and suns without size, and of surfaces diffuse ones, perfect mirrors and smooth glass;
what else a scene has is refused by name. A lamp falls off with the distance squared but for FADE.
Its radiosity is a cache of irradiance, and both it and its photons are settings rather than
samples: each rung of the ladder has twice the rays, four times the photons and smaller errors than
the one before, as far as POV-Ray takes them.
"""

from __future__ import annotations

import math
import re
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR

from addon.photon.scene import Camera, Light, Material, Scene

from ..plain import check_converted, glass_of, specular_of
from .steps import Budget, Seconds, Step

METHODS = {"POV-Ray": "photons"}
FADE = 1e-3  # [m] at which a lamp's falloff turns from even to the square of distance
FAR = 1e4  # [m] where suns are
PHOTONS, RAYS, MOST_RAYS = 4000, 25, 1600  # of the first rung; what POV-Ray takes
BOUNCES = 64


class Engine:
    """POV-Ray with one scene written out."""

    def __init__(self) -> None:
        if not shutil.which("povray"):
            raise ModuleNotFoundError("no povray on PATH: Debian's package povray has it")
        words = subprocess.run(["povray", "--version"], capture_output=True, text=True).stderr
        (version,) = re.findall(r"POV-Ray (\d[.\d]*\d)", words)[:1]
        self.about = f"POV-Ray {version}"

    def load(self, snapshot: Path, blend: Path, size: int) -> None:
        """Convert the snapshot; POV-Ray reads it anew for each picture."""
        self.size, self.words = size, to_povray(Scene.load(snapshot))

    def climb(self, method: str, seed: int, budget: Budget) -> Iterator[Step]:
        """Pictures each rendered anew; the seconds are what POV-Ray says of photons, radiosity and
        tracing, without reading the scene. It has no seeds."""
        for rung in range(20):
            yield self._render(rung)
            if not budget.fits(4.0):
                return

    def _render(self, rung: int) -> Step:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "scene.pov"
            path.write_text(f"#version 3.7;\n{to_settings(rung)}\n{self.words}")
            side = min(1 + rung, 9)  # rays a side of a pixel
            command = ["povray", f"+I{path}", f"+O{folder}/picture.exr", "+FE", "-D", "-V"]
            command += [f"+W{self.size}", f"+H{self.size}", "+A0.0", "+AM1", f"+R{side}", "+J0.0"]
            found = subprocess.run(command, capture_output=True, text=True)
            if found.returncode:
                raise RuntimeError(f"POV-Ray: {found.stderr.strip().splitlines()[-1]}")
            channels = OpenEXR.File(f"{folder}/picture.exr", separate_channels=True).channels()
            picture = np.stack([channels[c].pixels for c in "RGB"], -1)[::-1].astype(float)
        wall = re.findall(r"(?:Photon|Radiosity|Trace) Time:.*\(([\d.]+) seconds\)", found.stderr)
        cpu = re.findall(r"with ([\d.]+) CPU-seconds total", found.stderr)
        # Bounding is said apart and takes no thread's time to speak of.
        seconds = Seconds(max(sum(map(float, wall)), 0.01), sum(map(float, cpu)))
        return Step(side * side, seconds, lambda: picture)


def to_settings(rung: int) -> str:
    """Of photons and radiosity."""
    rays = min(RAYS * 2**rung, MOST_RAYS)
    return f"""global_settings {{
    assumed_gamma 1.0
    max_trace_level {BOUNCES}
    adc_bailout 1e-4
    photons {{ count {PHOTONS * 4**rung} jitter 1.0 max_trace_level {BOUNCES} adc_bailout 1e-4 }}
    radiosity {{
        count {rays} error_bound {max(1.0 * 0.7**rung, 0.05)} nearest_count 10 recursion_limit 6
        pretrace_start 0.08 pretrace_end {max(0.02 * 0.5**rung, 0.001)} low_error_factor 0.7
        minimum_reuse 0.005 gray_threshold 0.0 brightness 1.0 adc_bailout 1e-4
    }}
}}"""


def to_povray(scene: Scene) -> str:
    """The scene in POV-Ray's language, but for its global settings."""
    if scene.images or any(material.is_emissive for material in scene.materials):
        raise ValueError("images and surfaces that glow are not converted")
    parts = [to_camera(scene.camera), *map(to_light, scene.lights)]
    for i, material in enumerate(scene.materials):
        triangles = np.flatnonzero(scene.material == i)
        if len(triangles):
            parts.append(to_mesh(scene, triangles, to_material(material.conserving())))
    return "\n".join(parts)


def to_camera(camera: Camera) -> str:
    left, right, bottom, top = camera.window
    if camera.kind != "PERSP" or camera.lens:
        raise ValueError("only perspective cameras without a lens are converted")
    x, y, z, place = camera.matrix[:3].T
    middle = (left + right) / 2 * x + (bottom + top) / 2 * y - z
    return (
        f"camera {{ location {vector(place)} direction {vector(middle)} "
        f"right {vector((right - left) * x)} up {vector((top - bottom) * y)} }}"
    )


def to_light(light: Light) -> str:
    """A surface of albedo a reflects a times a light's colour and cosine."""
    check_converted(light)
    if light.kind == "spot":
        raise ValueError(f"light {light.name!r} is a spot, whose blend is not converted")
    if light.kind == "sun":
        place, colour = -FAR * np.array(light.direction), np.array(light.power) / math.pi
        return f"light_source {{ {vector(place)} rgb {vector(colour)} parallel point_at 0 }}"
    colour = np.array(light.power) / (4 * math.pi**2) / (2 * FADE**2)
    return (
        f"light_source {{ {vector(light.position)} rgb {vector(colour)} "
        f"fade_distance {FADE} fade_power 2 }}"
    )


def to_mesh(scene: Scene, triangles: Any, words: str) -> str:
    """Corners apart, so that each keeps its own normal."""
    corners = scene.vertices[scene.triangles[triangles]].reshape(-1, 3)
    normals = scene.corner_normals[triangles].reshape(-1, 3)
    faces = np.arange(len(corners)).reshape(-1, 3)
    lists = (("vertex_vectors", corners), ("normal_vectors", normals), ("face_indices", faces))
    texts = [f"{name} {{ {len(x)}, {', '.join(map(vector, x))} }}" for name, x in lists]
    return f"mesh2 {{ {' '.join(texts)} {words} }}"


def to_material(material: Material) -> str:
    """Its texture, interior and how photons meet it."""
    plain = "ambient 0 emission 0 specular 0 phong 0"
    if glass := glass_of(material):
        if glass.alpha > 0.0:
            raise ValueError(f"material {material.name!r} is rough glass, which is not converted")
        colour = vector(glass.colour)
        return (
            f"texture {{ pigment {{ color rgb {colour} filter 1 }} finish {{ {plain} diffuse 0 "
            f"reflection {{ 0 rgb {colour} fresnel on }} conserve_energy }} }} "
            f"interior {{ ior {glass.ior} }} "
            "photons { target reflection on refraction on collect off }"
        )
    specular, exponent = specular_of(material)
    if max(specular) > 0:
        if math.isfinite(exponent) or max(material.diffuse) > 0:
            raise ValueError(f"material {material.name!r} is neither diffuse nor a mirror")
        return (
            f"texture {{ pigment {{ rgb 0 }} finish {{ {plain} diffuse 0 "
            f"reflection {{ rgb {vector(specular)} }} }} }} "
            "photons { target reflection on refraction off collect off }"
        )
    return (
        f"texture {{ pigment {{ rgb {vector(material.diffuse)} }} finish {{ {plain} diffuse 1 }} }}"
    )


def vector(numbers: Any) -> str:
    return f"<{', '.join(f'{float(x):.9g}' for x in numbers)}>"
