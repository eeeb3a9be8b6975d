# SPDX-License-Identifier: GPL-3.0-or-later
"""Evaluate a world's nodes in all directions: what Blender runs in a process of its own.

Arguments: a file of world_nodes.py's description, and the .npy to write, float32
(height, width, 3).
It imports nothing of ours, for it is run as a file.
"""

from __future__ import annotations

import json
import math
import sys
import tempfile
from pathlib import Path
from typing import Any

import bpy
import numpy as np

SAMPLES = 4  # a pixel's
# What shines far more than nearly all else, such as the sun's disc, is sampled more.
BRIGHT, MOST, BRIGHT_SAMPLES = 20.0, 64, 1024


def main(description: str, output: str) -> None:
    given = json.loads(Path(description).read_text(encoding="utf-8"))
    bpy.ops.wm.read_factory_settings(use_empty=True)
    if hasattr(bpy.data, "colorspace"):  # Blender 5.0 on
        bpy.ops.wm.set_working_color_space(working_space=given["space"], convert_colors=False)
    scene = bpy.context.scene
    scene.world = bpy.data.worlds.new("World")
    if bpy.app.version < (5, 0):
        scene.world.use_nodes = True
    build(scene.world.node_tree, given["nodes"], given["is_shader"])
    prepare(scene, given["width"])
    pixels = render(scene, SAMPLES)
    box = bright_box(pixels)
    if box:
        rows, columns = box
        pixels[rows, columns] = render(scene, BRIGHT_SAMPLES, box)[rows, columns]
    np.save(output, pixels)


def build(tree: Any, nodes: list[dict[str, Any]], is_shader: bool) -> None:
    """Make the nodes; the last one's output is the world's."""
    tree.nodes.clear()
    made: list[Any] = []
    for given in nodes:
        node = tree.nodes.new(given["kind"])
        made.append(node)
        for name, value in given["properties"].items():
            setattr(node, name, value)
        if "ramp" in given:
            fill_ramp(node.color_ramp, given["ramp"])
        if "curves" in given:
            fill_curves(node.mapping, given["curves"])
        if "image" in given:
            node.image = image_of(given["image"])
        for index, value in given["values"].items():
            node.inputs[int(index)].default_value = value
        for index, value in given.get("told", {}).items():
            node.outputs[int(index)].default_value = value
        for index, (number, output) in given["links"].items():
            tree.links.new(made[number].outputs[output], node.inputs[int(index)])
    surface = tree.nodes.new("ShaderNodeOutputWorld").inputs["Surface"]
    last = made[-1].outputs[nodes[-1]["output"]]
    if not is_shader:
        background = tree.nodes.new("ShaderNodeBackground")
        tree.links.new(last, background.inputs["Color"])
        last = background.outputs[0]
    tree.links.new(last, surface)


def fill_ramp(ramp: Any, given: dict[str, Any]) -> None:
    for name in ("color_mode", "interpolation", "hue_interpolation"):
        setattr(ramp, name, given[name])
    while len(ramp.elements) > 1:
        ramp.elements.remove(ramp.elements[-1])
    for number, (position, colour) in enumerate(given["elements"]):
        element = ramp.elements.new(position) if number else ramp.elements[0]
        element.position, element.color = position, colour


def fill_curves(mapping: Any, given: dict[str, Any]) -> None:
    for name, value in given["properties"].items():
        setattr(mapping, name, value)
    for curve, points in zip(mapping.curves, given["curves"], strict=True):
        while len(curve.points) < len(points):
            curve.points.new(0.5, 0.5)
        for point, (location, handle) in zip(curve.points, points, strict=True):
            point.location, point.handle_type = location, handle
    mapping.update()


def image_of(given: dict[str, Any]) -> Any:
    if "pixels" in given:
        pixels = np.load(given["pixels"])
        height, width = pixels.shape[:2]
        is_float = given["is_float"]
        image = bpy.data.images.new("Image", width, height, alpha=True, float_buffer=is_float)
        if not is_float:  # else they are linear, as Blender hands them out
            image.colorspace_settings.name = given["colours"]
        image.alpha_mode = given["alpha"]  # before there are pixels, which it may change
        image.pixels.foreach_set(pixels.ravel())
        image.pack()  # or Cycles would not see them
    else:
        image = bpy.data.images.load(given["path"])
        image.colorspace_settings.name = given["colours"]
        image.alpha_mode = given["alpha"]
    return image


def prepare(scene: Any, width: int) -> None:
    """A camera that sees every direction where an Environment Texture has it, by Cycles."""
    data = bpy.data.cameras.new("Camera")
    scene.camera = bpy.data.objects.new("Camera", data)
    scene.collection.objects.link(scene.camera)
    scene.camera.rotation_euler = (math.pi / 2, 0.0, -math.pi / 2)
    owner = data if hasattr(data, "panorama_type") else data.cycles  # before Blender 5.0
    data.type, owner.panorama_type = "PANO", "EQUIRECTANGULAR"
    render, cycles = scene.render, scene.cycles
    render.engine, cycles.device = "CYCLES", "CPU"
    render.resolution_x, render.resolution_y = width, width // 2
    render.resolution_percentage, render.film_transparent = 100, False
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 1.0
    scene.world.cycles.sampling_method = "NONE"  # no light is sampled
    settings = render.image_settings
    if hasattr(settings, "media_type"):  # Blender 5.0 on
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_mode, settings.color_depth = "OPEN_EXR", "RGB", "32"


def render(scene: Any, samples: int, box: tuple[slice, slice] | None = None) -> Any:
    """(height, width, 3); of a box alone, the rest is undefined."""
    width, height = scene.render.resolution_x, scene.render.resolution_y
    scene.cycles.samples, scene.render.use_border = samples, box is not None
    if box:
        rows, columns = box
        scene.render.border_min_x, scene.render.border_max_x = (
            columns.start / width,
            columns.stop / width,
        )
        scene.render.border_min_y, scene.render.border_max_y = (
            rows.start / height,
            rows.stop / height,
        )
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder) / "world.exr")
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(scene.render.filepath)
        pixels = np.empty(width * height * image.channels, np.float32)
        image.pixels.foreach_get(pixels)
        bpy.data.images.remove(image)
    return np.ascontiguousarray(pixels.reshape(height, width, -1)[..., :3])


def bright_box(pixels: Any) -> tuple[slice, slice] | None:
    """Rows and columns of what is bright, if it is small."""
    brightness = pixels.mean(axis=2)
    bright = brightness > BRIGHT * np.percentile(brightness, 99.9)
    ends = []
    for axis in (1, 0):
        found = np.flatnonzero(bright.any(axis=axis))
        if not len(found) or found[-1] - found[0] >= MOST:
            return None
        last = bright.shape[1 - axis]
        ends.append(slice(max(int(found[0]) - 2, 0), min(int(found[-1]) + 3, last)))
    return ends[0], ends[1]


if __name__ == "__main__":
    main(*sys.argv[-2:])
