# SPDX-License-Identifier: GPL-3.0-or-later
"""Render a .blend file from the command line, with PyPI's bpy or inside an installed Blender.

python -m addon.blender.command scene.blend -o scene.png
blender -b --python addon/blender/command.py -- scene.blend -o scene.png
"""

from __future__ import annotations

import argparse
import os
import signal
import sys
import time
import traceback
from collections.abc import Sequence
from pathlib import Path
from types import FrameType
from typing import Any, get_args

if not __package__:  # run by its path, as `blender --python` does
    # The modules beside this file are not meant to be found by their bare names.
    _here = Path(__file__).resolve().parent
    sys.path[:] = [str(_here.parents[1]), *(path for path in sys.path if Path(path) != _here)]
    import addon

    try:
        addon.check_numpy()
    except ImportError as error:
        sys.exit(f"Error: {error}")
    __package__ = "addon.blender"

import bpy

from .. import register, unregister
from ..photon.errors import PhotonStreamError, RenderError, SceneError, SettingsError
from ..photon.jobs.console import ProgressLine, error_text
from ..photon.jobs.interrupts import HANGUP, HUNG_UP, INTERRUPTED, let_in, on_hangup, say_last
from ..photon.jobs.process import last_error
from ..photon.settings import BackendName, Estimator, Settings
from .engine import PhotonStreamEngine
from .session import SESSION

# The first bytes of a .blend: plain, or compressed by zstd (since 3.0) or gzip (before).
BLEND_MAGIC = (b"BLENDER", b"\x28\xb5\x2f\xfd", b"\x1f\x8b")
MULTILAYER = "OPEN_EXR_MULTILAYER"


class Cancelled(Exception):
    """The user pressed Ctrl-C or closed the terminal."""


def parse(argv: Sequence[str]) -> argparse.Namespace:
    """Return the options, with `output` filled in."""
    parser = argparse.ArgumentParser(
        prog="render", description="Render a .blend file with Photon Stream."
    )
    add = parser.add_argument
    add("blend", type=Path, metavar="BLEND", help="the .blend file")
    add(
        "-o",
        "--output",
        type=Path,
        metavar="FILE",
        help=".png, .exr (32-bit float multilayer with every pass) or .npz (the exported scene, "
        "not rendered); default: BLEND's name with .png, in the current folder",
    )
    add("--frame", type=int, help="frame to render; default: the file's current one")
    add("--width", type=int, help="pixels; the height follows unless given")
    add("--height", type=int, help="pixels; the width follows unless given")
    add("--seed", type=int)
    add("--passes", type=int)
    add("--noise-threshold", type=float, help="relative error to stop at; 0: none")
    add("--photons", type=int, help="photons a pass; else three a pixel")
    add("--radius", type=float, help="first radius in metres; 0: automatic")
    add("--estimator", choices=get_args(Estimator))
    add("--backend", choices=get_args(BackendName))
    add("--caustics", action="store_true", help="a pass of them in .exr")
    add("--illuminance", action="store_true", help="a pass of it in .exr [lx]")
    add("--denoise", action="store_true", help="what is noise in the picture")
    add("--denoising-data", action="store_true", help="passes for denoisers in .exr")
    add("--report", type=Path, metavar="FILE", help="write what was approximated as JSON")
    add("--engine", default=PhotonStreamEngine.bl_idname, help="default: %(default)s")
    options = parser.parse_args(argv)
    if options.output is None:
        options.output = Path(options.blend.with_suffix(".png").name)
    return options


def main(argv: Sequence[str] | None = None) -> int:
    """Render; return the exit code: 0, 1 after an error, 130 after Ctrl-C, 129 when the terminal
    was closed."""
    if argv is None:  # Blender keeps what comes before the two dashes for itself
        own = sys.argv.index("--") if "--" in sys.argv else 0
        argv = sys.argv[own + 1 :]
    options = parse(argv)
    temporary: Path | None = None
    heard: list[int] = []

    def interrupt(number: int, frame: FrameType | None) -> None:
        heard.append(number)
        # The first time, let the render end in order. Whoever presses again won't wait.
        if SESSION.cancel.is_set() and number != HANGUP:
            raise KeyboardInterrupt
        SESSION.cancel.set()

    before = signal.signal(signal.SIGINT, interrupt)
    try:
        with on_hangup(interrupt), let_in():
            output, temporary = writable(options.output)
            if options.report:
                options.report, _ = writable(options.report, (".json",))
            said = render(options, temporary)
        os.replace(temporary, output)
        print(f"Wrote {output}\n{said}", flush=True)
    except (Cancelled, KeyboardInterrupt):
        say_last("Cancelled")
        return HUNG_UP if HANGUP in heard else INTERRUPTED
    except (PhotonStreamError, OSError) as error:
        print(f"Error: {error}", file=sys.stderr)
        return 1
    except Exception:  # a bug; Blender itself would print it and exit with 0
        traceback.print_exc()
        return 1
    finally:
        SESSION.cancel.clear()
        # Python does not know Blender's own handler and gives None for it.
        signal.signal(signal.SIGINT, signal.SIG_DFL if before is None else before)
        if temporary is not None:
            temporary.unlink(missing_ok=True)
    return 0


