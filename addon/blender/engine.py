# SPDX-License-Identifier: GPL-3.0-or-later
"""The render engine: copies the scene, drives the renderer process, fills Blender's result."""

from __future__ import annotations

import contextlib
import logging
import math
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import bpy
import numpy as np

from ..photon.errors import PhotonStreamError, RenderError, SceneError
from ..photon.film.composite import group_name
from ..photon.film.false_colour import false_colour, scene_linear
from ..photon.jobs.console import status_text
from ..photon.jobs.process import Images, Progress
from ..photon.scene import Scene
from ..photon.settings import Region, Settings
from .export import Report, SpecularModel, snapshot
from .export.camera import frame_size
from .export.unsupported import stores_denoising_data
from .session import SESSION
from .settings import mist_of, settings_from

LOG = logging.getLogger("photon_stream")
REPORT_VARIABLE = "PHOTON_STREAM_REPORT"
# Blender prints a line for every status in background mode, so these are rationed there.
BACKGROUND_STATUS_INTERVAL = 1.0  # [s]


@dataclass(frozen=True)
class Pass:
    """A render pass."""

    name: str  # in Blender
    channels: str  # as add_pass wants them
    kind: str  # as register_pass wants it
    shows: str = ""  # of the renderer's images, if not the one of its name

    @property
    def image(self) -> str:
        """The name of the renderer's image."""
        return self.shows or self.name


COMBINED = Pass("Combined", "RGBA", "COLOR")
MIST = Pass("Mist", "Z", "VALUE")
# Blender's own, as Cycles names them: some otherwise from 5.0 on.
IS_NEW = bpy.app.version >= (5, 0)
OWN = {
    "use_pass_z": Pass("Depth", "Z", "VALUE"),
    "use_pass_mist": MIST,
    "use_pass_normal": Pass("Normal", "XYZ", "VECTOR"),
    "use_pass_emit": Pass("Emission" if IS_NEW else "Emit", "RGB", "COLOR", "Emission"),
    "use_pass_environment": Pass("Environment" if IS_NEW else "Env", "RGB", "COLOR", "Background"),
}
ERROR = Pass("Error", "X", "VALUE")
METADATA = (
    *("version", "device", "seed", "passes", "photons", "radius", "error", "noise", "bias"),
    "denoiser",
)
COMPONENTS = {
    "use_pass_direct": Pass("Direct", "RGB", "COLOR"),
    "use_pass_indirect": Pass("Indirect", "RGB", "COLOR"),
    "use_pass_mirror": Pass("Mirror", "RGB", "COLOR"),
    "use_pass_emission": Pass("Emission", "RGB", "COLOR"),
    "use_pass_background": Pass("Background", "RGB", "COLOR"),
}
CAUSTICS = {"use_pass_caustics": Pass("Caustics", "RGB", "COLOR")}  # a part of others
LIGHTING = {
    "use_pass_illuminance": Pass("Illuminance", "X", "VALUE"),
    "use_pass_illuminance_view": Pass("Illuminance View", "RGB", "COLOR", "Illuminance"),
}
# As Cycles has them, in the space of the world.
DENOISING = [Pass("Denoising Normal", "XYZ", "VECTOR"), Pass("Denoising Albedo", "RGB", "COLOR")]
NOISY = Pass("Noisy Image", "RGBA", "COLOR", "Combined")  # which compositors denoise by these


def passes_of(view_layer: bpy.types.ViewLayer) -> list[Pass]:
    """Return the passes that a view layer asks for."""
    passes = [COMBINED, *(entry for flag, entry in OWN.items() if getattr(view_layer, flag))]
    own = view_layer.photon_stream
    passes += [entry for flag, entry in COMPONENTS.items() if getattr(own, flag)]
    passes += [entry for flag, entry in (CAUSTICS | LIGHTING).items() if getattr(own, flag)]
    of_cycles = stores_denoising_data(view_layer)
    passes += DENOISING if own.denoising_store_passes or of_cycles else []
    passes += [NOISY] if of_cycles else []
    passes += [Pass(group_name(x.name), "RGB", "COLOR") for x in view_layer.lightgroups]
    passes += [ERROR] if own.use_pass_error else []
    return [*{entry.name: entry for entry in passes}.values()]  # Emission may be there twice


@dataclass
class Job:
    """One view layer of one frame, copied out of Blender and ready to render."""

    scene: Scene
    settings: Settings
    report: Report
    passes: list[Pass]
    scene_name: str
    layer_name: str
    layers: int  # of the frame
    report_path: str
    warnings: list[str] = field(default_factory=list)


