# SPDX-License-Identifier: GPL-3.0-or-later
"""Export to which rays objects are visible, as Cycles has it, and note what else they ask for."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import bpy
import numpy as np
from numpy.typing import NDArray

from ...photon.scene import ALL_RAYS, CATCHER, HOLDOUT, RAY_BITS, TERMINATOR, Scene
from ...photon.stage.kinds import light_kinds, lobe_kinds
from ...photon.stage.media import MediaThere
from .report import Notes

GEOMETRY_OFFSET = "shadow_terminator_geometry_offset"


@dataclass(frozen=True)
class Rays:
    """Which rays meet an object, where shadow rays begin on it, whose light its own is; and how
    small its triangles shall be for them."""

    visible: int  # bits of Scene.visible
    group: str = ""  # of Scene.light_groups
    terminator: float = TERMINATOR  # of Scene.terminators
    dicing: tuple[float, float] = (0.0, 0.0)  # of Scene.dicing
    linked: int = 0  # of Scene.linked
    excludes: int = 0  # of Scene.excludes


def visible_bits(instance: bpy.types.DepsgraphObjectInstance, layer: bpy.types.ViewLayer) -> int:
    """Bits of Scene.visible of an object, or of an instance: what its instancer may be seen by,
    too; the collections of a view layer count for the instancer. Of lamps before Blender 4.4 their
    own flags alone count."""
    bits = ALL_RAYS
    for name, bit in RAY_BITS.items():
        if not is_visible(instance, name):
            bits &= ~bit
    obj, placed_by = instance.object, _placed_by(instance)
    in_collections = placed_by.original
    if in_collections.holdout_get(view_layer=layer):
        return bits | HOLDOUT
    if in_collections.indirect_only_get(view_layer=layer) and not _is_alone(obj):
        bits &= ~RAY_BITS["camera"]
    catches = obj.is_shadow_catcher or placed_by.is_shadow_catcher
    return bits | CATCHER if catches and bits & RAY_BITS["camera"] else bits


def is_visible(instance: bpy.types.DepsgraphObjectInstance, ray: str) -> bool:
    """Whether it may be seen by rays of a name, as the objects' properties have it."""
    flag = f"visible_{ray}"
    return all(getattr(x, flag, True) for x in (instance.object, _placed_by(instance)))


def _placed_by(instance: bpy.types.DepsgraphObjectInstance) -> bpy.types.Object:
    """Whose flags count for it, too."""
    obj = instance.object
    return instance.parent if instance.is_instance and not _is_alone(obj) else obj


def _is_alone(obj: bpy.types.Object) -> bool:
    return obj.type == "LIGHT" and bpy.app.version < (4, 4)


def group_of(name: str, layer: bpy.types.ViewLayer) -> str:
    """A light group, if the view layer has it."""
    return name if name in layer.lightgroups else ""


def group_of_instance(
    instance: bpy.types.DepsgraphObjectInstance, layer: bpy.types.ViewLayer
) -> str:
    """The light group of an object or an instance, that of its instancer if it has none."""
    own, placed_by = instance.object.lightgroup, instance.parent
    inherits = not own and instance.is_instance
    return group_of(placed_by.lightgroup if inherits else own, layer)


def terminator_of(obj: bpy.types.Object) -> float:
    """The Geometry Offset against coarse edges of shadows, which is Cycles' before Blender 4."""
    of_cycles = getattr(getattr(obj, "cycles", None), GEOMETRY_OFFSET, TERMINATOR)
    return float(getattr(obj, GEOMETRY_OFFSET, of_cycles))


def note_rays(scene: Scene, notes: Notes) -> None:
    """Write down which lights Cycles' shadow rays find and rays of a lobe do not, or the other way
    round: those it weighs as if both did. Shadow rays of rough glass find lamps that are hidden
    from glossy rays or from those of transmission. Those of Translucent BSDFs find no emissive
    objects that are hidden from diffuse rays. Those to the world pass what diffuse rays meet, and
    meet what these pass."""
    kinds = [lobe_kinds()[x.kind] for m in scene.materials for x in m.lobes if x.reflects]
    if any(kind.is_two_sided and not kind.is_diffuse for kind in kinds):
        for light in scene.lights:
            is_lamp = not light_kinds()[light.kind].is_world
            if is_lamp and ("glossy" in light.found_by) != ("transmission" in light.found_by):
                what = "rough glass shows a part of it, and in Cycles another"
                notes.approximated(f"Light '{light.name}'", "Ray Visibility", what)
    if not len(scene.visible):  # all rays meet all
        return
    shadow, diffuse, transmission = (RAY_BITS[x] for x in ("shadow", "diffuse", "transmission"))
    worlds = [light for light in scene.lights if light_kinds()[light.kind].is_world]
    if any("diffuse" in light.found_by and max(light.power) > 0.0 for light in worlds):
        all_of_them, both = np.unique(scene.surface), diffuse | shadow
        what = "the world lights through it, and in Cycles in part"
        _note_surfaces(scene, all_of_them, both, diffuse, what, notes)
        what = "it hides the world, and in Cycles in part"
        _note_surfaces(scene, all_of_them, both, shadow, what, notes)
    if any(kind.is_diffuse and kind.transmits for kind in kinds):
        what = "it lights Translucent BSDFs, and in Cycles hardly"
        emits = np.array([material.is_emissive for material in scene.materials], bool)
        emitters = np.unique(scene.surface[emits[scene.material]])
        _note_surfaces(scene, emitters, diffuse | transmission, transmission, what, notes)


def note_scattered_rays(scene: Scene, depsgraph: bpy.types.Depsgraph, notes: Notes) -> None:
    """Write down which objects are hidden from rays that media have scattered, and which media from
    shadow rays."""
    if not MediaThere.of(scene, scene.materials).scattering:
        return
    if len(scene.visible):
        scatter = np.array([material.medium.scatters for material in scene.materials], bool)
        fogs = np.unique(scene.surface[scatter[scene.material]])
        shadow, diffuse = RAY_BITS["shadow"], RAY_BITS["diffuse"]
        what = "no shadow ray loses light in it, but what it scatters lights no surface"
        _note_surfaces(scene, fogs, shadow | diffuse, diffuse, what, notes)
    for obj in depsgraph.objects:
        if obj.type != "LIGHT" and not getattr(obj, "visible_volume_scatter", True):
            what = "what volumes scatter finds it as what diffuse surfaces scatter"
            notes.approximated(f"Object '{obj.name}'", "Ray Visibility", what)


def _note_surfaces(
    scene: Scene, surfaces: NDArray[Any], asked: int, bits: int, what: str, notes: Notes
) -> None:
    """Of those that of the rays asked for meet those of these bits alone."""
    for number in surfaces.tolist():
        if scene.visible[number] & asked == bits:
            notes.approximated(f"Object '{scene.surfaces[number]}'", "Ray Visibility", what)


def note_object(obj: bpy.types.Object, name: str, notes: Notes) -> None:
    """Write down what the object asks for and the renderer does not know."""
    linking = getattr(obj, "light_linking", None)
    if linking and linking.blocker_collection:
        notes.ignored(name, "Shadow Linking", "all things are in the way of its light")
    for system in obj.particle_systems:
        settings = system.settings
        if settings.render_type in ("HALO", "LINE", "PATH") and settings.type != "HAIR":
            notes.ignored(name, "Particles", f"'{system.name}' is not rendered")
