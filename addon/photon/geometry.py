# SPDX-License-Identifier: GPL-3.0-or-later
"""The scene as tables: what kernels read, in scene units.

Scene units put the bounding box's centre at the origin and its largest half extent at 1, so every
tolerance means the same at every scale. Powers are divided by scale^2: flux over scene-unit area
is then the irradiance in W/m^2.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
import photon_stream_native as native
from numpy.typing import NDArray

from ..streams import Device
from .errors import SceneError
from .scene import Light, Material, Scene

TABLE_WIDTH = 4096  # glsl/lib/table.glsl
POINT_VERSINE = 2.0  # 1 - cos of a "cone" that holds every direction


@dataclass(frozen=True)
class Frame:
    """Scene units: x_scene = (x_world - centre) / scale."""

    centre: NDArray[np.float64]  # (3,) [m]
    scale: float  # [m] a scene unit

    def points(self, world: Any) -> NDArray[np.float64]:
        """World points (..., 3) in scene units."""
        return (np.asarray(world, np.float64) - self.centre) / self.scale


def frame_of(scene: Scene) -> Frame:
    """The scene units of the finite vertices that triangles use."""
    used = scene.vertices[np.unique(scene.triangles)]
    used = used[(np.abs(used) < 1e30).all(axis=1)]  # also drops NaN
    if len(used) == 0:
        return Frame(np.zeros(3), 1.0)
    low, high = used.min(axis=0), used.max(axis=0)
    return Frame((low + high) / 2, float((high - low).max()) / 2 or 1.0)


@dataclass(frozen=True)
class Mesh:
    """Triangles in BVH order, and what was left out."""

    nodes: NDArray[np.float32]  # (N, 16)
    corners: NDArray[np.float32]  # (T, 3, 4): position; material, surface, unused in w
    normals: NDArray[np.float32]  # (T, 3, 4): shading normal
    area: float  # of diffuse triangles [scene units^2]
    extent: NDArray[np.float32]  # (3,) largest |x|, |y|, |z| of the corners
    not_finite: int
    degenerate: int

    @staticmethod
    def build(scene: Scene, frame: Frame) -> Mesh:
        """Build the BVH natively; SceneError if it refuses the triangles."""
        with np.errstate(over="ignore"):  # beyond float32 is infinite, and skipped as such
            vertices = frame.points(scene.vertices).astype(np.float32)
        try:
            nodes, order, not_finite, degenerate = native.build_bvh(
                vertices, np.ascontiguousarray(scene.triangles)
            )
        except ValueError as error:
            raise SceneError(f"scene geometry: {error}") from error
        corners = np.zeros((len(order), 3, 4), np.float32)
        corners[..., :3] = vertices[scene.triangles[order]]
        corners[:, 0, 3] = scene.material[order]
        corners[:, 1, 3] = scene.surface[order]
        normals = np.zeros((len(order), 3, 4), np.float32)
        # A normal that is not finite reads as none: the kernel then takes the triangle's own.
        normals[..., :3] = np.nan_to_num(scene.corner_normals[order], posinf=0.0, neginf=0.0)
        edges = corners[:, 1:, :3] - corners[:, :1, :3]
        areas = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]).astype(np.float64), axis=1) / 2
        material = scene.material[order]
        diffuse = np.array([max(m.diffuse) > 0 for m in scene.materials], bool)
        some = len(order) > 0
        return Mesh(
            nodes,
            corners,
            normals,
            area=float(areas[diffuse[material]].sum()),
            extent=np.abs(corners[..., :3]).max(axis=(0, 1)) if some else np.zeros(3, np.float32),
            not_finite=int(not_finite),
            degenerate=int(degenerate),
        )


def solid_angles(light: Light) -> tuple[float, float]:
    """(outer, inner) 1 - cos of the spot's cones: darkness outside, full power inside."""
    if light.kind == "POINT":
        return POINT_VERSINE, POINT_VERSINE
    outer = 2.0 * math.sin(light.spot_size / 4.0) ** 2  # 1 - cos(size / 2), exact for small angles
    return outer, outer * (1.0 - min(max(light.spot_blend, 0.0), 1.0))


def emitted_flux(light: Light) -> NDArray[np.float64]:
    """Flux per channel [W] that leaves the light (not P: the cone cuts it off)."""
    outer, inner = solid_angles(light)
    return np.asarray(light.power, np.float64) * (outer + inner) / 4.0


def light_table(lights: tuple[Light, ...], frame: Frame) -> NDArray[np.float32]:
    """(L, 4, 4) texels as glsl/lib/light.glsl reads them; photons go by each light's flux."""
    table = np.zeros((max(len(lights), 1), 4, 4), np.float64)
    flux = np.array([emitted_flux(light).mean() for light in lights] or [0.0])
    chosen = flux / flux.sum() if flux.sum() > 0 else np.zeros_like(flux)
    for row, light, share, total in zip(table, lights, chosen, np.cumsum(chosen), strict=False):
        outer, inner = solid_angles(light)
        axis = np.asarray(light.direction, np.float64)
        row[0] = (*frame.points(light.position), light.radius / frame.scale)
        row[1] = (*(axis / np.linalg.norm(axis)), outer)
        row[2] = (*(np.asarray(light.power) / frame.scale**2), inner)
        row[3, :2] = share, total
    return table.astype(np.float32)


def material_table(materials: tuple[Material, ...]) -> NDArray[np.float32]:
    """(M, 2, 4) texels as glsl/lib/material.glsl reads them; exponent -1 is a mirror."""
    table = np.zeros((max(len(materials), 1), 2, 4), np.float32)
    for row, material in zip(table, materials, strict=False):
        mirror = not math.isfinite(material.exponent)
        row[0] = (*material.diffuse, -1.0 if mirror else material.exponent)
        row[1, :3] = material.specular
    return table


def upload_table(device: Device, data: NDArray[Any]) -> moderngl.Texture:
    """`data` (..., 4) float32 or (n,) uint32 as a texture TABLE_WIDTH texels wide."""
    texels = data.reshape(-1, 4) if data.dtype == np.float32 else data.reshape(-1, 1)
    rows = max(1, -(-len(texels) // TABLE_WIDTH))
    if rows > device.texture_limit:
        raise SceneError(
            f"{len(texels)} table entries do not fit a texture of {device.name} "
            f"({TABLE_WIDTH * device.texture_limit} at most)"
        )
    padded = np.zeros((rows * TABLE_WIDTH, texels.shape[1]), texels.dtype)
    padded[: len(texels)] = texels
    kind = "f4" if data.dtype == np.float32 else "u4"
    texture: moderngl.Texture = device.ctx.texture(
        (TABLE_WIDTH, rows), texels.shape[1], padded, dtype=kind
    )
    texture.filter = (moderngl.NEAREST, moderngl.NEAREST)
    return texture


class Tables:
    """The scene's textures on a device."""

    def __init__(self, device: Device, scene: Scene, frame: Frame, mesh: Mesh) -> None:
        self.textures = {
            "bvh_nodes": upload_table(device, mesh.nodes),
            "bvh_corners": upload_table(device, mesh.corners),
            "bvh_normals": upload_table(device, mesh.normals),
            "materials": upload_table(device, material_table(scene.materials)),
            "lights": upload_table(device, light_table(scene.lights, frame)),
        }

    def of(self, kernel: Any) -> dict[str, moderngl.Texture]:
        """Those tables that a kernel declares."""
        return {name: self.textures[name] for name in kernel.tables if name in self.textures}

    def release(self) -> None:
        """Free the textures."""
        for texture in self.textures.values():
            texture.release()
