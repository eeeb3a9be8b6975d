# SPDX-License-Identifier: GPL-3.0-or-later
"""Export triangles: every renderable object and instance, in world space."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...photon.errors import SceneError
from ...photon.scene import ALL_RAYS, MOST_TRIANGLES, TERMINATOR, Material, Moving
from . import unsupported
from .attributes import OF_INSTANCES, corner_attribute, instance_attribute, object_record
from .hair import hair_of, has_hair
from .instances import Instances, hides_attributes
from .linking import linked_arrays
from .materials import MaterialTable
from .meshes import (
    LocalMesh,
    is_mirroring,
    local_mesh,
    local_strands,
    placed,
    placed_tangents,
    read_mesh,
    stretches,
)
from .nodes.attributes import INSTANCER
from .open_meshes import MOST_LEAN, is_open, lean_of
from .report import Notes
from .spaces import Space, make_unit, user_of
from .strand_attributes import strand_attribute
from .strands import STRANDS, Strands, strands_of
from .tangents import Tangent, corner_tangents
from .visibility import Rays, note_object

# Whose triangles these are: the address of a mesh, and whether of its particles' hair.
Key = tuple[int, bool]
# How something moves in the scene: a mesh, its vertices' run, and its triangles' corners.
Follow = Callable[[LocalMesh, tuple[int, int], NDArray[np.int32]], Moving | None]

# Object types that Blender turns into meshes on the way; the depsgraph lists each of them a second
# time, as the mesh that is exported.
BECOME_MESHES = {"CURVE", "SURFACE", "FONT", "META"}
NO_GEOMETRY = {"EMPTY", "CAMERA", "ARMATURE", "LATTICE", "SPEAKER", "LIGHT", "LIGHT_PROBE"}
GREASE_PENCILS = {"GPENCIL", "GREASEPENCIL"}  # the second from Blender 4.3 on


@dataclass
class Geometry:
    """The triangles gathered so far."""

    viewport: bool = False  # of the viewport's dependency graph: hair has fewer points
    frame: float = 0.0
    meshes: bool = True  # the view layer shows these
    hair: bool = True
    vertices: list[NDArray[np.float64]] = field(default_factory=list)
    triangles: list[NDArray[np.int32]] = field(default_factory=list)
    corner_normals: list[NDArray[np.float32]] = field(default_factory=list)
    corner_tangents: list[NDArray[np.float32] | None] = field(default_factory=list)
    flat: list[NDArray[np.bool_]] = field(default_factory=list)
    material: list[NDArray[np.int32]] = field(default_factory=list)
    surface: list[NDArray[np.int32]] = field(default_factory=list)
    surfaces: list[str] = field(default_factory=list)
    visible: list[int] = field(default_factory=list)
    terminators: list[float] = field(default_factory=list)
    dicing: list[tuple[float, float]] = field(default_factory=list)
    groups: list[str] = field(default_factory=list)
    links: list[tuple[int, int]] = field(default_factory=list)
    objects: list[NDArray[np.float64]] = field(default_factory=list)
    attributes: list[dict[int, NDArray[np.float32]]] = field(default_factory=list)
    moving: list[Moving] = field(default_factory=list)
    _spaces: list[Space] = field(default_factory=list)
    vertex_count: int = 0
    counts: Counter[str] = field(default_factory=Counter)  # of triangles, by objects' names
    _local: dict[Key, LocalMesh] = field(default_factory=dict)
    _strands: dict[Key, Strands] = field(default_factory=dict)
    # Meshes without the faces of some slots.
    _open: dict[tuple[Key, tuple[bool, ...]], bool] = field(default_factory=dict)
    _attributes: dict[Any, NDArray[np.float32]] = field(default_factory=dict)
    _instances: Instances = field(default_factory=Instances)
    _tangents: dict[Any, NDArray[np.float64] | None] = field(default_factory=dict)

    def add(
        self,
        instance: bpy.types.DepsgraphObjectInstance,
        matrix: NDArray[np.float64],
        rays: Rays,
        materials: MaterialTable,
        notes: Notes,
        follow: Follow | None = None,
    ) -> None:
        """Append one object or instance that is placed by `matrix`; `follow` tells how it moves."""
        obj = instance.object
        if obj.type in BECOME_MESHES or obj.type in NO_GEOMETRY:
            return
        name = f"Object '{obj.name}'"
        if obj.type in GREASE_PENCILS:
            notes.exact(name, "Grease Pencil", "Blender draws it over the picture, as over Cycles'")
            return
        if obj.type == "VOLUME":
            notes.ignored(name, "Volume", "not rendered")
            return
        if is_gas(obj):
            notes.ignored(name, "Smoke or fire", "not rendered, nor is the box of its domain")
            return
        if obj.type in STRANDS:
            what = "triangles stand for it; it does not move"
            notes.approximated(name, obj.type.capitalize(), what)
            follow = None
        elif obj.type != "MESH":
            notes.ignored(name, f"Object type {obj.type}", "not rendered")
            return
        note_object(obj, name, notes)
        unsupported.note_object(obj, name, notes)
        place = partial(self._place, instance, matrix, rays, materials, notes)
        if instance.show_self and {"MESH": self.meshes, "CURVES": self.hair}.get(obj.type, True):
            place((obj.data.as_pointer(), False), self._mesh_of(obj), follow)
        if obj.type == "MESH" and instance.show_particles and self.hair and has_hair(obj):
            place((obj.data.as_pointer(), True), self._hair_of(obj, notes), None)

    def _place(
        self,
        instance: bpy.types.DepsgraphObjectInstance,
        matrix: NDArray[np.float64],
        rays: Rays,
        materials: MaterialTable,
        notes: Notes,
        key: Key,
        mesh: LocalMesh,
        follow: Follow | None,
    ) -> None:
        """Append a mesh, or hair."""
        obj = instance.object
        if not len(mesh.triangles):
            return
        is_mesh = key not in self._strands
        slots = material_slots(obj, materials, partial(self._is_open, key, notes))
        slots = slots if is_mesh else np.array([*map(materials.still, slots)], np.int32)
        material = slots[np.clip(mesh.slot, 0, len(slots) - 1)]
        there = material >= 0  # a material without any surface, such as a volume's
        self._count(obj.name, int(there.sum()))
        stretched = stretches(matrix)
        vertices, triangles, normals = placed(mesh, matrix, stretched)
        tangents = self._tangents_of(obj, matrix, material, materials, notes) if is_mesh else None
        mirrors, flat = is_mirroring(matrix), mesh.flat
        attributes = self._attributes_of(instance, key, mirrors, material, materials, notes)
        if not there.all():
            triangles, normals, material = triangles[there], normals[there], material[there]
            tangents = None if tangents is None else tangents[there]
            flat = flat[there]
            attributes = {number: values[there] for number, values in attributes.items()}
        self.vertices.append(vertices)
        self.triangles.append(triangles + np.int32(self.vertex_count))
        self.corner_normals.append(normals)
        self.corner_tangents.append(tangents)
        self.flat.append(flat)
        self.material.append(material)
        self.surface.append(np.full(len(triangles), len(self.surfaces), np.int32))
        self.surfaces.append(obj.name)
        self.visible.append(rays.visible)
        self.terminators.append(rays.terminator)
        self.dicing.append(rays.dicing if is_mesh else (0.0, 0.0))
        self.groups.append(rays.group)
        self.links.append((rays.linked, rays.excludes))
        self.objects.append(object_record(instance, matrix))
        self.attributes.append(attributes)
        moving = None
        if follow:
            run = self.vertex_count, self.vertex_count + len(vertices)
            corners = mesh.corners[:, ::-1] if mirrors else mesh.corners
            moving = follow(mesh, run, np.ascontiguousarray(corners[there]))
        if moving:
            self.moving.append(moving)
        is_turned = stretched and not (
            any(rays.dicing)
            or any(map(materials.is_local, slots))
            or (moving and len(moving.matrices) > 0)
        )
        number = len(self.moving) - 1 if moving else None
        self._spaces.append(Space(user_of(instance, key), is_turned, number))
        self.vertex_count += len(vertices)

    def _count(self, name: str, more: int) -> None:
        """Raise SceneError as soon as there are more triangles than can be rendered."""
        self.counts[name] += more
        if self.counts.total() > MOST_TRIANGLES:
            (most, count), *_ = self.counts.most_common(1)
            raise SceneError(
                f"Object '{most}' and its instances have {count} triangles or more; with others "
                f"there are more than {MOST_TRIANGLES}, which is the most that can be rendered: "
                "subdivide it less for renders, or hide some"
            )

    def arrays(self, materials: Sequence[Material]) -> dict[str, Any]:
        """Return the fields of Scene that hold geometry; of objects what programs read, and which
        triangles are flat if some may move."""
        make_unit(self._spaces, self.corner_normals, self.moving)
        has_programs = any(any(material.programs) for material in materials)
        moves = any(material.displacement for material in materials)
        terminators = np.array(self.terminators, np.float32)
        own = terminators != np.float32(TERMINATOR)
        asked = (has_programs or moves) and bool(self.objects)
        objects = np.array(self.objects) if asked else np.zeros((0, 6, 4))
        return {
            "corner_attributes": self._joined_attributes(),
            "objects": objects,
            "vertices": _joined(self.vertices, (0, 3), np.float64),
            "triangles": _joined(self.triangles, (0, 3), np.int32),
            "corner_normals": _joined(self.corner_normals, (0, 3, 3), np.float32),
            "corner_tangents": self._joined_tangents(),
            "dicing": np.array(self.dicing if moves else [], np.float32).reshape(-1, 2),
            "flat": _joined(self.flat if moves else [], (0,), np.bool_),
            "material": _joined(self.material, (0,), np.int32),
            "surface": _joined(self.surface, (0,), np.int32),
            "visible": np.array(self.visible if {*self.visible} - {ALL_RAYS} else [], np.uint8),
            "terminators": terminators if own.any() else terminators[:0],
            "moving": tuple(self.moving),
            **linked_arrays(self.links),
            "surface_groups": tuple(self.groups) if any(self.groups) else (),
        }

    def _mesh_of(self, obj: bpy.types.Object) -> LocalMesh:
        # The evaluated mesh lives as long as the depsgraph, so its address identifies it; the
        # object's does not, because the depsgraph reuses one temporary object for instances.
        key = obj.data.as_pointer(), False
        if key not in self._local:
            if obj.type in STRANDS:
                self._strands[key] = strands_of(obj)
                self._local[key] = local_strands(self._strands[key])
            else:
                self._local[key] = read_mesh(obj, local_mesh)
        return self._local[key]

    def _hair_of(self, obj: bpy.types.Object, notes: Notes) -> LocalMesh:
        key = obj.data.as_pointer(), True
        if key not in self._local:
            self._strands[key], is_coarse = hair_of(obj, self.viewport)
            self._local[key] = local_strands(self._strands[key])
            what = "triangles stand for it; it does not move"
            if is_coarse:
                what += ", and has fewer points"
            notes.approximated(f"Object '{obj.name}'", "Particle Hair", what)
        return self._local[key]

    def _is_open(self, key: Key, notes: Notes, name: str, gaps: tuple[bool, ...]) -> bool:
        """Whether a mesh is open, or without the faces of some slots. Only asked for glass: smooth
        normals that lean too far are noted, too."""
        if (key, gaps) not in self._open:
            mesh = self._local[key]
            stays = ~np.array(gaps)[np.clip(mesh.slot, 0, len(gaps) - 1)]
            self._open[key, gaps] = is_open(mesh.vertices, mesh.triangles[stays])
            lean = lean_of(mesh.vertices[mesh.triangles], mesh.normals[mesh.corners])
            if lean > MOST_LEAN:
                what = f"they lean {lean:.0f} degrees from its faces: its caustics are rough"
                notes.approximated(f"Object '{name}'", "Smooth normals of glass", what)
        return self._open[key, gaps]

    def _tangents_of(
        self,
        obj: bpy.types.Object,
        matrix: NDArray[np.float64],
        material: NDArray[np.int32],
        materials: MaterialTable,
        notes: Notes,
    ) -> NDArray[np.float32] | None:
        """The tangents (T, 3, 3) of an object's corners, zero where materials (T,) need none; None
        if none of these does. Where there is no such UV map the material becomes black."""
        found = None
        for number in np.unique(material[material >= 0]):
            tangent = materials.tangents[number]
            if tangent is None:
                continue
            of_it, local = material == number, self._local_tangents(obj, tangent)
            if local is None:
                missing = f"UV map '{tangent.uv_map}' of a Tangent node"
                what = "there is none: black, as in Cycles"
                notes.approximated(f"Object '{obj.name}'", missing, what)
                material[of_it] = materials.black()
                continue
            if found is None:
                found = np.zeros((len(material), 3, 3), np.float32)
            found[of_it] = placed_tangents(local[of_it], matrix)
        return found

    def _local_tangents(
        self, obj: bpy.types.Object, tangent: Tangent
    ) -> NDArray[np.float64] | None:
        key = obj.data.as_pointer(), tangent
        if key not in self._tangents:
            mesh = self._mesh_of(obj)
            corners = mesh.triangles, mesh.vertices[mesh.triangles], mesh.normals[mesh.corners]
            read = partial(corner_tangents, tangent, *corners)
            self._tangents[key] = read_mesh(obj, read)
        return self._tangents[key]

    def _attributes_of(
        self,
        instance: bpy.types.DepsgraphObjectInstance,
        which: Key,
        is_mirrored: bool,
        material: NDArray[np.int32],
        materials: MaterialTable,
        notes: Notes,
    ) -> dict[int, NDArray[np.float32]]:
        """What materials (T,) ask of the corners of an object's triangles, (T, 3, 4) by number."""
        found: dict[int, NDArray[np.float32]] = {}
        for wears in np.unique(material[material >= 0]):
            of_it = material == wears
            for number, what in enumerate(materials.contexts[wears].attributes):
                if number not in found:
                    found[number] = np.zeros((len(material), 3, 4), np.float32)
                if what[0] == INSTANCER and hides_attributes(instance):
                    feature = f"Attribute '{what[1]}' of its instances"
                    unread = "before Blender 5.0 nobody can read it: a property, else 0, is used"
                    notes.approximated(f"Object '{instance.parent.name}'", feature, unread)
                if what[0] in OF_INSTANCES:
                    found[number][of_it] = instance_attribute(
                        instance, what, self._instances, self.frame
                    )
                else:
                    values = self._attribute_of(instance.object, which, what)[of_it]
                    found[number][of_it] = values[:, ::-1] if is_mirrored else values
        return found

    def _attribute_of(
        self, obj: bpy.types.Object, which: Key, what: tuple[str, ...]
    ) -> NDArray[np.float32]:
        """An attribute of a mesh, or of hair (T, 3, 4)."""
        key = which, what
        if key not in self._attributes:
            if which in self._strands:
                self._attributes[key] = strand_attribute(what, self._strands[which], obj)
            else:
                read = partial(corner_attribute, what, self._mesh_of(obj).triangles, obj)
                self._attributes[key] = read_mesh(obj, read)
        return self._attributes[key]

    def _joined_attributes(self) -> NDArray[np.float32]:
        """(T, count, 3, 4), of each triangle what its material asks; (0, 0, 3, 4) if none does."""
        count = max((max(found, default=-1) + 1 for found in self.attributes), default=0)
        if not count or not self.material:
            return np.zeros((0, 0, 3, 4), np.float32)
        joined = np.zeros((sum(map(len, self.material)), count, 3, 4), np.float32)
        first = 0
        for material, found in zip(self.material, self.attributes, strict=True):
            for number, values in found.items():
                joined[first : first + len(material), number] = values
            first += len(material)
        return joined

    def _joined_tangents(self) -> NDArray[np.float32]:
        """(T, 3, 3), zero where none is needed; (0, 3, 3) if that is everywhere."""
        if all(part is None for part in self.corner_tangents):
            return np.zeros((0, 3, 3), np.float32)
        parts = [
            np.zeros((len(material), 3, 3), np.float32) if part is None else part
            for part, material in zip(self.corner_tangents, self.material, strict=True)
        ]
        return _joined(parts, (0, 3, 3), np.float32)