def render(options: argparse.Namespace, output: Path) -> str:
    """Open, render, save as `output`; return the seconds of each phase."""
    start = time.perf_counter()
    replace_registered()
    try:
        open_blend(options.blend)
        scene = bpy.context.scene
        apply(options, scene)
        check_camera(scene)
        opened = time.perf_counter()
        if output.suffix.lower() == ".npz":
            SESSION.snapshot_path = output
        bar = ProgressLine() if sys.stderr.isatty() else None
        SESSION.listener, SESSION.quiet = bar.show if bar else None, True
        try:
            run_render()
        finally:
            SESSION.listener, SESSION.quiet, SESSION.snapshot_path = None, False, None
            if bar:
                bar.clear()
        rendered = time.perf_counter()
        if output.suffix.lower() != ".npz":
            save(scene, output)
        if SESSION.cancel.is_set():
            raise Cancelled
        seconds = {"Opening": opened - start, **SESSION.seconds}
        seconds["Other"] = max(0.0, rendered - start - sum(seconds.values()))
        seconds["Saving"] = time.perf_counter() - rendered
        within = SESSION.info.get("seconds", {})  # the renderer's own account
        text = _times(seconds) + (f"\n  of which {_times(within)}" if within else "")
        known = last_error(SESSION.info)
        passes = f"{SESSION.info.get('passes')} passes"
        return f"{passes}, {error_text(*known)}\n{text}" if known else text
    finally:
        unregister()


def writable(path: Path, kinds: Sequence[str] = (".png", ".exr", ".npz")) -> tuple[Path, Path]:
    """Return `path` in full and a name beside it for the unfinished file; raise if unwritable."""
    path = path.absolute()
    if path.suffix.lower() not in kinds:
        raise SettingsError(f"{path}: the name must end in {' or '.join(kinds)}")
    if path.is_dir() or (path.exists() and not os.access(path, os.W_OK)):
        raise SettingsError(f"{path}: cannot be written")
    temporary = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        with open(temporary, "xb"):
            pass
        temporary.unlink()
    except OSError as error:
        raise SettingsError(f"{path}: cannot be written: {error.strerror}") from error
    return path, temporary


def replace_registered() -> None:
    """Register this copy of the add-on, in place of one that Blender may have loaded."""
    other = bpy.types.RenderEngine.bl_rna_get_subclass_py(PhotonStreamEngine.bl_idname)
    if other is not None:
        sys.modules[other.__module__.rpartition(".blender.")[0]].unregister()
    register()


def open_blend(path: Path) -> None:
    """Open a .blend file; raise SceneError if it is none."""
    try:
        with open(path, "rb") as file:
            start = file.read(8)
    except OSError as error:
        raise SceneError(f"{path}: {error.strerror}") from error
    if not start.startswith(BLEND_MAGIC):
        raise SceneError(f"{path}: not a .blend file")
    try:
        bpy.ops.wm.open_mainfile(
            filepath=str(path.absolute()),
            load_ui=False,
            # As when Blender opens it: scripts run only where the user allows them.
            use_scripts=bpy.context.preferences.filepaths.use_scripts_auto_execute,
        )
    except RuntimeError as error:
        raise SceneError(f"{path}: {_text(error)}") from error


def apply(options: argparse.Namespace, scene: bpy.types.Scene) -> None:
    """Put the options into the opened scene."""
    settings = scene.photon_stream
    try:
        scene.render.engine = options.engine
    except TypeError as error:
        raise SettingsError(f"--engine {options.engine}: no such render engine here") from error
    if options.frame is not None:
        assign(scene, "frame_current", options.frame)
        scene.frame_set(options.frame)
    for name in ("seed", "passes"):
        if getattr(options, name) is not None:
            assign(settings, name, getattr(options, name))
    for name, off in (("noise_threshold", 0.0), ("photons", None), ("radius", 0.0)):
        value = getattr(options, name)
        if value is not None:
            setattr(settings, f"use_{name}", value != off)
            assign(settings, name, value)
    for name in ("estimator", "backend"):
        if getattr(options, name) is not None:
            setattr(settings, name, getattr(options, name).upper())
    settings.denoise |= options.denoise
    if options.report:
        settings.report_path = str(options.report)
    resize(scene.render, options.width, options.height)
    if options.output.suffix.lower() == ".exr":
        for view_layer in scene.view_layers:
            view_layer.use_pass_z = view_layer.use_pass_normal = True
            view_layer.photon_stream.use_pass_error = True
            if options.caustics:
                view_layer.photon_stream.use_pass_caustics = True
            if options.illuminance:
                view_layer.photon_stream.use_pass_illuminance = True
            view_layer.photon_stream.denoising_store_passes |= options.denoising_data


