# SPDX-License-Identifier: GPL-3.0-or-later
"""Direct light at visible points, by shadow rays."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...streams import Device, Kernel, PingPong, Stream
from ...streams.device import Layer
from ..kernels.direct import Direct, ShadowRays, ShadowThrough, Unshadowed
from ..kernels.launch import Streams, launch
from ..kernels.records import CHAIN, HIT, ILLUMINANCE, RADIANCE, RAY_DIRECTION, RAY_ORIGIN
from ..stage.needs import SceneNeeds
from ..stage.tables import Tables

Totals = Mapping[str, PingPong]
Size = tuple[int, int]
Arrays = dict[str, NDArray[np.float32]]
_SUMS = {"direct": "sum", "illuminance": "lux_sum"}  # what Unshadowed calls them before it adds
HIT_TRIANGLE = list(HIT.fields).index("triangle")
_RAY = ("shadow_origin", "shadow_direction")
_WIDTH = 256  # of streams of rays that go on
RAYS_AT_ONCE = 4  # shadow rays of a point that one call of another tracer's takes


class DirectLight:
    """By a kernel that traces the rays itself: one launch, whatever the number of lights."""

    def __init__(self, device: Device, layer: Layer, needs: SceneNeeds) -> None:
        self._kernel = Direct(device, layer, needs.direct_defines, made=needs.made)

    def add(
        self, totals: Totals, streams: Streams, tables: Tables, uniforms: dict[str, Any]
    ) -> None:
        """Write the light at the points of `streams` to `totals`, "direct" and, where it is asked
        for, "illuminance"."""
        backs = {name: total.back for name, total in totals.items()}
        launch(self._kernel, {**streams, **backs}, tables, uniforms)
        for total in totals.values():
            total.swap()

    def launches(self) -> dict[str, int]:
        """How often each kernel has run."""
        return {self._kernel.stem: self._kernel.launches}

    def release(self) -> None:
        """Free the kernel."""
        self._kernel.release()


class _Rays:
    """Streams of shadow rays, of one size."""

    def __init__(
        self, device: Device, size: tuple[int, int], illuminance: bool, go_on: bool
    ) -> None:
        """`go_on`: there are those of rays behind what they have met, too."""
        records = {"shadow_origin": RAY_ORIGIN, "shadow_direction": RAY_DIRECTION}
        records |= {"shadow_hit": HIT, "unshadowed": RADIANCE}
        records |= {"unshadowed_lux": ILLUMINANCE} if illuminance else {}
        if go_on:
            behind = {f"next_{name.removeprefix('shadow_')}": x for name, x in records.items()}
            records |= {"chain": CHAIN, **behind}
        self.size = size
        self.streams = {name: Stream(device, record, size) for name, record in records.items()}

    def release(self) -> None:
        """Put the streams back."""
        for stream in self.streams.values():
            stream.release()


class TracedDirectLight:
    """By rays that a kernel of its own traces: some rays of all points in one call."""

    def __init__(
        self, device: Device, layer: Layer, needs: SceneNeeds, any_hit: Kernel, size: Size
    ) -> None:
        """`any_hit`: what traces, or where surfaces are transparent what finds the first hit;
        `size`: of the streams of most points."""
        self._device, self._illuminance = device, needs.illuminance
        self._rays, self._layers = needs.shadow_rays, needs.transparent_depth
        self._aim = ShadowRays(device, layer, needs.direct_defines, made=needs.made)
        self._any_hit = any_hit
        self._add = Unshadowed(device, layer, needs.illuminance_defines)
        self._through: ShadowThrough | None = None
        if needs.transparent:
            defines = {**needs.illuminance_defines, **needs.filter_defines}
            self._through = ShadowThrough(device, layer, defines, made=needs.made)
        self._streams: dict[tuple[Size, bool], _Rays] = {}
        self._of_points(size)

    def add(
        self, totals: Totals, streams: Streams, tables: Tables, uniforms: dict[str, Any]
    ) -> None:
        """As DirectLight.add."""
        own = self._of_points(streams["place"].size).streams
        for first in range(0, self._rays, RAYS_AT_ONCE):
            launch(self._aim, {**streams, **own}, tables, uniforms | {"first_ray": first})
            self._trace(own, "shadow", tables)
            if self._through:
                self._pass_through(own, streams["chain"], tables)
            backs = {name: total.back for name, total in totals.items()}
            sums = {_SUMS[name]: total.front for name, total in totals.items()}
            self._add.run(sums | backs, {name: own[name].texture for name in self._add.tables})
            for total in totals.values():
                total.swap()

    def _of_points(self, size: Size) -> _Rays:
        """Streams of so many rays of each point as are traced in one call."""
        return self._of_size((size[0], size[1] * min(self._rays, RAYS_AT_ONCE)), False)

    def _of_size(self, size: Size, go_on: bool) -> _Rays:
        key = size, go_on
        if key not in self._streams:
            self._streams[key] = _Rays(self._device, size, self._illuminance, go_on)
        return self._streams[key]

    def _trace(self, own: Streams, which: str, tables: Tables) -> None:
        names = ("origin", "direction", "hit")
        launch(self._any_hit, {name: own[f"{which}_{name}"] for name in names}, tables)

    def _pass_through(self, rays: Streams, chain: Stream, tables: Tables) -> None:
        """Let rays that have met transparent surfaces go on behind them: those that meet nothing
        there bring what is left of their light. On the host, where rays are traced, for most have
        met none, and to evaluate what each met takes longer than tracing."""
        which = _met(rays["shadow_hit"].elements(), tables)
        if not len(which):
            return
        brought = [name for name in ("unshadowed", "unshadowed_lux") if name in rays]
        own = {name: rays[name].elements() for name in ("shadow_hit", *brought)}
        found = {name: x[which] for name, x in own.items()}
        found |= {name: rays[name].elements()[which] for name in _RAY}
        found["chain"] = chain.elements()[which % (chain.size[0] * chain.size[1])]
        for layer in range(self._layers):
            behind = self._behind(found, layer, tables)
            there = behind["direction"].any(axis=1)
            free = there & (behind["hit"][:, HIT_TRIANGLE] == 0.0)
            own["shadow_hit"][which[free]] = 0.0
            for name in brought:
                own[name][which[free]] = behind[name][free]
            on = _met(behind["hit"], tables)
            which = which[on]
            if not len(which):
                break
            chains = found["chain"][on]
            found = {_before(name): x[on] for name, x in behind.items()} | {"chain": chains}
        for name, x in own.items():
            rays[name].take(x)

    def _behind(self, found: Arrays, layer: int, tables: Tables) -> Arrays:
        """What becomes of rays that have met transparent surfaces after so many others."""
        assert self._through
        rows = -(-len(found["chain"]) // _WIDTH)
        own = self._of_size((_WIDTH, 1 << (rows - 1).bit_length()), True).streams
        for name, x in found.items():
            own[name].take(x)
        values = {"layer": layer, "transparent_depth": self._layers}
        launch(self._through, own, tables, values)
        self._trace(own, "next", tables)
        behind = {name.removeprefix("next_"): x for name, x in own.items() if "next_" in name}
        return {name: x.elements()[: len(found["chain"])] for name, x in behind.items()}

    def launches(self) -> dict[str, int]:
        """How often each kernel has run."""
        return {kernel.stem: kernel.launches for kernel in self._kernels()}

    def release(self) -> None:
        """Free streams and kernels."""
        for rays in self._streams.values():
            rays.release()
        for kernel in self._kernels():
            kernel.release()

    def _kernels(self) -> list[Kernel]:
        kernels = [self._aim, self._any_hit, self._add]
        return [*kernels, self._through] if self._through else kernels


def _met(hits: NDArray[np.float32], tables: Tables) -> NDArray[np.int64]:
    """Which rays have met transparent surfaces."""
    triangles = hits[:, HIT_TRIANGLE].astype(np.int64)
    met = np.flatnonzero(triangles)
    transparent: NDArray[np.bool_] = tables.transparent[triangles[met] - 1]
    return met[transparent]


def _before(name: str) -> str:
    """What a ray's stream is called where it starts."""
    return name if name.startswith("unshadowed") else f"shadow_{name}"
