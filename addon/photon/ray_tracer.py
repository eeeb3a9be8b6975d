# SPDX-License-Identifier: GPL-3.0-or-later
"""The eye pass: EyeRays -> Tracer -> Shade -> Direct, estimate -> Scatter while any is alive."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import Any

import numpy as np
import photon_stream_native as native

from ..streams import TEXEL, Device, Kernel, PingPong, Stream
from ..streams.declaration import present
from ..streams.device import Layer, nothing
from .blur import Blur
from .combine import CombineAll, CombineMirror, CombinePrimary
from .coverage import Coverage
from .cuts import Cuts
from .direct import Direct, ShadowRays, Unshadowed
from .eye_rays import EyeRays
from .geometry import Frame
from .launch import launch
from .native_kernels import NativeCoverage, NativeCuts, tracer_for
from .needs import SceneNeeds
from .radius_field import Radii
from .records import (
    BLUR,
    COVERAGE,
    CUTS,
    HIT,
    IRRADIANCE,
    RADIANCE,
    RAY_DIRECTION,
    RAY_ORIGIN,
    THROUGHPUT,
)
from .scatter import Scatter
from .scene import Scene
from .settings import Region, Settings, filter_define
from .shade import LOBES, POINT, Shade
from .splat import View
from .tables import Tables
from .tracer import Tracer

# Estimates the irradiance at (place, facing), within the cuts, into the last stream; the view only
# for points that the camera sees directly.
Estimate = Callable[[Stream, Stream, Stream, Stream, View | None], None]

RAYS_AT_ONCE = 4  # shadow rays of a point that the native core traces in one call
_FAR = 1.0e37  # clip distances beyond float32's use


class _Buffers:
    """The streams of a region's size: those that a scene has a use for."""

    def __init__(
        self,
        device: Device,
        size: tuple[int, int],
        settings: Settings,
        needs: SceneNeeds,
        on_host: bool,
    ) -> None:
        """Made at once, for the first pass to find them: it took an eighth longer."""
        ones = {"hit": HIT, **POINT, **present(LOBES, needs.eye_defines)}
        ones |= dict.fromkeys(("direct_seen", "indirect_seen", "background_seen"), RADIANCE)
        ones |= dict.fromkeys(("normal_seen", "combined"), RADIANCE)
        ones |= {"irradiance": IRRADIANCE, "zeros": TEXEL}
        twos = {"origin": RAY_ORIGIN, "direction": RAY_DIRECTION, "direct": RADIANCE, "blur": BLUR}
        self.shadow: dict[str, Stream] = {}
        if needs.shadow_rays and on_host:
            several = size[0], size[1] * min(needs.shadow_rays, RAYS_AT_ONCE)
            shadow = {"shadow_origin": RAY_ORIGIN, "shadow_direction": RAY_DIRECTION}
            shadow |= {"shadow_hit": HIT, "unshadowed": RADIANCE}
            self.shadow = {name: Stream(device, record, several) for name, record in shadow.items()}
        if needs.photons:
            ones |= {"cuts": CUTS} | (
                {"coverage": COVERAGE} if settings.boundary_correction else {}
            )
        if needs.secondary_rays:
            twos |= {"throughput": THROUGHPUT, "mirror": RADIANCE, "mirror_indirect": RADIANCE}
        self.size = size
        self.one = {name: Stream(device, record, size) for name, record in ones.items()}
        self.two = {name: PingPong(device, record, size) for name, record in twos.items()}
        for stream in self.one.values():
            stream.clear()

    def release(self) -> None:
        """Free them."""
        for stream in (*self.one.values(), *self.shadow.values()):
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
        on_host = triangles is not None
        self._buffers = _Buffers(device, (x1 - x0, y1 - y0), settings, needs, on_host)
        self._camera = _camera_in_scene_units(scene, frame)
        self._world_to_camera = _column_major(np.linalg.inv(self._camera["matrix"]))
        kinds: list[type[Kernel]] = [EyeRays, CombinePrimary, CombineAll]
        if needs.surfaces:
            kinds.append(Shade)
        if needs.secondary_rays:
            kinds += [Scatter, CombineMirror]
        if needs.photons:
            kinds.append(Blur)
        self.kernels: dict[type[Kernel], Kernel] = {
            kind: kind(device, layer, needs.eye_defines, made=needs.made) for kind in kinds
        }
        if needs.shadow_rays:
            for kind in (ShadowRays, Unshadowed) if on_host else (Direct,):
                self.kernels[kind] = kind(device, layer, needs.direct_defines, made=needs.made)
        if needs.surfaces:
            self.kernels[Tracer] = tracer_for(device, layer, triangles)
        self._any_hit: Kernel | None = None
        if needs.shadow_rays and on_host:
            self._any_hit = tracer_for(device, layer, triangles, any_hit=True)
        if needs.photons and settings.boundary_correction:
            if triangles:
                self.kernels[Cuts] = NativeCuts(device, triangles)
                self.kernels[Coverage] = NativeCoverage(device, triangles, settings.filter)
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
        self._meet_surfaces(index, 0, origin, direction)
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
        irradiance, coverage = self._indirect(index, 0, estimate, radii, view)
        images = {
            name: one[f"{name}_seen"] for name in ("direct", "indirect", "background", "normal")
        }
        self._run(
            CombinePrimary,
            {**one, "direct": direct, "irradiance": irradiance, "coverage": coverage},
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
        if self._needs.secondary_rays:
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

    def _meet_surfaces(self, index: int, depth: int, origin: Stream, direction: Stream) -> None:
        """Trace rays and shade the points where they end."""
        if not self._needs.surfaces:
            return  # the streams were made clear: no hits, no places
        streams = {**self._buffers.one, "origin": origin, "direction": direction}
        self._run(Tracer, streams)
        self._run(Shade, streams, self._draw(index, depth))

    def _direct(self, index: int, depth: int, direction: Stream) -> Stream:
        """Direct light at the visible points, by shadow rays."""
        buffers, total = self._buffers, self._buffers.two["direct"]
        total.restart(buffers.one["zeros"])
        streams = {**buffers.one, **buffers.shadow, "direction": direction}
        draw = self._draw(index, depth) | {"light_count": len(self._tables.lights)}
        if Direct in self.kernels:
            self._run(Direct, streams | {"direct": total.back}, draw)
            total.swap()
        for first in range(0, self._needs.shadow_rays if self._any_hit else 0, RAYS_AT_ONCE):
            assert self._any_hit
            self._run(ShadowRays, streams, draw | {"first_ray": first})
            ports = ("origin", "direction", "hit")
            self._any_hit.run({name: buffers.shadow[f"shadow_{name}"] for name in ports})
            found = {name: buffers.shadow[name].texture for name in ("unshadowed", "shadow_hit")}
            self.kernels[Unshadowed].run({"sum": total.front, "direct": total.back}, found)
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
        coverage = self._coverage(index, depth, radii)
        estimate(one["place"], one["facing"], cuts, irradiance, view)
        return irradiance, coverage

    def _cuts(self, radii: Radii) -> Stream:
        """Where each visible point's disc ends at what stands on its surface."""
        one = self._buffers.one
        if Cuts in self.kernels:  # else the stream was made clear: nothing is cut off
            kernel = self.kernels[Cuts]
            kernel.run(
                {name: one[name] for name in ("place", "facing", "diffuse", "cuts")},
                self._tables.of(kernel) | radii.tables(kernel),
                radii.uniforms,
            )
        return one["cuts"]

    def _coverage(self, index: int, depth: int, radii: Radii) -> Stream:
        """The share of the filter on each visible point's own surface and within its cuts."""
        if Coverage not in self.kernels:
            return self._unit_coverage
        one, kernel = self._buffers.one, self.kernels[Coverage]
        kernel.run(
            {name: one[name] for name in (*POINT, "cuts", "coverage")},
            self._tables.of(kernel) | radii.tables(kernel),
            self._pixels(depth) | radii.uniforms | probes_of(index),
        )
        return one["coverage"]

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
        for depth in range(self._needs.chain_depth):
            alive = self._run(
                Scatter,
                {
                    **one,
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
            self._meet_surfaces(index, depth + 1, origin.front, direction.front)
            direct = self._direct(index, depth + 1, direction.front)
            irradiance, coverage = self._indirect(index, depth + 1, estimate, radii, None)
            self._run(
                CombineMirror,
                {
                    **one,
                    "sum": image.front,
                    "indirect_sum": indirect.front,
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
                **self._buffers.one,
                "sum": blur.front,
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
        return launch(self.kernels[kind], streams, self._tables, uniforms, count, meanwhile)

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
