# SPDX-License-Identifier: GPL-3.0-or-later
"""Render a .blend with Cycles as a reference: nothing clamped, blurred, denoised or cut short.

Some scenes of blend_scenes wear the paper's lobes: there, Glossy BSDFs with a finite exponent are
replaced by the OSL closure phong_ramp, which is Lafortune & Willems 1994's lobe:
k_s (n + 2) / (2 pi) cos^n.
"""

from __future__ import annotations

import hashlib
import tempfile
from pathlib import Path
from typing import Any

import bpy
import numpy as np
import OpenEXR
from numpy.typing import NDArray

from addon.blender.export import SpecularModel, snapshot
from addon.photon.scene import Scene

BLEND_SCENES = Path(__file__).resolve().parents[2] / "blend_scenes"
REFERENCES = BLEND_SCENES / "references"
LIT = ("studio", "daylight", "kitchen")  # by lights of some size, and a world but in the last
SCENES = ("cornell_box", "cornell_classic", "cornell_mirror", *LIT)
SIZE = 128  # [px] of the square references
SIZES = dict.fromkeys(SCENES, SIZE) | {"daylight": 64}  # the fewer pixels, the more samples each
BOUNCES = 64
TURNED_OFF = ("Clamp Indirect", "Filter Glossy")  # by `prepare`, of what reports name

PHONG_OSL = """
shader phong_lobe(float Exponent = 10, color Color = 0, output closure color BSDF = 0)
{
    color ramp[8] = {Color, Color, Color, Color, Color, Color, Color, Color};
    BSDF = phong_ramp(N, Exponent, ramp);
}
"""

Image = NDArray[np.float32]


def open_blend(name: str, size: int | None = None, model: SpecularModel | None = None) -> Scene:
    """Load a scene of blend_scenes, `size` pixels square or as SIZES says, and export it; by its
    own model of specular lobes, or another."""
    bpy.ops.wm.open_mainfile(filepath=str(BLEND_SCENES / f"{name}.blend"))
    render = bpy.context.scene.render
    render.resolution_x = render.resolution_y = size or SIZES[name]
    render.resolution_percentage = 100
    model = model or saved_model()
    exported, report = snapshot(bpy.context.evaluated_depsgraph_get(), model=model)
    lost = [entry for entry in report.entries if entry.status != "exact"]
    assert model is SpecularModel.PHONG or not lost, lost
    return exported


def saved_model() -> SpecularModel:
    """What the loaded file's property Specular Model says, with or without the add-on."""
    saved = bpy.context.scene.get("photon_stream") or {}
    return [*SpecularModel][saved.get("specular_model", 0)]


def render_cycles(exported: Scene, samples: int, seed: int) -> Image:
    """The scene that is loaded in Blender as Cycles sees it: (h, w, 3), row 0 at the bottom.

    `exported` is the same scene as our renderer sees it: it has the exponents of the lobes.
    """
    replace_lobes(exported)
    return render_loaded(samples, seed)


def render_loaded(samples: int, seed: int) -> Image:
    """The scene that is loaded in Blender with Cycles' own materials, as render_cycles."""
    scene = bpy.context.scene
    prepare(scene, samples, seed)
    with tempfile.TemporaryDirectory() as folder:
        scene.render.filepath = str(Path(folder) / "cycles.exr")
        bpy.ops.render.render(write_still=True)
        return read_exr(Path(scene.render.filepath))


def prepare(scene: bpy.types.Scene, samples: int, seed: int) -> None:
    """Set Cycles up as an unbiased path tracer with a filter of one pixel, as ours has."""
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.device = "CPU"
    cycles.samples, cycles.seed, cycles.use_animated_seed = samples, seed, False
    cycles.use_adaptive_sampling = cycles.use_denoising = cycles.use_guiding = False
    cycles.use_fast_gi = False
    cycles.time_limit = 0
    cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = BOUNCES
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.blur_glossy = 0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    cycles.light_sampling_threshold = 0
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 1.0
    cycles.film_exposure = 1.0
    scene.render.use_border = False
    scene.render.use_simplify = False
    scene.render.film_transparent = False
    scene.render.use_compositing = scene.render.use_sequencer = False
    settings = scene.render.image_settings
    if hasattr(settings, "media_type"):  # Blender 5.0 on
        settings.media_type = "IMAGE"
    settings.file_format, settings.color_mode = "OPEN_EXR", "RGB"
    settings.color_depth, settings.exr_codec = "32", "ZIP"


def replace_lobes(exported: Scene) -> None:
    """Give every Glossy BSDF that we render as a Phong lobe the same lobe in Cycles."""
    exponents = {
        m.name: lobe.parameters["exponent"]
        for m in exported.materials
        for lobe in m.lobes
        if lobe.kind == "phong"
    }
    if not exponents:
        return
    bpy.context.scene.cycles.shading_system = True  # OSL
    bytecode = compile_osl(PHONG_OSL)
    for name, exponent in exponents.items():
        tree = bpy.data.materials[name].node_tree
        for glossy in [node for node in tree.nodes if node.type == "BSDF_GLOSSY"]:
            lobe = script_node(tree, bytecode, exponent, glossy.inputs["Color"].default_value)
            for link in list(glossy.outputs[0].links):
                tree.links.new(lobe.outputs[0], link.to_socket)
            tree.nodes.remove(glossy)


def script_node(
    tree: bpy.types.NodeTree, bytecode: str, exponent: float, colour: Any
) -> bpy.types.Node:
    """Add a Script node of PHONG_OSL.

    Its sockets are made here: Blender's own update of a Script node needs the module oslquery,
    which PyPI's bpy does not have.
    """
    node = tree.nodes.new("ShaderNodeScript")
    node.mode = "EXTERNAL"
    node.bytecode = bytecode
    node.bytecode_hash = hashlib.md5(bytecode.encode(), usedforsecurity=False).hexdigest()
    node.outputs.new("NodeSocketShader", "BSDF")
    node.inputs.new("NodeSocketFloat", "Exponent").default_value = exponent
    node.inputs.new("NodeSocketColor", "Color").default_value = colour
    return node


def compile_osl(source: str) -> str:
    """The bytecode of an OSL shader."""
    import _cycles  # within bpy; importable only once bpy is

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "shader.osl"
        path.write_text(source)
        if not _cycles.osl_compile(str(path), str(path.with_suffix(".oso"))):
            raise RuntimeError("Cycles could not compile the OSL shader")
        return path.with_suffix(".oso").read_text()


def read_exr(path: Path) -> Image:
    """An EXR's RGB as float32 (h, w, 3), row 0 at the bottom."""
    channels = OpenEXR.File(str(path)).channels()
    pixels = np.asarray(channels["RGB"].pixels, np.float32)
    return np.ascontiguousarray(pixels[::-1])


def write_exr(path: Path, image: Image, notes: str) -> None:
    """Write RGB in half precision with a comment; row 0 of `image` is the bottom."""
    header = {
        "compression": OpenEXR.ZIP_COMPRESSION,
        "type": OpenEXR.scanlineimage,
        "comments": notes,
    }
    pixels = np.ascontiguousarray(image[::-1].astype(np.float16))
    OpenEXR.File(header, {"RGB": pixels}).write(str(path))