class PhotonStreamEngine(bpy.types.RenderEngine):
    """Photon mapping by stream programming."""

    bl_idname = "PHOTON_STREAM"
    bl_label = "Photon Stream"
    bl_use_preview = False
    bl_use_postprocess = True
    bl_use_eevee_viewport = True
    bl_use_shading_nodes_custom = False

    _job: Job | None = None
    _layers: frozenset[str] = frozenset()  # of a frame: updated and rendered one after the other
    _report = Report()  # of all of them
    _status_time = -math.inf

    def update(self, data: bpy.types.BlendData, depsgraph: bpy.types.Depsgraph) -> None:
        """Copy the scene; Blender holds it still meanwhile, which it does not in `render`."""
        self._job = None
        layer = depsgraph.view_layer_eval.name
        if not self._layers or layer in self._layers:  # Persistent Data keeps this for all frames
            self._layers, self._report = frozenset(), Report()
            SESSION.begin()
        self._layers |= {layer}
        if SESSION.error:  # a view layer before this one failed
            return
        with self._reported():
            start = time.perf_counter()
            self._job = self._prepare(depsgraph)
            SESSION.spend("Exporting", time.perf_counter() - start)

    def render(self, depsgraph: bpy.types.Depsgraph) -> None:
        """Render what `update` copied."""
        job, self._job = self._job, None
        if job is None:  # update() failed and said so
            return
        try:
            with self._reported():
                self._run(job)
        finally:
            with self._reported():
                self._publish(job)

    def update_render_passes(
        self, scene: bpy.types.Scene, renderlayer: bpy.types.ViewLayer
    ) -> None:
        """Tell the compositor which sockets to offer."""
        for entry in passes_of(renderlayer):
            self.register_pass(
                scene, renderlayer, entry.name, len(entry.channels), entry.channels, entry.kind
            )

    def _prepare(self, depsgraph: bpy.types.Depsgraph) -> Job:
        scene = depsgraph.scene_eval
        if scene.render.use_multiview:
            raise SceneError("Stereoscopy is not supported: switch it off in the output properties")
        self.update_stats("", "Exporting the scene")
        size = frame_size(scene.render)
        settings = settings_from(scene, size, border_region(scene.render, size))
        settings.check()
        model = SpecularModel(scene.photon_stream.specular_model)
        exported, report = snapshot(depsgraph, self.camera_override, model, self.frame_set)
        view_layer = depsgraph.view_layer_eval
        properties = scene.photon_stream
        passes = passes_of(view_layer)
        settings = replace(
            settings,
            caller_bytes=blender_bytes(passes, settings),
            caustics=any(entry in passes for entry in CAUSTICS.values()),
            illuminance=any(entry in passes for entry in LIGHTING.values()),
            denoising_data=DENOISING[0] in passes,
            mist=mist_of(scene.world) if MIST in passes else None,
        )
        return Job(
            scene=exported,
            settings=settings,
            report=report,
            passes=passes,
            scene_name=scene.name,
            layer_name=view_layer.name,
            layers=layers_of(scene),
            report_path=bpy.path.abspath(properties.report_path)
            or os.environ.get(REPORT_VARIABLE, ""),
        )

    def _run(self, job: Job) -> None:
        if SESSION.snapshot_path is not None:
            job.scene.save(SESSION.snapshot_path)
            return
        # Before begin_result, which makes room for the passes known by then.
        for entry in job.passes:
            count = len(entry.channels)
            self.add_pass(entry.name, count, entry.channels, layer=job.layer_name)
        finished = self._render(job)
        for name in METADATA if finished else ():  # into the files that Blender writes
            label = f"photon_stream.{job.layer_name}.{name}"
            self.get_result().stamp_data_add_field(label, str(SESSION.info[name]))

    def _render(self, job: Job) -> bool:
        """Return whether the picture is done; False if cancelled."""
        phase, since = "", time.perf_counter()
        result: bpy.types.RenderResult | None = None
        finished = False
        events = SESSION.renderer.render(
            job.scene,
            job.settings,
            layer=job.layer_name,
            layers=job.layers,
            images=images_of(job.passes),
        )
        try:
            for progress in events:
                now = time.perf_counter()
                if progress.phase != phase:
                    if phase:
                        SESSION.spend(phase, now - since)
                    phase, since = progress.phase, now
                if self.test_break() or SESSION.cancel.is_set():
                    SESSION.cancelled = True
                    return False
                job.warnings += progress.warnings
                if progress.images is not None:
                    # No sooner: by now the renderer knows that there is memory for it.
                    result = result or self._begin(job)
                    write_images(result.layers[0], job.passes, progress.images)
                    self.update_result(result)
                self._show(progress, now)
                if progress.done:
                    SESSION.spend(phase, now - since)
                    SESSION.info = dict(progress.info)
                    finished = True
                    return True
        finally:
            events.close()  # what stops the renderer, however this loop was left
            if result is not None:
                # A cancelled render keeps the passes done, as with Cycles; a failed one shows
                # nothing.
                self._end(result, kept=finished or SESSION.cancelled)
        raise RenderError("The renderer stopped without a picture")

    def _begin(self, job: Job) -> bpy.types.RenderResult:
        """Have Blender make room for the picture; it clips this size to the border."""
        width, height = job.settings.width, job.settings.height
        return self.begin_result(0, 0, width, height, layer=job.layer_name)

    def _end(self, result: bpy.types.RenderResult, kept: bool) -> None:
        if not kept:
            clear_images(result.layers[0])
            self.update_result(result)
        self.end_result(result, cancel=not kept)

    def _show(self, progress: Progress, now: float) -> None:
        if SESSION.listener is not None:
            SESSION.listener(progress)
            return
        self.update_progress(progress.passes_done / max(1, progress.passes))
        if bpy.app.background and not progress.done:
            if now - self._status_time < BACKGROUND_STATUS_INTERVAL:
                return
            self._status_time = now
        self.update_stats("", status_text(progress))

    def _publish(self, job: Job) -> None:
        """Hand out the scene report: panel, console, file."""
        report = job.report.with_warnings(job.warnings)
        self._report = self._report.joined(report)
        SESSION.reports[job.scene_name] = self._report
        redraw_properties()
        for warning in report.warnings:
            self.report({"WARNING"}, f"Photon Stream: {warning}")
        if bpy.app.background:
            for line in report.lines():
                print(f"Photon Stream: {line}", flush=True)
        if job.report_path:
            try:
                Path(job.report_path).write_text(self._report.as_json(), encoding="utf-8")
            except OSError as error:
                raise RenderError(f"Report File: {error}") from error

    @contextlib.contextmanager
    def _reported(self) -> Iterator[None]:
        """Turn whatever is raised into an error that Blender shows.

        `report` stops operators and scripts and keeps the picture from being saved, `error_set`
        shows up in the render window; an exception of ours alone would do neither. Without windows
        both end up as lines on the console: there, one says it.
        """
        try:
            yield
        except PhotonStreamError as error:
            self._fail(str(error))
        except Exception as error:
            LOG.exception("Photon Stream failed")
            self._fail(f"{type(error).__name__}: {error} (a bug; the console has the details)")

    def _fail(self, text: str) -> None:
        SESSION.error = SESSION.error or text
        if SESSION.quiet:
            return
        if not bpy.app.background:
            self.error_set(text)
        self.report({"ERROR"}, f"Photon Stream: {text}")


