# SPDX-License-Identifier: GPL-3.0-or-later
"""Our Scene in Mitsuba 3, and its path tracer and particle tracer as contenders.

Nothing is approximated: perfect mirrors are its `conductor` of material `none`, Phong lobes a BSDF
of ours that is compiled into its kernels, and Blender's spotlight profile is a texture of its
`spot`, whose own falloff is switched off (interpolated between PROFILE^2 texels, 1e-5 off).
"""

from __future__ import annotations

import math
import os
import re
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from addon.photon.scene import Camera, Light, Material, Scene

from ..plain import check_converted, cone_of, glass_of, specular_of
from ..spot import spot_profile
from .steps import Budget, Seconds, Step, doubling, now

METHODS = {"Mitsuba path": "path", "Mitsuba ptracer": "ptracer"}
OLDEST_LLVM = 17  # 16 aborts Dr.Jit 1.5.0; 19 is known to work
PROFILE = 1024  # texels a side of a spotlight's texture
BOUNCES = 64
# Samples a pixel in one launch, on processors and on a GPU: with fewer each takes longer, and a GPU
# gains nothing by more.
LAUNCH, CUDA_LAUNCH = 16, 64


def choose_variant() -> str:
    """The one that MITSUBA_VARIANT names; LLVM where there is one; the scalar mode elsewhere."""
    llvm = os.environ.setdefault("DRJIT_LIBLLVM_PATH", newest_llvm())
    variant = os.environ.get("MITSUBA_VARIANT", "llvm_ad_rgb" if llvm else "scalar_rgb")
    mi.set_variant(variant)
    if not variant.startswith("scalar"):
        register_phong()
    return variant


def newest_llvm() -> str:
    """The path of the newest libLLVM that Dr.Jit can use, or nothing: older ones abort it."""
    found = {}
    for folder in ("/usr/lib", "/usr/lib64", "/usr/local/lib"):
        for path in Path(folder).glob("**/libLLVM*.so*"):
            version = re.search(r"libLLVM(?:-|\.so\.)(\d+)", path.name)
            if version and int(version[1]) >= OLDEST_LLVM:
                found[int(version[1])] = str(path)
    return found[max(found)] if found else ""


class Engine:
    """Mitsuba 3 with one scene loaded."""

    def __init__(self) -> None:
        self.variant = choose_variant()
        self.about = f"Mitsuba {mi.__version__}, {self.variant}"
        self.launch = CUDA_LAUNCH if self.variant.startswith("cuda") else LAUNCH
        if self.variant == "scalar_rgb":
            self.about += " (about five times slower than with a newer libLLVM: libllvm19)"

    def load(self, snapshot: Path, blend: Path, size: int) -> None:
        """Convert the snapshot; compiles nothing yet."""
        self.scene = mi.load_dict(to_mitsuba(Scene.load(snapshot), size))
        self._warm: set[tuple[str, int]] = set()

    def climb(self, method: str, seed: int, budget: Budget) -> Iterator[Step]:
        """Pictures of 1, 2, 4, ... samples a pixel; the seconds are those of rendering alone.

        Pictures of up to `launch` samples are rendered anew, in one launch: many small ones take
        longer. What a rung runs is compiled before it is timed.
        """
        integrator = mi.load_dict({"type": method, "max_depth": BOUNCES + 1})
        total, done, seconds = None, 0, Seconds()
        for effort in doubling():
            samples = min(effort, self.launch)
            if effort <= self.launch:
                total, done, seconds = None, 0, Seconds()
            kind = method, samples, total is None
            if kind not in self._warm:
                self._add(total, integrator, samples, 0)
                self._warm.add(kind)
                budget.begin()
            while done < effort:
                start = now()
                number = seed * 1_000_003 + effort + done
                total = self._add(total, integrator, samples, number)
                seconds += now() - start
                done += samples
            yield Step(done, seconds, partial(_picture, total, done))
            if not budget.fits():
                return

    def _add(self, total: Any, integrator: Any, samples: int, seed: int) -> Any:
        """The sum of a pixel's samples with so many more."""
        more = mi.render(self.scene, integrator=integrator, spp=samples, seed=seed % 2**32)
        total = more * samples if total is None else total + more * samples
        dr.eval(total)
        dr.sync_thread()
        return total