def resize(render: bpy.types.RenderSettings, width: int | None, height: int | None) -> None:
    """Set the resolution in pixels; a missing side follows the file's proportions."""
    across, up = render.resolution_x, render.resolution_y
    if width is None:
        if height is None:
            return
        width = max(1, round(height * across / up))
    elif height is None:
        height = max(1, round(width * up / across))
    Settings(width=width, height=height).check()
    # Blender's sides are 4 to 65536 pixels long: of a quarter of that, 1 to 16384 are.
    times = 4 if min(width, height) < 4 else 1
    render.resolution_x, render.resolution_y = times * width, times * height
    render.resolution_percentage = 100 // times


def assign(owner: Any, name: str, value: float) -> None:
    """Set a property, with an error where Blender would clamp without a word."""
    known = owner.bl_rna.properties[name]
    if not known.hard_min <= value <= known.hard_max:
        raise SettingsError(
            f"{known.name} = {value} is outside [{known.hard_min}, {known.hard_max}]"
        )
    setattr(owner, name, value)


def check_camera(scene: bpy.types.Scene) -> None:
    """Raise SceneError for a scene without camera, where Blender would print that, too."""
    editor = scene.sequence_editor
    strips = "strips_all" if hasattr(editor, "strips_all") else "sequences_all"  # before 4.4
    # These two may show other scenes, through their cameras.
    composed = getattr(scene, "compositing_node_group", None)  # Blender 5.0 on
    composed = composed or (bpy.app.version < (5, 0) and scene.use_nodes)
    if scene.camera is None and not composed and not getattr(editor, strips, ()):
        raise SceneError(f"Scene '{scene.name}' has no camera")


def run_render() -> None:
    """Render the current scene; raise on failure or cancel."""
    if SESSION.cancel.is_set():
        raise Cancelled
    SESSION.error = ""
    try:
        bpy.ops.render.render()
    except RuntimeError as error:  # Blender's own
        if SESSION.cancel.is_set():
            raise Cancelled from error
        raise RenderError(_text(error)) from error
    # Before errors: what is said to a terminal that was closed is one.
    if SESSION.cancelled or SESSION.cancel.is_set():
        raise Cancelled
    if SESSION.error:
        raise RenderError(SESSION.error)


def save(scene: bpy.types.Scene, path: Path) -> None:
    """Write the render result as 8-bit PNG through Blender's colour management, or as EXR."""
    image = scene.render.image_settings
    multilayer = path.suffix.lower() == ".exr"
    if hasattr(image, "media_type"):  # Blender 5.0 on
        image.media_type = "MULTI_LAYER_IMAGE" if multilayer else "IMAGE"
    image.file_format = MULTILAYER if multilayer else "PNG"
    if multilayer:
        image.color_depth = "32"
        image.exr_codec = "ZIP"
    else:
        image.color_depth = "8"
        image.color_mode = "RGBA" if scene.render.film_transparent else "RGB"
    render = scene.render
    aspect = render.pixel_aspect_x, render.pixel_aspect_y
    # These refuse to write multilayer files whose pixels are not square; their pixels are the same.
    if multilayer and (5, 0) <= bpy.app.version < (5, 2):
        render.pixel_aspect_x = render.pixel_aspect_y = 1.0
    try:
        bpy.data.images["Render Result"].save_render(str(path), scene=scene)
    except RuntimeError as error:
        raise RenderError(_text(error)) from error
    finally:
        render.pixel_aspect_x, render.pixel_aspect_y = aspect
    if not path.exists():
        raise RenderError(f"{path.parent}: Blender wrote no picture there")


def _times(seconds: dict[str, float]) -> str:
    return ", ".join(f"{phase} {value:.2f} s" for phase, value in seconds.items())


def _text(error: Exception) -> str:
    """Blender's operators begin what they raise with 'Error: '."""
    return str(error).strip().removeprefix("Error: ").splitlines()[0]


if __name__ == "__main__":
    code = main()
    sys.stdout.flush()
    sys.exit(code)
