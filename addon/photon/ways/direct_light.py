# SPDX-License-Identifier: GPL-3.0-or-later
"""Direct light at visible points, by shadow rays."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ...streams import Device, Kernel, PingPong, Stream
from ...streams.device import Layer
from ..kernels.direct import Direct, ShadowRays, ShadowThrough, Unshadowed
from ..kernels.launch import Streams, launch
from ..kernels.records import HIT, ILLUMINANCE, RADIANCE, RAY_DIRECTION, RAY_ORIGIN
from ..stage.needs import SceneNeeds
from ..stage.tables import Tables

Totals = Mapping[str, PingPong]
_SUMS = {"direct": "sum", "illuminance": "lux_sum"}  # what Unshadowed calls them before it adds
HIT_TRIANGLE = list(HIT.fields).index("triangle")
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


class TracedDirectLight:
    """By rays that a kernel of its own traces: some rays of all points in one call."""

    def __init__(
        self,
        device: Device,
        layer: Layer,
        needs: SceneNeeds,
        any_hit: Kernel,
        size: tuple[int, int],
    ) -> None:
        """`any_hit`: what traces, or where surfaces are transparent what finds the first hit;
        `size`: of the points' streams."""
        self._rays, self._layers = needs.shadow_rays, needs.transparent_depth
        self._aim = ShadowRays(device, layer, needs.direct_defines, made=needs.made)
        self._any_hit = any_hit
        self._add = Unshadowed(device, layer, needs.illuminance_defines)
        several = size[0], size[1] * min(self._rays, RAYS_AT_ONCE)
        records = {"shadow_origin": RAY_ORIGIN, "shadow_direction": RAY_DIRECTION}
        records |= {"shadow_hit": HIT, "unshadowed": RADIANCE}
        records |= {"unshadowed_lux": ILLUMINANCE} if needs.illuminance else {}
        self._streams = {name: Stream(device, record, several) for name, record in records.items()}
        self._through: ShadowThrough | None = None
        self._next: dict[str, Stream] = {}  # of rays that go on
        if needs.transparent:
            defines = {**needs.illuminance_defines, **needs.filter_defines}
            self._through = ShadowThrough(device, layer, defines, made=needs.made)
            names = [name for name in records if name != "shadow_hit"]
            self._next = {name: Stream(device, records[name], several) for name in names}

    def add(
        self, totals: Totals, streams: Streams, tables: Tables, uniforms: dict[str, Any]
    ) -> None:
        """As DirectLight.add."""
        for first in range(0, self._rays, RAYS_AT_ONCE):
            own = {**streams, **self._streams}
            launch(self._aim, own, tables, uniforms | {"first_ray": first})
            self._add_unshadowed(totals, tables)
            for layer in range(self._layers):
                if not self._pass_layer(layer, streams["chain"], tables):
                    break
                self._add_unshadowed(totals, tables)

    def _add_unshadowed(self, totals: Totals, tables: Tables) -> None:
        """What rays that meet nothing bring."""
        own = self._streams
        rays = {name: own[f"shadow_{name}"] for name in ("origin", "direction", "hit")}
        launch(self._any_hit, rays, tables)
        backs = {name: total.back for name, total in totals.items()}
        sums = {_SUMS[name]: total.front for name, total in totals.items()}
        self._add.run(sums | backs, {name: own[name].texture for name in self._add.tables})
        for total in totals.values():
            total.swap()

    def _pass_layer(self, layer: int, chain: Stream, tables: Tables) -> bool:
        """Whether any of the rays has met what lets it through after so many others; then the
        streams have what is behind that."""
        if not (self._through and self._meets_some(tables)):
            return False
        behind = {f"next_{name.removeprefix('shadow_')}": x for name, x in self._next.items()}
        own = {**self._streams, **behind}
        ports = {name: own[name] for name in (*self._through.inputs, *self._through.outputs)}
        read = tables.of(self._through) | {"chain": chain.texture}
        values = {"layer": layer, "transparent_depth": self._layers}
        alive = self._through.count(ports, read, values).wait()
        for name, stream in self._next.items():
            self._streams[name], self._next[name] = stream, self._streams[name]
        return alive > 0

    def _meets_some(self, tables: Tables) -> bool:
        """Whether a ray has met a transparent surface: asked on the host, where rays are traced,
        for most passes meet none, and to evaluate what each met takes longer than tracing."""
        met = self._streams["shadow_hit"].download()[..., HIT_TRIANGLE]
        return bool(tables.transparent[met[met > 0.0].astype(int) - 1].any())

    def launches(self) -> dict[str, int]:
        """How often each kernel has run."""
        return {kernel.stem: kernel.launches for kernel in self._kernels()}

    def release(self) -> None:
        """Free streams and kernels."""
        for stream in (*self._streams.values(), *self._next.values()):
            stream.release()
        for kernel in self._kernels():
            kernel.release()

    def _kernels(self) -> list[Kernel]:
        kernels = [self._aim, self._any_hit, self._add]
        return [*kernels, self._through] if self._through else kernels