def _picture(total: Any, samples: int) -> Any:
    return np.array(total, np.float64)[::-1] / samples


def to_mitsuba(scene: Scene, size: int) -> dict[str, Any]:
    """The scene as a dictionary for mi.load_dict; lights' `intensity` are P / (4 pi)."""
    made: dict[str, Any] = {"type": "scene", "sensor": to_sensor(scene.camera, size)}
    for i, light in enumerate(scene.lights):
        made[f"light{i}"] = to_emitter(light)
    for i, material in enumerate(scene.materials):
        triangles = np.flatnonzero(scene.material == i)
        if len(triangles):
            made[f"mesh{i}"] = to_mesh(scene, triangles, material.conserving())
    return made


def to_sensor(camera: Camera, size: int) -> dict[str, Any]:
    left, right, bottom, top = camera.window
    if camera.kind != "PERSP" or not np.allclose([left, bottom], [-right, -top]):
        raise ValueError("only symmetric perspective cameras are converted")
    # Mitsuba's cameras look along +Z and have +X to the left.
    to_world = camera.matrix @ np.diag([-1.0, 1.0, -1.0, 1.0])
    return {
        "type": "perspective",
        "fov": math.degrees(2 * math.atan(right)),
        "fov_axis": "x",
        "near_clip": max(camera.clip_start, 1e-3),
        "far_clip": min(camera.clip_end, 1e4),
        "to_world": mi.ScalarTransform4f(to_world),
        "film": {
            "type": "hdrfilm",
            "width": size,
            "height": size,
            "pixel_format": "rgb",
            "component_format": "float32",
            "rfilter": {"type": "box"},
        },
        "sampler": {"type": "independent"},
    }


def to_emitter(light: Light) -> dict[str, Any]:
    check_converted(light)
    if light.kind == "sun":
        irradiance = {"type": "rgb", "value": list(map(float, light.power))}
        return {"type": "directional", "direction": list(light.direction), "irradiance": irradiance}
    intensity = {"type": "rgb", "value": [float(p) / (4 * math.pi) for p in light.power]}
    if light.kind == "point":
        return {"type": "point", "position": list(light.position), "intensity": intensity}
    position, direction = np.array(light.position), np.array(light.direction)
    up = (0.0, 0.0, 1.0) if abs(direction[2]) < 0.9 else (0.0, 1.0, 0.0)
    size, blend = cone_of(light)
    cutoff = size / 2
    # Texel centres over tan(angle) in [-1, 1] * tan(cutoff)
    x = (np.arange(PROFILE) + 0.5) / PROFILE * 2 - 1
    tangent = np.hypot(*np.meshgrid(x, x)) * math.tan(cutoff)
    profile = spot_profile(np.arctan(tangent), size, blend)
    pixels = np.repeat(profile.astype(np.float32)[..., None], 3, axis=2)
    return {
        "type": "spot",
        "to_world": mi.ScalarTransform4f().look_at(
            list(position), list(position + direction), list(up)
        ),
        "intensity": intensity,
        "cutoff_angle": math.degrees(cutoff),
        "beam_width": math.degrees(cutoff) * (1 - 1e-6),
        "texture": {
            "type": "bitmap",
            "bitmap": mi.Bitmap(pixels),
            "raw": True,
            "wrap_mode": "clamp",
        },
    }


def to_mesh(scene: Scene, triangles: Any, material: Material) -> Any:
    """A mesh of the triangles, corners apart, so that each keeps its own normal."""
    properties = mi.Properties()
    properties["bsdf"] = mi.load_dict(to_bsdf(material))
    if material.is_emissive:  # on the outside alone, of what is closed
        radiance = {"type": "rgb", "value": list(material.emission)}
        properties["emitter"] = mi.load_dict({"type": "area", "radiance": radiance})
    corners = scene.vertices[scene.triangles[triangles]].reshape(-1, 3)
    normals = scene.corner_normals[triangles].reshape(-1, 3)
    mesh = mi.Mesh(material.name, len(corners), len(triangles), properties, True)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = np.ascontiguousarray(corners, np.float32).ravel()
    parameters["vertex_normals"] = np.ascontiguousarray(normals, np.float32).ravel()
    parameters["faces"] = np.arange(3 * len(triangles), dtype=np.uint32)
    parameters.update()
    return mesh


