# SPDX-License-Identifier: GPL-3.0-or-later
"""The engine's panels draw what Blender has, for each kind of what they are shown for."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import bpy
import pytest

from addon.blender import cycles_panels, panels, visibility_panels

from .build import add_light, add_mesh

pytestmark = pytest.mark.blender


class Layout:
    """Stands for Blender's, which there is none of without windows."""

    def __init__(self) -> None:
        self.drawn: list[str] = []

    def prop(self, owner: Any, name: str, **_: Any) -> None:
        assert name in owner.bl_rna.properties, (owner, name)
        self.drawn.append(name)

    def prop_search(self, owner: Any, name: str, other: Any, found: str, **_: Any) -> None:
        self.prop(owner, name)
        self.prop(other, found)

    def label(self, **_: Any) -> None:
        pass

    def row(self, **_: Any) -> Layout:
        return self

    column = row


def drawn(panel: Any, **shown: Any) -> list[str]:
    shown = {"engine": "PHOTON_STREAM", "view_layer": bpy.context.view_layer, **shown}
    context, layout = SimpleNamespace(**shown), Layout()
    assert panel.poll(context)
    panel.draw(SimpleNamespace(layout=layout, split_layout=lambda: layout), context)
    return layout.drawn


@pytest.mark.parametrize(
    ("kind", "sizes"),
    [
        ("POINT", {"shadow_soft_size"}),
        ("SPOT", {"shadow_soft_size"}),
        ("SUN", {"angle"}),
        ("AREA", {"shape", "size", "size_y", "spread"}),
    ],
)
def test_lights(kind, sizes) -> None:
    lamp = add_light("Lamp", kind)
    if kind == "AREA":
        lamp.data.shape = "ELLIPSE"
    names = drawn(panels.DATA_PT_photon_stream_light, light=lamp.data)
    assert sizes | {"energy", "color"} <= {*names}
    assert sizes == {*names} & {"shadow_soft_size", "angle", "shape", "size", "size_y", "spread"}


def test_rays_and_groups(scene) -> None:
    panel = visibility_panels.OBJECT_PT_photon_stream_rays
    of_mesh = drawn(panel, object=add_mesh("Thing"))
    assert {"visible_transmission", "is_shadow_catcher", "lightgroup"} <= {*of_mesh}
    of_lamp = drawn(panel, object=add_light("Lamp", "POINT"))
    assert "lightgroup" in of_lamp and "is_shadow_catcher" not in of_lamp
    world = bpy.data.worlds.new("World")
    of_world = drawn(visibility_panels.WORLD_PT_photon_stream_group, world=world)
    assert of_world == ["lightgroup", "lightgroups"]
    for cls in visibility_panels.CLASSES:
        assert hasattr(bpy.types, cls.__name__)


def test_settings_of_materials() -> None:
    shown = drawn(
        panels.MATERIAL_PT_photon_stream_settings, material=bpy.data.materials.new("Material")
    )
    assert shown == ["displacement_method", "use_transparent_shadow"]


def test_settings_of_cycles(scene) -> None:
    """What the engine heeds of them can be set where it is the engine."""
    of_scene = drawn(cycles_panels.RENDER_PT_photon_stream_bounces, scene=scene)
    names = [*cycles_panels.BOUNCES, *cycles_panels.CLAMPS, *cycles_panels.CAUSTICS]
    assert of_scene == names
    lamp = add_light("Lamp", "AREA")
    of_lamp = drawn(cycles_panels.DATA_PT_photon_stream_light_settings, light=lamp.data)
    assert {"use_shadow", "max_bounces", "is_portal"} <= {*of_lamp}
    of_bulb = add_light("Bulb", "POINT").data
    assert "is_portal" not in drawn(
        cycles_panels.DATA_PT_photon_stream_light_settings, light=of_bulb
    )
    world = bpy.data.worlds.new("World")
    of_world = drawn(cycles_panels.WORLD_PT_photon_stream_settings, world=world)
    assert of_world == [*cycles_panels.WORLD_RAYS, "max_bounces"]
    of_object = drawn(cycles_panels.OBJECT_PT_photon_stream_motion, object=add_mesh("Thing"))
    assert "motion_steps" in of_object
    of_layer = drawn(cycles_panels.VIEWLAYER_PT_photon_stream_override, scene=scene)
    assert "material_override" in of_layer
    assert "visible_volume_scatter" in drawn(
        visibility_panels.OBJECT_PT_photon_stream_rays, object=lamp
    )
    for cls in cycles_panels.CLASSES:
        assert hasattr(bpy.types, cls.__name__)


def test_panels_of_blender() -> None:
    """Depth of field, and the switch that its error names for stereoscopy, are there."""
    shared = {panel.__name__: panel for panel in panels.shared_panels()}
    assert {"DATA_PT_camera_dof", "RENDER_PT_stereoscopy", "VIEWLAYER_PT_filter"} <= {*shared}
    assert all("PHOTON_STREAM" in panel.COMPAT_ENGINES for panel in shared.values())
