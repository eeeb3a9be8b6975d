# SPDX-License-Identifier: GPL-3.0-or-later
"""The eye pass: EyeRays -> Tracer -> Direct, estimate -> Mirror while any ray is alive."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

import numpy as np
import photon_stream_native as native

from ..streams import TEXEL, Device, Kernel, PingPong, Stream
from ..streams.device import Layer, nothing
from .blur import Blur
from .combine import CombineAll, CombineMirror, CombinePrimary
from .coverage import Coverage
from .cuts import Cuts
from .direct import Direct
from .eye_rays import EyeRays
from .geometry import Frame, Tables
from .lit import Lit
from .mirror import Mirror
from .native_kernels import NativeCoverage, NativeCuts, tracer_for
from .needs import SceneNeeds
from .radius_field import Radii
from .records import (
    BLUR,
    COVERAGE,
    CUTS,
    FACING,
    HIT,
    IRRADIANCE,
    PLACE,
    RADIANCE,
    RAY_DIRECTION,
    RAY_ORIGIN,
    SHADING,
    THROUGHPUT,
)
from .scene import Scene
from .settings import Region, Settings, filter_define
from .splat import View
from .tracer import Tracer
from .visible_points import VisiblePoints

# Estimates the irradiance at (place, facing), within the cuts, into the last stream; the view only
# for points that the camera sees directly.
Estimate = Callable[[Stream, Stream, Stream, Stream, View | None], None]

_FAR = 1.0e37  # clip distances beyond float32's use


class _Buffers:
    """The streams of a region's size: those that a scene has a use for."""

    def __init__(
        self, device: Device, size: tuple[int, int], settings: Settings, needs: SceneNeeds
    ) -> None:
        """Made at once, for the first pass to find them: it took an eighth longer."""
        ones = {"hit": HIT, "place": PLACE, "facing": FACING, "shading": SHADING}
        ones |= dict.fromkeys(("direct_seen", "indirect_seen", "background_seen"), RADIANCE)
        ones |= dict.fromkeys(("normal_seen", "combined"), RADIANCE)
        ones |= {"irradiance": IRRADIANCE, "zeros": TEXEL}
        twos = {"origin": RAY_ORIGIN, "direction": RAY_DIRECTION, "direct": RADIANCE, "blur": BLUR}
        if needs.lights:
            ones |= {"shadow_origin": RAY_ORIGIN, "shadow_direction": RAY_DIRECTION}
            ones |= {"shadow_hit": HIT, "unshadowed": RADIANCE}
        if needs.photons:
            ones |= {"cuts": CUTS} | (
                {"coverage": COVERAGE} if settings.boundary_correction else {}
            )
        if needs.mirror:
            twos |= {"throughput": THROUGHPUT, "mirror": RADIANCE, "mirror_indirect": RADIANCE}
        self.size = size
        self.one = {name: Stream(device, record, size) for name, record in ones.items()}
        self.two = {name: PingPong(device, record, size) for name, record in twos.items()}
        for stream in self.one.values():
            stream.clear()

    def release(self) -> None:
        """Free them."""
        for stream in self.one.values():
            stream.release()
        for pair in self.two.values():
            pair.release()