def to_bsdf(material: Material) -> dict[str, Any]:
    if glass := glass_of(material):
        colour = {"type": "rgb", "value": list(glass.colour)}
        own = {"type": "dielectric", "int_ior": glass.ior, "ext_ior": 1.0}
        if glass.alpha > 0.0:
            own |= {"type": "roughdielectric", "distribution": "ggx", "alpha": glass.alpha}
        return own | {"specular_reflectance": colour, "specular_transmittance": colour}
    specular, exponent = specular_of(material)
    diffuse = list(material.diffuse)
    if max(specular) <= 0:
        bsdf: dict[str, Any] = {"type": "diffuse", "reflectance": {"type": "rgb", "value": diffuse}}
    elif math.isfinite(exponent) and mi.variant().startswith("scalar"):
        raise ValueError("its scalar mode has no Phong lobe of ours")
    elif math.isfinite(exponent):
        bsdf = {
            "type": "phong_lobe",
            "diffuse": mi.ScalarColor3f(diffuse),
            "specular": mi.ScalarColor3f(specular),
            "exponent": float(exponent),
        }
    elif max(diffuse) <= 0:
        bsdf = {
            "type": "conductor",
            "material": "none",
            "specular_reflectance": {"type": "rgb", "value": list(specular)},
        }
    else:
        raise ValueError(f"material {material.name!r} is diffuse and a mirror: not converted")
    return {"type": "twosided", "bsdf": bsdf}


def register_phong() -> None:
    """Define the BSDF `phong_lobe` for the variant in use."""

    class PhongLobe(mi.BSDF):
        """k_d / pi + k_s (n + 2) / (2 pi) cos^n (Lafortune & Willems 1994)."""

        def __init__(self, properties: Any) -> None:
            mi.BSDF.__init__(self, properties)
            self.diffuse = mi.Color3f(properties["diffuse"])
            self.specular = mi.Color3f(properties["specular"])
            self.exponent = float(properties["exponent"])
            k_d, k_s = (float(np.mean(properties[k])) for k in ("diffuse", "specular"))
            self.share = k_s / (k_d + k_s)  # of the samples that go to the lobe
            self.m_components = [mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide]
            self.m_flags = self.m_components[0]

        def sample(self, ctx, si, sample1, sample2, active):  # type: ignore[no-untyped-def]
            lobe = sample1 < self.share
            cosine = dr.power(sample2.x, 1 / (self.exponent + 1))
            sine = dr.safe_sqrt(1 - cosine * cosine)
            sin_phi, cos_phi = dr.sincos(2 * dr.pi * sample2.y)
            about = mi.Frame3f(mi.reflect(si.wi))
            glossy = about.to_world(mi.Vector3f(sine * cos_phi, sine * sin_phi, cosine))
            bs = mi.BSDFSample3f()
            bs.wo = dr.select(lobe, glossy, mi.warp.square_to_cosine_hemisphere(sample2))
            bs.eta = 1.0
            bs.sampled_type = mi.UInt32(+mi.BSDFFlags.GlossyReflection)
            bs.sampled_component = 0
            value, bs.pdf = self.eval_pdf(ctx, si, bs.wo, active)
            active &= bs.pdf > 0
            return bs, dr.select(active, value / dr.select(active, bs.pdf, 1), 0)

        def eval_pdf(self, ctx, si, wo, active):  # type: ignore[no-untyped-def]
            cos_o = mi.Frame3f.cos_theta(wo)
            active &= (mi.Frame3f.cos_theta(si.wi) > 0) & (cos_o > 0)
            alpha = dr.maximum(0, dr.dot(mi.reflect(si.wi), wo))
            power, n = dr.power(alpha, self.exponent), self.exponent
            value = self.diffuse / dr.pi + self.specular * ((n + 2) / (2 * dr.pi) * power)
            pdf = (1 - self.share) * cos_o / dr.pi + self.share * (n + 1) / (2 * dr.pi) * power
            return dr.select(active, value * cos_o, 0), dr.select(active, pdf, 0)

        def eval(self, ctx, si, wo, active):  # type: ignore[no-untyped-def]
            return self.eval_pdf(ctx, si, wo, active)[0]

        def pdf(self, ctx, si, wo, active):  # type: ignore[no-untyped-def]
            return self.eval_pdf(ctx, si, wo, active)[1]

    mi.register_bsdf("phong_lobe", PhongLobe)