def border_region(render: bpy.types.RenderSettings, size: tuple[int, int]) -> Region | None:
    """Return the pixels of the render border, None without one.

    Blender multiplies in float32 and cuts the fraction off; so does this, to the pixel.
    """
    if not render.use_border:
        return None
    width, height = np.float32(size[0]), np.float32(size[1])
    x0, x1 = (int(np.float32(x) * width) for x in (render.border_min_x, render.border_max_x))
    y0, y1 = (int(np.float32(y) * height) for y in (render.border_min_y, render.border_max_y))
    return x0, y0, x1, y1


def blender_bytes(passes: list[Pass], settings: Settings) -> int:
    """Return what a view layer takes in Blender [bytes]: float32, and twice while it is rendered,
    in the engine's result and in the one shown."""
    x0, y0, x1, y1 = settings.frame_region
    return 2 * 4 * sum(len(entry.channels) for entry in passes) * (x1 - x0) * (y1 - y0)


def layers_of(scene: bpy.types.Scene) -> int:
    """How many view layers a frame has."""
    used = 1 if scene.render.use_single_layer else sum(x.use for x in scene.view_layers)
    return max(1, used)


def images_of(passes: list[Pass]) -> list[str]:
    """The renderer's images that passes show."""
    return [entry.image for entry in passes]


def write_images(layer: bpy.types.RenderLayer, passes: list[Pass], images: Images) -> None:
    """Copy the renderer's images into the passes of a result's layer."""
    for entry in passes:
        target = layer.passes.find_by_name(entry.name, "")
        image = images[entry.image]
        if entry.name == "Illuminance View":
            image = scene_linear(false_colour(image, legend_inside=True))
        flat = np.ascontiguousarray(image, np.float32).reshape(-1)
        target.rect.foreach_set(flat)


def clear_images(layer: bpy.types.RenderLayer) -> None:
    """Blank a result's layer: what a failed render leaves must not pass for a picture."""
    for target in layer.passes:
        target.rect.foreach_set(np.zeros(len(target.rect) * target.channels, np.float32))


def redraw_properties() -> None:
    """Show what changed in the engine's panels."""
    for manager in bpy.data.window_managers:
        for window in manager.windows:
            for area in window.screen.areas:
                if area.type == "PROPERTIES":
                    area.tag_redraw()