class RayTracer:
    """Traces a pass's eye rays over regions of the frame, all of one size, into images."""

    def __init__(
        self,
        device: Device,
        layer: Layer,
        tables: Tables,
        frame: Frame,
        scene: Scene,
        settings: Settings,
        needs: SceneNeeds,
        triangles: native.Tracer | None,
        region: Region,
    ) -> None:
        """`triangles`: what the native core traces, if it shall; `region`: one of them."""
        self._tables, self._scene, self._settings, self._needs = tables, scene, settings, needs
        self._region = x0, y0, x1, y1 = region
        self._waits = device.keeps_lists(layer)  # while the host asks it something
        self._ended: dict[Region, int] = {}  # at which depth all secondary rays had
        self._started: tuple[int, View, Stream] | None = None  # pass, its view and direct light
        self._buffers = _Buffers(device, (x1 - x0, y1 - y0), settings, needs)
        self._camera = _camera_in_scene_units(scene, frame)
        self._world_to_camera = _column_major(np.linalg.inv(self._camera["matrix"]))
        kinds: list[type[Kernel]] = [EyeRays, CombinePrimary, CombineAll]
        if needs.surfaces:
            kinds.append(VisiblePoints)
        if needs.lights:
            kinds += [Direct, Lit]
        if needs.mirror:
            kinds += [Mirror, CombineMirror]
        if needs.photons:
            kinds.append(Blur)
        self.kernels: dict[type[Kernel], Kernel] = {kind: kind(device, layer) for kind in kinds}
        if needs.surfaces:
            self.kernels[Tracer] = tracer_for(device, layer, triangles)
        self._any_hit: Kernel | None = None
        if needs.lights:
            self._any_hit = tracer_for(device, layer, triangles, any_hit=True)
        if needs.photons and settings.boundary_correction:
            if triangles:
                self.kernels[Cuts] = NativeCuts(device, triangles, scene.materials)
                self.kernels[Coverage] = NativeCoverage(
                    device, triangles, scene.materials, settings.filter
                )
            else:
                self.kernels[Cuts] = Cuts(device, layer)
                self.kernels[Coverage] = Coverage(device, layer, filter_define(settings))
        self._unit = Stream(device, THROUGHPUT, self._buffers.size)
        self._unit_coverage = Stream(device, COVERAGE, self._buffers.size)
        for stream in (self._unit, self._unit_coverage):
            stream.fill(1.0)
        ambient = scene.background if settings.ambient else (0.0, 0.0, 0.0)
        self._world = {"ambient": ambient, "background": scene.background}

    def start(self, index: int, region: Region) -> None:
        """Launch what of a pass no photon tells: eye rays, and the direct light where they end."""
        if self._started and (self._started[0], self._region) == (index, region):
            return
        self._region = region
        origin, direction = (self._buffers.two[name].front for name in ("origin", "direction"))
        view = self._send_eye_rays(index, origin, direction)
        self._meet_surfaces(origin, direction)
        self._started = index, view, self._direct(index, 0, direction)

    def trace(
        self,
        index: int,
        region: Region,
        estimate: Estimate | None,
        radii: Radii,
        meanwhile: Callable[[], None] = nothing,
    ) -> dict[str, Stream]:
        """Pass `index`'s images of `region` by name: direct, indirect, mirror, mirror_indirect,
        background, normal, blur, combined. `radii` are what `estimate` uses; `meanwhile` is called
        each time that the host is about to wait for the device, if it has to."""
        self.start(index, region)
        assert self._started
        (_, view, direct), self._started = self._started, None
        one, two = self._buffers.one, self._buffers.two
        hit, facing = one["hit"], one["facing"]
        place, shading = one["place"], one["shading"]
        irradiance, coverage = self._indirect(index, 0, estimate, radii, view)
        images = {
            name: one[f"{name}_seen"] for name in ("direct", "indirect", "background", "normal")
        }
        self._run(
            CombinePrimary,
            {"hit": hit, "place": place, "facing": facing, "shading": shading}
            | {"direct": direct, "irradiance": irradiance, "coverage": coverage}
            | {f"{name}_seen": stream for name, stream in images.items()},
            self._world
            | {
                "background_alpha": 0.0 if self._settings.transparent else 1.0,
                "eye": tuple(map(float, self._camera["matrix"][:3, 3])),
                "view_axis": tuple(map(float, -self._camera["matrix"][:3, 2])),
            },
        )
        two["blur"].restart(one["zeros"])
        self._add_blur(irradiance, coverage, self._unit)
        images["mirror"] = images["mirror_indirect"] = one["zeros"]
        if self._needs.mirror:
            images["mirror"], images["mirror_indirect"] = self._mirror_images(
                index, estimate, radii, meanwhile
            )
        images["combined"] = one["combined"]
        images["blur"] = two["blur"].front
        parts = ("direct", "indirect", "mirror", "mirror_indirect", "background", "blur")
        self._run(
            CombineAll,
            {f"{name}_seen": images[name] for name in parts} | {"combined": images["combined"]},
        )
        return images

    @property
    def zeros(self) -> Stream:
        """Of a region's size, never written."""
        return self._buffers.one["zeros"]

    def footprint(self) -> tuple[float, list[float] | None]:
        """How wide a pixel is at distance 1 from the eye, or everywhere and None [scene units]."""
        left, right, _, _ = self._camera["window"]
        eye = None if self._camera["orthographic"] else self._camera["matrix"][:3, 3].tolist()
        return (right - left) / self._settings.width, eye

    def _send_eye_rays(self, index: int, origin: Stream, direction: Stream) -> View:
        settings = self._settings
        x0, y0, x1, y1 = self._region
        camera, jitter = self._camera, pixel_jitter(settings.seed, index)
        left, right, bottom, top = camera["window"]
        self._run(
            EyeRays,
            {"origin": origin, "direction": direction},
            {
                "camera": _column_major(camera["matrix"]),
                "window": camera["window"],
                "clip": camera["clip"],
                "orthographic": camera["orthographic"],
                "frame_size": (settings.width, settings.height),
                "region_origin": (x0, y0),
                "jitter": jitter,
            },
        )
        # A pixel's centre on the screen is where its jittered ray went.
        u0, v0 = x0 + jitter[0] - 0.5, y0 + jitter[1] - 0.5
        du, dv = (right - left) / settings.width, (top - bottom) / settings.height
        return View(
            self._world_to_camera,
            (
                left + u0 * du,
                left + (u0 + x1 - x0) * du,
                bottom + v0 * dv,
                bottom + (v0 + y1 - y0) * dv,
            ),
            camera["orthographic"],
        )

    def _meet_surfaces(self, origin: Stream, direction: Stream) -> None:
        """Trace rays and find their visible points."""
        one = self._buffers.one
        hit = one["hit"]
        if not self._needs.surfaces:
            return  # the streams were made clear: no hits, no places
        self._run(Tracer, {"origin": origin, "direction": direction, "hit": hit})
        self._run(
            VisiblePoints,
            {
                "direction": direction,
                "hit": hit,
                "place": one["place"],
                "facing": one["facing"],
                "shading": one["shading"],
            },
        )

    def _direct(self, index: int, depth: int, direction: Stream) -> Stream:
        """Direct light at the visible points: one shadow ray a light."""
        one = self._buffers.one
        total = self._buffers.two["direct"]
        total.restart(one["zeros"])
        for light in self._needs.lights:
            assert self._any_hit
            shadow_origin = one["shadow_origin"]
            shadow_direction = one["shadow_direction"]
            unshadowed, hit = one["unshadowed"], one["shadow_hit"]
            self._run(
                Direct,
                {
                    "place": one["place"],
                    "facing": one["facing"],
                    "shading": one["shading"],
                    "direction": direction,
                    "shadow_origin": shadow_origin,
                    "shadow_direction": shadow_direction,
                    "unshadowed": unshadowed,
                },
                self._draw(index, depth) | {"light_index": light},
            )
            self._any_hit.run(
                {"origin": shadow_origin, "direction": shadow_direction, "hit": hit},
                self._tables.of(self._any_hit),
            )
            self._run(
                Lit,
                {"sum": total.front, "unshadowed": unshadowed, "hit": hit, "total": total.back},
            )
            total.swap()
        return total.front

    def _indirect(
        self, index: int, depth: int, estimate: Estimate | None, radii: Radii, view: View | None
    ) -> tuple[Stream, Stream]:
        """Irradiance at the visible points, and its coverage."""
        one = self._buffers.one
        irradiance = one["irradiance"]
        if estimate is None:
            return irradiance, self._unit_coverage
        cuts = self._cuts(radii)
        coverage = self._coverage(index, depth, cuts, radii)
        estimate(one["place"], one["facing"], cuts, irradiance, view)
        return irradiance, coverage

    def _cuts(self, radii: Radii) -> Stream:
        """Where each visible point's disc ends at what stands on its surface."""
        cuts = self._buffers.one["cuts"]
        if Cuts in self.kernels:  # else the stream was made clear: nothing is cut off
            kernel = self.kernels[Cuts]
            kernel.run(
                {
                    "place": self._buffers.one["place"],
                    "facing": self._buffers.one["facing"],
                    "cuts": cuts,
                },
                self._tables.of(kernel) | radii.tables(kernel),
                radii.uniforms,
            )
        return cuts

    def _coverage(self, index: int, depth: int, cuts: Stream, radii: Radii) -> Stream:
        """The share of the filter on each visible point's own surface and within its cuts."""
        if Coverage not in self.kernels:
            return self._unit_coverage
        coverage = self._buffers.one["coverage"]
        kernel = self.kernels[Coverage]
        kernel.run(
            {
                "place": self._buffers.one["place"],
                "facing": self._buffers.one["facing"],
                "shading": self._buffers.one["shading"],
                "cuts": cuts,
                "coverage": coverage,
            },
            self._tables.of(kernel) | radii.tables(kernel),
            self._pixels(depth) | radii.uniforms | probes_of(index),
        )
        return coverage

    def _mirror_images(
        self,
        index: int,
        estimate: Estimate | None,
        radii: Radii,
        meanwhile: Callable[[], None],
    ) -> tuple[Stream, Stream]:
        """Follow secondary rays up to the depth limit, while any is alive.

        A GPU would wait while it is asked: not before the depth at which all had ended before.
        """
        one, two = self._buffers.one, self._buffers.two
        origin, direction = two["origin"], two["direction"]
        throughput = two["throughput"]
        image, indirect = two["mirror"], two["mirror_indirect"]
        image.restart(one["zeros"])
        indirect.restart(one["zeros"])
        carried = self._unit
        for depth in range(self._needs.mirror_depth):
            alive = self._run(
                Mirror,
                {
                    "place": one["place"],
                    "facing": one["facing"],
                    "shading": one["shading"],
                    "direction": direction.front,
                    "throughput": carried,
                    "next_origin": origin.back,
                    "next_direction": direction.back,
                    "next_throughput": throughput.back,
                },
                self._draw(index, depth),
                count=(look := depth >= self._ended.get(self._region, 0)),
                meanwhile=meanwhile,
            )
            if look and alive == 0:
                if self._waits:
                    self._ended[self._region] = depth
                break
            for pair in (origin, direction, throughput):
                pair.swap()
            carried = throughput.front
            self._meet_surfaces(origin.front, direction.front)
            direct = self._direct(index, depth + 1, direction.front)
            irradiance, coverage = self._indirect(index, depth + 1, estimate, radii, None)
            self._run(
                CombineMirror,
                {
                    "sum": image.front,
                    "indirect_sum": indirect.front,
                    "hit": one["hit"],
                    "facing": one["facing"],
                    "direct": direct,
                    "irradiance": irradiance,
                    "coverage": coverage,
                    "throughput": carried,
                    "total": image.back,
                    "indirect_total": indirect.back,
                },
                self._world,
            )
            image.swap()
            indirect.swap()
            self._add_blur(irradiance, coverage, carried)
        return image.front, indirect.front

    def _add_blur(self, irradiance: Stream, coverage: Stream, throughput: Stream) -> None:
        """Add what the estimate at the visible points tells about its own bias."""
        if Blur not in self.kernels:
            return
        blur = self._buffers.two["blur"]
        self._run(
            Blur,
            {
                "sum": blur.front,
                "facing": self._buffers.one["facing"],
                "irradiance": irradiance,
                "coverage": coverage,
                "throughput": throughput,
                "total": blur.back,
            },
        )
        blur.swap()

    def _draw(self, index: int, depth: int) -> dict[str, Any]:
        """What random numbers of a pixel depend on."""
        return self._pixels(depth) | {"pass_index": index}

    def _pixels(self, depth: int) -> dict[str, Any]:
        """What they depend on whatever the pass."""
        return {
            "seed": self._settings.seed,
            "depth": depth,
            "frame_size": (self._settings.width, self._settings.height),
            "region_origin": self._region[:2],
        }

    def _run(
        self,
        kind: type[Kernel],
        streams: Mapping[str, Stream],
        uniforms: Mapping[str, Any] | None = None,
        count: bool = False,
        meanwhile: Callable[[], None] = nothing,
    ) -> int:
        kernel = self.kernels[kind]
        return kernel.run(streams, self._tables.of(kernel), uniforms, count, meanwhile)

    def release(self) -> None:
        """Free streams and kernels."""
        self._buffers.release()
        for stream in (self._unit, self._unit_coverage):
            stream.release()
        for kernel in self.kernels.values():
            kernel.release()
        if self._any_hit:
            self._any_hit.release()


