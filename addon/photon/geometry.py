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

from ..streams import TABLE_WIDTH, Device
from .errors import SceneError
from .scene import Light, Material, Scene

AREAS_AT_ONCE = 1 << 15
# A refitted tree is kept up to this cost over what it was when it was built: rays then take as much
# longer than in another, about, and a tenth of a few passes' rays take as long as building it.
MOST_WEAR = 1.1
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
    is_used = np.zeros(len(scene.vertices), bool)
    is_used[scene.triangles] = True
    used = scene.vertices if is_used.all() else scene.vertices[is_used]
    if len(used) and not _greatest(used) < 1e30:  # or NaN
        used = used[(np.abs(used) < 1e30).all(axis=1)]
    if len(used) == 0:
        return Frame(np.zeros(3), 1.0)
    low, high = used.min(axis=0), used.max(axis=0)
    return Frame((low + high) / 2, float((high - low).max()) / 2 or 1.0)


@dataclass(frozen=True)
class Tree:
    """A BVH of triangles, which depends on nothing but where they are."""

    triangles: NDArray[np.int32]  # (T, 3) the scene's, kept or not
    order: NDArray[np.int32]  # (K,) the kept ones' numbers, in leaf order
    nodes: NDArray[np.float32]  # (N, 16)
    not_finite: int
    degenerate: int
    cost: float  # by SAH when it was built, over the areas of the triangles' own boxes

    @staticmethod
    def build(
        vertices: NDArray[np.float32], triangles: NDArray[np.int32], old: Tree | None = None
    ) -> Tree:
        """Fit `old` to vertices (V, 3) if it is a good tree for them, or else build another.

        ValueError if the native core refuses the triangles.
        """
        if old and np.array_equal(old.triangles, triangles):
            fitted = native.refit_bvh(old.nodes, old.order, vertices, triangles)
            if fitted and fitted[3] <= MOST_WEAR * old.cost:
                nodes, not_finite, degenerate, _ = fitted
                return Tree(triangles, old.order, nodes, not_finite, degenerate, old.cost)
            del fitted, old  # there may not be room for these as well
        nodes, order, not_finite, degenerate, cost = native.build_bvh(vertices, triangles)
        return Tree(triangles, order, nodes, not_finite, degenerate, cost)


@dataclass(frozen=True)
class Mesh:
    """Triangles in BVH order. In which one shows in nothing that is made of them."""

    tree: Tree
    corners: NDArray[np.float32]  # (K, 3, 4): position; material, surface, number in w
    normals: NDArray[np.float32]  # (K, 3, 4): shading normal
    area: float  # of diffuse triangles [scene units^2]
    extent: NDArray[np.float32]  # (3,) largest |x|, |y|, |z| of the corners

    @staticmethod
    def build(scene: Scene, frame: Frame, old: Tree | None = None) -> Mesh:
        """Build the BVH natively, or refit an old one; SceneError if triangles are refused."""
        vertices = np.zeros((len(scene.vertices), 4), np.float32)
        with np.errstate(over="ignore"):  # beyond float32 is infinite, and skipped as such
            vertices[:, :3] = frame.points(scene.vertices)
        triangles = np.ascontiguousarray(scene.triangles)
        try:
            tree = Tree.build(np.ascontiguousarray(vertices[:, :3]), triangles, old)
        except ValueError as error:
            raise SceneError(f"scene geometry: {error}") from error
        order = tree.order
        corners = np.take(vertices, np.take(triangles, order, axis=0), axis=0)
        material = scene.material[order]
        corners[:, 0, 3] = material
        corners[:, 1, 3] = scene.surface[order]
        corners[:, 2, 3] = order
        normals = np.zeros((len(order), 3, 4), np.float32)
        normals[..., :3] = np.take(scene.corner_normals, order, axis=0)
        # A normal that is not finite reads as none: the kernel then takes the triangle's own.
        if not np.isfinite(normals.sum()):
            np.nan_to_num(normals, copy=False, posinf=0.0, neginf=0.0)
        diffuse = np.array([max(m.diffuse) > 0 for m in scene.materials], bool)
        areas = np.zeros(len(triangles))  # in the scene's order: a sum of floats depends on it
        areas[order] = np.where(diffuse[material], _areas(corners), 0.0)
        extent = [_greatest(corners[..., k]) for k in range(3)] if len(order) else [0.0] * 3
        return Mesh(
            tree,
            corners,
            normals,
            area=float(areas.sum()),
            extent=np.array(extent, np.float32),
        )


def _areas(corners: NDArray[np.float32]) -> NDArray[np.float64]:
    """The areas of triangles (T, 3, 3 or more); by pieces that fit the processor's cache."""
    areas = np.empty(len(corners))
    for at in range(0, len(corners), AREAS_AT_ONCE):
        piece = corners[at : at + AREAS_AT_ONCE]
        x, y, z = np.moveaxis(piece[:, 1:, :3] - piece[:, :1, :3], -1, 0)
        cross = (
            y[:, 0] * z[:, 1] - z[:, 0] * y[:, 1],
            z[:, 0] * x[:, 1] - x[:, 0] * z[:, 1],
            x[:, 0] * y[:, 1] - y[:, 0] * x[:, 1],
        )
        areas[at : at + AREAS_AT_ONCE] = np.sqrt(sum(np.square(a, dtype=float) for a in cross)) / 2
    return areas


def _greatest(values: NDArray[Any]) -> float:
    """The largest magnitude; NaN if there is one."""
    return float(max(values.max(), -values.min()))


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
    kind = "f4" if data.dtype == np.float32 else "u4"
    texture: moderngl.Texture = device.texture((TABLE_WIDTH, rows), texels.shape[1], kind)
    whole = len(texels) // TABLE_WIDTH
    if whole:
        texture.write(texels[: whole * TABLE_WIDTH], viewport=(0, 0, TABLE_WIDTH, whole))
    if whole < rows:
        rest = np.zeros((TABLE_WIDTH, texels.shape[1]), texels.dtype)
        rest[: len(texels) - whole * TABLE_WIDTH] = texels[whole * TABLE_WIDTH :]
        texture.write(rest, viewport=(0, whole, TABLE_WIDTH, 1))
    return texture


class Tables:
    """The scene's textures on a device."""

    def __init__(
        self, device: Device, scene: Scene, frame: Frame, mesh: Mesh, on_host: bool = False
    ) -> None:
        """`on_host`: the native core traces, so no kernel reads the tree."""
        self._device = device
        self.textures = {} if on_host else {"bvh_nodes": upload_table(device, mesh.tree.nodes)}
        self.textures |= {
            "bvh_corners": upload_table(device, mesh.corners),
            "bvh_normals": upload_table(device, mesh.normals),
            "materials": upload_table(device, material_table(scene.materials)),
            "lights": upload_table(device, light_table(scene.lights, frame)),
        }

    def of(self, kernel: Any) -> dict[str, moderngl.Texture]:
        """Those tables that a kernel declares."""
        return {name: self.textures[name] for name in kernel.tables if name in self.textures}

    def release(self) -> None:
        """Put the textures back."""
        for texture in self.textures.values():
            self._device.put_back(texture)
