# SPDX-License-Identifier: GPL-3.0-or-later
"""Generated coordinates and UV maps of meshes."""

from __future__ import annotations

import bpy
import numpy as np
from numpy.typing import NDArray

from .triangles import read


def undeformed(mesh: bpy.types.Mesh) -> NDArray[np.float64]:
    """Where vertices (V, 3) were before modifiers moved them, if Blender knows."""
    points = read(mesh.vertices, "undeformed_co", 3 * len(mesh.vertices))
    return points.reshape(-1, 3).astype(np.float64)


def centred(mesh: bpy.types.Mesh) -> NDArray[np.float64]:
    """Where vertices (V, 3) are in the mesh's texture space, from -0.5 to 0.5, before modifiers."""
    size = 2.0 * np.array(mesh.texspace_size, np.float64)
    points = undeformed(mesh) - np.array(mesh.texspace_location, np.float64)
    return np.divide(points, size, out=np.zeros_like(points), where=size != 0.0)


def generated(mesh: bpy.types.Mesh) -> NDArray[np.float64]:
    """The same from 0 to 1: Generated coordinates."""
    return centred(mesh) + 0.5


def uv_of(
    mesh: bpy.types.Mesh, triangles: NDArray[np.int32], name: str
) -> NDArray[np.float64] | None:
    """The UV map of that name at triangles' corners (T, 3, 2), None if there is none.

    Without a name the one that is active in renders; a mesh without any is then mapped from a
    sphere.
    """
    layers = mesh.uv_layers
    if not name and not len(layers):
        return on_sphere(undeformed(mesh))[triangles]
    layer = layers.get(name) if name else next((x for x in layers if x.active_render), None)
    if layer is None:
        return None
    values = read(layer.uv, "vector", 2 * len(mesh.loops))
    return values.reshape(-1, 2)[loops_of(mesh, len(triangles))].astype(np.float64)


def loops_of(mesh: bpy.types.Mesh, count: int) -> NDArray[np.int32]:
    """Which of a mesh's loops are the corners (count, 3) of its triangles."""
    mesh.calc_loop_triangles()
    return read(mesh.loop_triangles, "loops", 3 * count, np.int32).reshape(-1, 3)


def on_sphere(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Longitude and latitude (V, 2) of points, in [0, 1]."""
    x, y, z = points.T
    length = np.linalg.norm(points, axis=1)
    cosine = np.divide(z, length, out=np.zeros_like(z), where=length > 0.0)
    turned = np.where((x == 0.0) & (y == 0.0), 0.0, 0.5 - np.arctan2(x, y) / (2.0 * np.pi))
    turned = np.where(length > 0.0, turned, 0.0)
    latitude = np.where(length > 0.0, 1.0 - np.arccos(cosine.clip(-1.0, 1.0)) / np.pi, 0.0)
    return np.stack((turned, latitude), axis=1)