def probes_of(index: int) -> dict[str, int]:
    """How many coverage probes pass `index` sends from a point, and how many were sent before.

    More at first: the quotient of few probes is off at edges. Measured on cornell_classic: after
    one pass relMSE 0.05 with 4 of them, 0.016 with 8, 0.015 with 16.
    """
    first = 8 * min(index, 3)
    return {"probes": 8 if index < 3 else 4, "first_probe": first + 4 * max(index - 3, 0)}


def pixel_jitter(seed: int, index: int) -> tuple[float, float]:
    """Where in its pixel each eye ray of a pass goes: the R2 sequence (Roberts 2018), shifted by
    the seed."""
    step = np.array([0.7548776662466927, 0.5698402909980532])
    x, y = (_first_jitter(seed) + index * step) % 1.0
    return float(x), float(y)


@lru_cache(maxsize=16)
def _first_jitter(seed: int) -> Any:
    return np.random.Generator(np.random.Philox(seed)).random(2)


def _camera_in_scene_units(scene: Scene, frame: Frame) -> dict[str, Any]:
    camera = scene.camera
    matrix = np.array(camera.matrix, np.float64)
    matrix[:3, 3] = frame.points(matrix[:3, 3])
    orthographic = camera.kind == "ORTHO"
    unit = frame.scale if orthographic else 1.0
    return {
        "matrix": matrix,
        "window": tuple(edge / unit for edge in camera.window),
        "clip": tuple(min(c / frame.scale, _FAR) for c in (camera.clip_start, camera.clip_end)),
        "orthographic": orthographic,
    }


def _column_major(matrix: Any) -> tuple[float, ...]:
    return tuple(map(float, matrix.T.ravel()))
