# SPDX-License-Identifier: GPL-3.0-or-later
"""Export triangles: every renderable object and instance, in world space."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from .materials import MaterialTable
from .report import Notes

# Object types that Blender turns into meshes on the way; the depsgraph lists each of them a second
# time, as the mesh that is exported.
BECOME_MESHES = {"CURVE", "SURFACE", "FONT", "META"}
NO_GEOMETRY = {"EMPTY", "CAMERA", "ARMATURE", "LATTICE", "SPEAKER", "LIGHT", "LIGHT_PROBE"}
NOT_RENDERED = {
    "CURVES": "hair curves",
    "POINTCLOUD": "point cloud",
    "VOLUME": "volume",
    "GPENCIL": "grease pencil",
    "GREASEPENCIL": "grease pencil",
}
RAY_VISIBILITY = {
    "visible_camera": "Camera",
    "visible_diffuse": "Diffuse",
    "visible_glossy": "Glossy",
    "visible_shadow": "Shadow",
}


@dataclass(frozen=True)
class LocalMesh:
    """A mesh in its own space, triangulated; instances share it."""

    vertices: NDArray[np.float32]  # (V, 3) [m]
    triangles: NDArray[np.int32]  # (T, 3)
    corner_normals: NDArray[np.float32]  # (T, 3, 3)
    slot: NDArray[np.int32]  # (T,) material slot


@dataclass
class Geometry:
    """The triangles gathered so far."""

    vertices: list[NDArray[np.float64]] = field(default_factory=list)
    triangles: list[NDArray[np.int32]] = field(default_factory=list)
    corner_normals: list[NDArray[np.float32]] = field(default_factory=list)
    material: list[NDArray[np.int32]] = field(default_factory=list)
    surface: list[NDArray[np.int32]] = field(default_factory=list)
    surfaces: list[str] = field(default_factory=list)
    vertex_count: int = 0
    _local: dict[int, LocalMesh] = field(default_factory=dict)

    def add(
        self,
        obj: bpy.types.Object,
        matrix: NDArray[np.float64],
        materials: MaterialTable,
        notes: Notes,
    ) -> None:
        """Append one object or instance that is placed by `matrix`."""
        if obj.type in BECOME_MESHES or obj.type in NO_GEOMETRY:
            return
        name = f"Object '{obj.name}'"
        if obj.type in NOT_RENDERED:
            notes.ignored(name, NOT_RENDERED[obj.type].capitalize(), "not rendered")
            return
        if obj.type != "MESH":
            notes.ignored(name, f"Object type {obj.type}", "not rendered")
            return
        note_object(obj, name, notes)
        mesh = self._mesh_of(obj)
        if not len(mesh.triangles):
            return
        slots = material_slots(obj, materials)
        material = slots[np.clip(mesh.slot, 0, len(slots) - 1)]
        visible = material >= 0  # a material without any surface, such as a volume's
        vertices, triangles, normals = placed(mesh, matrix)
        if not visible.all():
            triangles, normals, material = triangles[visible], normals[visible], material[visible]
        self.vertices.append(vertices)
        self.triangles.append(triangles + np.int32(self.vertex_count))
        self.corner_normals.append(normals)
        self.material.append(material)
        self.surface.append(np.full(len(triangles), len(self.surfaces), np.int32))
        self.surfaces.append(obj.name)
        self.vertex_count += len(vertices)

    def arrays(self) -> dict[str, Any]:
        """Return the fields of Scene that hold geometry."""
        return {
            "vertices": _joined(self.vertices, (0, 3), np.float64),
            "triangles": _joined(self.triangles, (0, 3), np.int32),
            "corner_normals": _joined(self.corner_normals, (0, 3, 3), np.float32),
            "material": _joined(self.material, (0,), np.int32),
            "surface": _joined(self.surface, (0,), np.int32),
        }

    def _mesh_of(self, obj: bpy.types.Object) -> LocalMesh:
        # The evaluated mesh lives as long as the depsgraph, so its address identifies it; the
        # object's does not, because the depsgraph reuses one temporary object for instances.
        key = obj.data.as_pointer()
        if key not in self._local:
            self._local[key] = local_mesh(obj.data)
        return self._local[key]


def local_mesh(mesh: bpy.types.Mesh) -> LocalMesh:
    """Copy a mesh out of Blender."""
    mesh.calc_loop_triangles()
    vertices = np.empty(len(mesh.vertices) * 3, np.float32)
    mesh.vertices.foreach_get("co", vertices)
    count = len(mesh.loop_triangles)
    triangles = np.empty(count * 3, np.int32)
    mesh.loop_triangles.foreach_get("vertices", triangles)
    loops = np.empty(count * 3, np.int32)
    mesh.loop_triangles.foreach_get("loops", loops)
    slot = np.empty(count, np.int32)
    mesh.loop_triangles.foreach_get("material_index", slot)
    normals = np.empty(len(mesh.loops) * 3, np.float32)
    if count:
        mesh.corner_normals.foreach_get("vector", normals)
    return LocalMesh(
        vertices.reshape(-1, 3),
        triangles.reshape(-1, 3),
        normals.reshape(-1, 3)[loops].reshape(-1, 3, 3),
        slot,
    )


def placed(
    mesh: LocalMesh, matrix: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.int32], NDArray[np.float32]]:
    """Return vertices, triangles and unit corner normals in world space.

    Normals go with the inverse transpose. A mirroring transform reverses the winding, so the
    triangle's geometric normal stays on the side of its corner normals.
    """
    linear = matrix[:3, :3]
    vertices = mesh.vertices.astype(np.float64) @ linear.T + matrix[:3, 3]
    mirrored = np.linalg.det(linear) < 0.0
    # The cofactor matrix is the inverse transpose times the determinant, and exists for flattened
    # objects too.
    cofactor = np.column_stack(
        (
            np.cross(linear[:, 1], linear[:, 2]),
            np.cross(linear[:, 2], linear[:, 0]),
            np.cross(linear[:, 0], linear[:, 1]),
        )
    )
    # Objects of millimetres or kilometres would under- or overflow in float32 before normalising.
    normals = mesh.corner_normals.astype(np.float64) @ (-cofactor if mirrored else cofactor).T
    lengths = np.linalg.norm(normals, axis=-1, keepdims=True)
    normals = np.divide(normals, lengths, out=np.zeros_like(normals), where=lengths > 0.0)
    triangles = mesh.triangles
    if mirrored:
        triangles, normals = triangles[:, ::-1], normals[:, ::-1]
    return (
        vertices,
        np.ascontiguousarray(triangles),
        np.ascontiguousarray(normals, np.float32),
    )


def material_slots(obj: bpy.types.Object, materials: MaterialTable) -> NDArray[np.int32]:
    """Return the material number of every slot; at least one."""
    found: Sequence[bpy.types.Material | None]
    found = [slot.material for slot in obj.material_slots] or list(obj.data.materials) or [None]
    return np.array([materials.index_of(material, obj.name) for material in found], np.int32)


def note_object(obj: bpy.types.Object, name: str, notes: Notes) -> None:
    """Write down what the object asks for and the renderer does not know."""
    if obj.is_holdout:
        notes.ignored(name, "Holdout", "rendered as a normal object")
    if obj.is_shadow_catcher:
        notes.ignored(name, "Shadow Catcher", "rendered as a normal object")
    rays = [label for flag, label in RAY_VISIBILITY.items() if not getattr(obj, flag, True)]
    if rays:
        notes.ignored(name, "Ray Visibility", f"visible to {', '.join(rays)} rays all the same")
    linking = getattr(obj, "light_linking", None)
    if linking and (linking.receiver_collection or linking.blocker_collection):
        notes.ignored(name, "Light Linking", "every light lights every object")
    for system in obj.particle_systems:
        settings = system.settings
        if settings.type == "HAIR" and settings.render_type == "PATH":
            notes.ignored(name, "Particle Hair", f"'{system.name}' is not rendered")
        elif settings.render_type in ("HALO", "LINE"):
            notes.ignored(name, "Particles", f"'{system.name}' is not rendered")


def _joined(parts: list[Any], shape: tuple[int, ...], dtype: Any) -> NDArray[Any]:
    return np.concatenate(parts).astype(dtype, copy=False) if parts else np.zeros(shape, dtype)
