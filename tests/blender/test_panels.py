# SPDX-License-Identifier: GPL-3.0-or-later
"""The engine's panels draw what Blender has, for each kind of what they are shown for."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import bpy
import pytest

from addon.blender import panels, visibility_panels

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
