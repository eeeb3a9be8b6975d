# SPDX-License-Identifier: GPL-3.0-or-later
"""Splat: indirect light by rasterising photons (Marino & Abbate, Splatting)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import moderngl

from ...streams import Device, Stream
from ...streams.device import Layer
from ...streams.source import expand
from ..kernels.reach import Reach
from ..kernels.records import REACH
from ..settings import SplatShape
from .deposits import Deposits
from .radius_field import TABLES, UNIFORMS, Radii

_UNIFORMS = """
uniform sampler2D photon_place;
uniform sampler2D photon_deposit;
uniform sampler2D point_place;
uniform sampler2D point_facing;
uniform sampler2D point_reach;
uniform sampler2D point_cuts;
uniform int first_photon;
uniform mat4 world_to_camera;
uniform vec4 window;
uniform vec2 viewport;
uniform bool field_is_even;
uniform float pixels_above;
uniform float pixels_up_to;
uniform bool orthographic;
""" + "".join(f"uniform {item.kind} {name};\n" for name, item in (UNIFORMS | TABLES).items())
_VERTICES = {"triangle": 3, "quad": 4, "point": 1}
_MODES = {
    "triangle": moderngl.TRIANGLES,
    "quad": moderngl.TRIANGLE_STRIP,
    "point": moderngl.POINTS,
}
_UNLIMITED = 1.0e30
# A draw that takes ten seconds is ended by an H200's driver, and buffers lose what was written to
# them; half a million large splats at once took twelve.
MOST_SPLATS = 1 << 14


def splat_sources(version: int, shape: str, defines: Mapping[str, int | float]) -> tuple[Any, Any]:
    """The expanded vertex and fragment programs of a splat shape."""
    lines = [f"#define {name} {value}" for name, value in defines.items()]
    header = "\n".join(
        [f"#version {version} core", f"#define SHAPE_{shape.upper()} 1", *lines, _UNIFORMS]
    )
    return (
        expand("kernels/splat.glsl", header + "#define STAGE_VERTEX 1"),
        expand("kernels/splat.glsl", header + "#define STAGE_FRAGMENT 1"),
    )


class _Shape:
    """One splat shape's program."""

    def __init__(self, device: Device, shape: str, defines: Mapping[str, int | float]) -> None:
        self.shape = shape
        vertex, fragment = splat_sources(device.glsl_version, shape, defines)
        try:
            self.program = device.program(vertex.text, fragment.text)
        except moderngl.Error as error:
            failed = vertex if "vertex_shader" in str(error) else fragment
            raise device.refusal("Splat", failed, error) from None
        self.array = device.ctx.vertex_array(self.program.program, [])
        for unit, name in enumerate(
            (
                "photon_place",
                "photon_deposit",
                "point_place",
                "point_facing",
                "point_reach",
                "point_cuts",
                "radii",
            )
        ):
            self.program.set(name, unit)

    def draw(self, count: int, uniforms: Mapping[str, Any]) -> None:
        for name, value in uniforms.items():
            self.program.set(name, value)
        mode, vertices = _MODES[self.shape], _VERTICES[self.shape]
        for first in range(0, count, MOST_SPLATS):
            self.program.set("first_photon", first)
            self.array.render(mode, vertices=vertices, instances=min(MOST_SPLATS, count - first))

    def release(self) -> None:
        self.array.release()


@dataclass(frozen=True)
class View:
    """How visible points project to the screen: what eye_rays.glsl inverted."""

    world_to_camera: tuple[float, ...]  # column-major, scene units
    window: tuple[float, float, float, float]  # (left, right, bottom, top) of the streams' pixels
    orthographic: bool


class Splat:
    """Adds each photon to the visible points around it by blending one splat a photon.

    Reaches only points that the camera sees directly; those seen in mirrors need Gather.
    """

    def __init__(
        self, device: Device, layer: Layer, shape: SplatShape, defines: Mapping[str, int | float]
    ) -> None:
        self._device = device
        self._reach = Reach(device, layer)
        self._reaches: Stream | None = None
        self._shape = _Shape(device, shape, defines)
        # Points larger than the device draws become quads.
        self._large = _Shape(device, "quad", defines) if shape == "point" else None
        self._photons: list[moderngl.Texture] = []
        self._count = 0
        self._radii: Radii | None = None
        self._launches = 0

    def prepare(self, deposits: Deposits, radii: Radii) -> None:
        """Take a pass's deposits and radii."""
        self._count, *self._photons = deposits.tables()
        self._radii = radii

    def estimate(self, points: Mapping[str, Stream], irradiance: Stream, view: View) -> None:
        """Write the irradiance [W/m^2] at points: place, facing, cuts."""
        place, facing, cuts = (points[name] for name in ("place", "facing", "cuts"))
        self._launches += 1
        if self._count == 0 or self._radii is None:
            irradiance.clear()
            return
        if self._reaches is None or self._reaches.size != place.size:
            self._release_reaches()
            self._reaches = Stream(self._device, REACH, place.size)
        self._reach.run(
            {"place": place, "facing": facing, "reach": self._reaches},
            self._radii.tables(self._reach),
            self._radii.uniforms,
        )
        framebuffer = self._device.framebuffer([irradiance.texture])
        framebuffer.use()
        framebuffer.clear()
        textures = (
            *self._photons,
            *(stream.texture for stream in (place, facing, self._reaches, cuts)),
            self._radii.field.on_device,
        )
        for unit, texture in enumerate(textures):
            texture.use(location=unit)
        limit = self._device.point_size_limit if self._large else _UNLIMITED
        uniforms = {
            "world_to_camera": view.world_to_camera,
            "window": view.window,
            "viewport": tuple(map(float, irradiance.size)),
            "field_is_even": self._radii.field.is_even,
            "orthographic": view.orthographic,
            "pixels_above": 0.0,
            "pixels_up_to": limit,
        } | self._radii.uniforms
        ctx = self._device.ctx
        ctx.enable(moderngl.BLEND | moderngl.PROGRAM_POINT_SIZE)
        ctx.blend_func = moderngl.ONE, moderngl.ONE
        self._shape.draw(self._count, uniforms)
        if self._large:
            above = {"pixels_above": limit, "pixels_up_to": _UNLIMITED}
            self._large.draw(self._count, uniforms | above)
        ctx.disable(moderngl.BLEND | moderngl.PROGRAM_POINT_SIZE)

    def launches(self) -> dict[str, int]:
        """How often each kernel has run."""
        return {"splat": self._launches, self._reach.stem: self._reach.launches}

    def release(self) -> None:
        """Free what is its own; the programs are the device's."""
        self._release_reaches()
        self._reach.release()
        self._shape.release()
        if self._large:
            self._large.release()

    def _release_reaches(self) -> None:
        if self._reaches:
            self._reaches.release()