def is_gas(obj: bpy.types.Object) -> bool:
    """Whether it is a domain of smoke or fire, whose mesh Cycles does not show either."""
    domains = (
        modifier.domain_settings
        for modifier in obj.modifiers
        if modifier.type == "FLUID" and modifier.fluid_type == "DOMAIN"
    )
    return any(settings and settings.domain_type == "GAS" for settings in domains)


def material_slots(
    obj: bpy.types.Object,
    materials: MaterialTable,
    is_open: Callable[[str, tuple[bool, ...]], bool],
) -> NDArray[np.int32]:
    """Return the material number of every slot; at least one. `is_open`: whether the mesh of an
    object of this name is, without the faces of some slots."""
    found: Sequence[bpy.types.Material | None]
    found = [slot.material for slot in obj.material_slots] or list(obj.data.materials) or [None]

    def has_open_mesh() -> bool:
        return is_open(obj.name, tuple(map(materials.is_gap, found)))

    return np.array(
        [materials.index_of(material, obj.name, has_open_mesh) for material in found], np.int32
    )


def _joined(parts: list[Any], shape: tuple[int, ...], dtype: Any) -> NDArray[Any]:
    if len(parts) == 1:
        return np.asarray(parts[0])
    return np.concatenate(parts).astype(dtype, copy=False) if parts else np.zeros(shape, dtype)
