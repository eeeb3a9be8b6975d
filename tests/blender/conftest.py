# SPDX-License-Identifier: GPL-3.0-or-later
"""An empty Blender scene for every test, a small room, and what the exporter and Cycles make of
them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path

import bpy
import numpy as np
import pytest
from numpy.typing import NDArray

import addon
from addon.blender.export import Report, SpecularModel, snapshot
from addon.blender.export.textures import KEPT_PIXELS
from addon.photon.scene import Material, Scene

from .build import add_light, add_mesh, add_node, finish, new_world, shader_material

Picture = NDArray[np.float32]
Export = Callable[..., tuple[Scene, Report]]
Convert = Callable[..., tuple[Material, Report]]


class SnapshotEngine(bpy.types.RenderEngine):
    """Exports what a render would export, from a render's dependency graph, and stops there."""

    bl_idname = "SNAPSHOT_TEST"
    bl_label = "Snapshot"
    model = SpecularModel.GGX
    found: list[tuple[Scene, Report] | Exception] = []

    def update(self, data: bpy.types.BlendData, depsgraph: bpy.types.Depsgraph) -> None:
        try:
            self.found.append(snapshot(depsgraph, model=self.model, frame_set=self.frame_set))
        except Exception as error:
            self.found.append(error)

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        pass


@pytest.fixture(scope="session", autouse=True)
def registered() -> Iterator[None]:
    """The add-on; an engine that stays registered crashes bpy at exit."""
    addon.register()
    bpy.utils.register_class(SnapshotEngine)
    yield
    bpy.utils.unregister_class(SnapshotEngine)
    addon.unregister()


@pytest.fixture(autouse=True)
def scene() -> bpy.types.Scene:
    """An empty scene, 64 x 32 pixels, with a camera ten metres up that looks down.

    It asks for nothing that gets lost, as Blender's default of clamping indirect light does.
    """
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.resolution_x, scene.render.resolution_y = 64, 32
    camera = bpy.data.objects.new("Camera", bpy.data.cameras.new("Camera"))
    camera.location = (0.0, 0.0, 10.0)
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.cycles.sample_clamp_indirect = 0.0
    return scene


@pytest.fixture
def export(scene: bpy.types.Scene) -> Export:
    """Return the exported scene and report, or raise what the exporter raised."""

    def run(model: SpecularModel = SpecularModel.GGX) -> tuple[Scene, Report]:
        scene = bpy.context.scene  # a test may have opened another file
        SnapshotEngine.model = model
        scene.render.engine = SnapshotEngine.bl_idname
        SnapshotEngine.found.clear()
        bpy.ops.render.render()
        (found,) = SnapshotEngine.found
        if isinstance(found, Exception):
            raise found
        return found

    return run


@pytest.fixture
def convert(export: Export) -> Convert:
    """Return the exported material that a plane wears, and the report."""

    def run(
        material: bpy.types.Material | None, model: SpecularModel = SpecularModel.GGX
    ) -> tuple[Material, Report]:
        add_mesh("Plane").data.materials.append(material)
        scene, report = export(model)
        (converted,) = scene.materials
        return converted, report

    return run


@pytest.fixture
def cycles(cycles_mean: Callable[[int, int], Picture]) -> Callable[[], Picture]:
    """Return what Cycles makes of the open scene: (h, w, 4) premultiplied, the sky transparent."""

    def run() -> Picture:
        cycles = bpy.context.scene.cycles
        cycles.pixel_filter_type, cycles.filter_width = "BOX", 1.0
        return cycles_mean(4, 0)

    return run


@pytest.fixture
def cycles_mean(tmp_path: Path) -> Callable[[int, int], Picture]:
    """Return the same of so many samples and a seed, with the scene's own pixel filter."""

    def run(samples: int, seed: int) -> Picture:
        scene = bpy.context.scene
        scene.render.engine, scene.cycles.device = "CYCLES", "CPU"
        scene.cycles.samples, scene.cycles.seed = samples, seed
        scene.cycles.use_denoising = scene.cycles.use_adaptive_sampling = False
        scene.render.film_transparent = True
        settings = scene.render.image_settings
        settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGBA", "32"
        scene.render.filepath = str(tmp_path / "cycles.exr")
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(scene.render.filepath)
        width, height = image.size
        pixels = np.empty(width * height * 4, np.float32)
        image.pixels.foreach_get(pixels)
        bpy.data.images.remove(image)
        return pixels.reshape(height, width, 4)

    return run


@pytest.fixture
def room(scene) -> bpy.types.Scene:
    """A floor, a wall, a mirror and a spotlight before a grey world; 32 x 32 pixels."""
    grey = shader_material("ShaderNodeBsdfDiffuse", "Grey", Color=(0.7, 0.6, 0.5, 1))
    mirror = shader_material("ShaderNodeBsdfGlossy", "Mirror", Roughness=0.0)
    add_mesh("Floor", scale=(3, 3, 1)).data.materials.append(grey)
    add_mesh(
        "Wall", location=(-3, 0, 3), rotation_euler=(0, math.pi / 2, 0), scale=(3, 3, 1)
    ).data.materials.append(grey)
    add_mesh("Mirror", location=(1.5, 0, 1), rotation_euler=(0.3, -0.3, 0)).data.materials.append(
        mirror
    )
    add_light("Spot", "SPOT", energy=500.0, location=(0, 0, 6), spot_size=1.8)
    world = new_world(scene)
    finish(world, add_node(world, "ShaderNodeBackground", Color=(0.1, 0.2, 0.3, 1)))
    scene.render.engine = "PHOTON_STREAM"
    scene.render.resolution_x = scene.render.resolution_y = 32
    scene.photon_stream.passes, scene.photon_stream.photons = 2, 4096
    scene.photon_stream.use_photons = True
    view_layer = scene.view_layers[0]
    view_layer.use_pass_z = view_layer.use_pass_normal = True
    return scene


@pytest.fixture
def nothing_kept() -> Iterator[None]:
    """No pixels of images are kept from export to export."""
    KEPT_PIXELS.clear()
    yield
    KEPT_PIXELS.clear()
