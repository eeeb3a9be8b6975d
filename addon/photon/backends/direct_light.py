# SPDX-License-Identifier: GPL-3.0-or-later
"""Direct light at visible points, by shadow rays."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...streams import Device, Kernel, PingPong, Stream
from ...streams.device import Layer
from ..kernels.direct import Direct, ShadowLeft, ShadowRays, ShadowThrough
from ..kernels.launch import Streams, launch
from ..kernels.lights import IS_ASKED
from ..kernels.records import (
    CHAIN,
    HIT,
    ILLUMINANCE,
    MEDIUM,
    RADIANCE,
    RAY_DIRECTION,
    RAY_ORIGIN,
)
from ..stage.environments import LUMINANCE
from ..stage.kinds import light_kinds
from ..stage.needs import SceneNeeds
from ..stage.programs import ProgramNeeds
from ..stage.tables import Tables
from .native_kernels import NativeTracer

Totals = Mapping[str, PingPong]
Size = tuple[int, int]
Array = NDArray[np.float32]
Arrays = dict[str, Array]
Passable = NDArray[np.bool_]
_BROUGHT = {"direct": "unshadowed", "illuminance": "unshadowed_lux"}  # by what rays find nothing
_LOOKED = {"direct": "looked", "illuminance": "looked_lux"}  # what a second look reads
HIT_TRIANGLE = list(HIT.fields).index("triangle")
_RAY = ("shadow_origin", "shadow_direction")
_WAY = (*_RAY, "shadow_medium")
_WIDTH = 256  # of streams of rays that go on
_DRAWN = 0  # in place of a kind of lights: of all that are not asked
MOST_FACES = 1024  # of glass, on a shadow ray's way: as in direct.glsl
STRAIGHT = 0.999992  # as in lib/pane.glsl
_BEHIND = "unshadowed_behind"


class DirectLight:
    """By a kernel that traces the rays itself: one launch, whatever the number of lights, or two
    where nodes tell what rays pass."""

    def __init__(self, device: Device, layer: Layer, needs: SceneNeeds) -> None:
        defines, made = needs.direct_defines, needs.shadow_made
        self._looks: list[Direct] = []
        if needs.shadow_programs.nodes:
            first = replace(needs, shadow_programs=ProgramNeeds())
            looks = {**first.direct_defines, "FIRST_LOOK": 1}
            self._looks.append(Direct(device, layer, looks, made=first.shadow_made))
            defines = {**defines, "SECOND_LOOK": 1}
        self._looks.append(Direct(device, layer, defines, made=made))

    def add(
        self, totals: Totals, streams: Streams, tables: Tables, uniforms: dict[str, Any]
    ) -> None:
        """Write the light at the points of `streams` to `totals`, "direct" and, where it is asked
        for, "illuminance"."""
        for kernel in self._looks:
            looked = {_LOOKED[name]: total.front for name, total in totals.items()}
            backs = {name: total.back for name, total in totals.items()}
            launch(kernel, {**streams, **looked, **backs}, tables, uniforms)
            for total in totals.values():
                total.swap()

    def launches(self) -> dict[str, int]:
        """How often each kernel has run."""
        return {Direct.stem: sum(kernel.launches for kernel in self._looks)}

    def release(self) -> None:
        """Free the kernels."""
        for kernel in self._looks:
            kernel.release()


class _Rays:
    """Streams of a shadow ray of each point, of one size."""

    def __init__(self, device: Device, size: Size, needs: SceneNeeds, go_on: bool) -> None:
        """`go_on`: there are those of rays behind what they have met, too."""
        records = {"shadow_origin": RAY_ORIGIN, "shadow_direction": RAY_DIRECTION}
        records |= {"unshadowed": RADIANCE} | ({_BEHIND: RADIANCE} if needs.panes else {})
        records |= {"unshadowed_lux": ILLUMINANCE} if needs.illuminance else {}
        records |= {"shadow_medium": MEDIUM} if needs.media else {}
        if go_on:
            behind = {f"next_{name.removeprefix('shadow_')}": x for name, x in records.items()}
            records |= {"shadow_hit": HIT, "chain": CHAIN, **behind}
        self.streams = {name: Stream(device, record, size) for name, record in records.items()}

    def release(self) -> None:
        """Put the streams back."""
        for stream in self.streams.values():
            stream.release()


class TracedDirectLight:
    """By rays that the host traces, one of each point after the other. A program aims those that go
    to lights of one kind, or of all kinds that are drawn, and knows no other: software OpenGL runs
    through all that it knows."""

    def __init__(
        self, device: Device, layer: Layer, needs: SceneNeeds, tracer: NativeTracer, size: Size
    ) -> None:
        """`tracer`: finds any hit, or where rays may go on the first one; `size`: of the streams of
        most points."""
        self._device = device
        self._transparent_depth = needs.transparent_depth
        self._most_met = needs.transparent_depth + MOST_FACES * needs.panes
        self._layer, self._needs = layer, needs
        self._aims: dict[int, ShadowRays] = {}  # by kind, or _DRAWN
        self._worlds = {kind.number for kind in light_kinds().values() if kind.is_world}
        self._tracer = tracer
        self._through: ShadowThrough | None = None
        self._left = ShadowLeft(device, layer, needs.media_defines) if needs.media else None
        if needs.shadow_rays_go_on:
            defines = {**needs.illuminance_defines, **needs.shadow_filter_defines}
            self._through = ShadowThrough(device, layer, defines, made=needs.shadow_made)
        self._streams: dict[tuple[Size, bool], _Rays] = {}
        self._of_size(size, False)

    def add(
        self, totals: Totals, streams: Streams, tables: Tables, uniforms: dict[str, Any]
    ) -> None:
        """As DirectLight.add."""
        size = streams["place"].size
        own = self._of_size(size, False).streams
        sums = {name: np.zeros((size[0] * size[1], 4), np.float32) for name in totals}
        for kind, number, by_lobe in self._asked(tables):
            ray = {"number": number, "by_lobe": by_lobe}
            launch(self._aim(kind, tables), {**streams, **own}, tables, uniforms | ray)
            brought = {name: own[_BROUGHT[name]].elements() for name in totals}
            hits = self._trace(own, "shadow")
            if self._left:
                free = hits[:, HIT_TRIANGLE] == 0.0
                ways = {name: own[name].elements()[free] for name in _WAY}
                left = self._left_of(ways, tables, kind)
                brought = {name: _less(name, x, free, left) for name, x in brought.items()}
            if self._through:
                self._pass_through(own, hits, brought, streams.get("chain"), tables, kind)
            free = hits[:, HIT_TRIANGLE, None] == 0.0
            for name, of_one in sums.items():
                np.add(of_one, brought[name], out=of_one, where=free)
        for name, total in totals.items():
            sums[name][:, 3] = 1.0
            total.back.upload(sums[name].reshape(size[1], size[0], 4))
            total.swap()

    def _asked(self, tables: Tables) -> list[tuple[int, int, int]]:
        """The rays of a point: by which program each is aimed; its number, of a ray to a light that
        is asked the light's, and below 0 of one more to the world; and 1: it goes by a lobe."""
        lights, asked = tables.lights, tables.asked.lights
        asked = asked[lights["found_by"][asked].astype(int) & IS_ASKED > 0]
        rays = [(int(lights["kind"][number]), int(number), 0) for number in asked]
        world = int(lights["kind"][tables.world_light])
        rays += [(world, -more, 0) for more in range(1, tables.world_rays)]
        if self._needs.by_lobes:
            rays += [(kind, number, 1) for kind, number, _ in rays if kind in self._worlds]
        first = len(tables.asked.lights)
        return [*rays, *((_DRAWN, first + i, 0) for i in range(self._needs.drawn_rays))]

    def _aim(self, kind: int, tables: Tables) -> ShadowRays:
        """The program that aims rays to lights of a kind, or to those that are drawn: of these the
        kinds stay what they are when it is first asked for."""
        if kind not in self._aims:
            kinds, drawn_rays = {kind}, 0
            if kind == _DRAWN:
                kinds = set(np.delete(tables.lights["kind"], tables.asked.lights).astype(int))
                drawn_rays = self._needs.drawn_rays
            names = (name for name, of in light_kinds().items() if of.number in kinds)
            needs = self._needs.asking(names, drawn_rays)
            made = ShadowRays(self._device, self._layer, needs.direct_defines, made=needs.made)
            self._aims[kind] = made
        return self._aims[kind]

    def _of_size(self, size: Size, go_on: bool) -> _Rays:
        key = size, go_on
        if key not in self._streams:
            self._streams[key] = _Rays(self._device, size, self._needs, go_on)
        return self._streams[key]

    def _trace(self, own: Streams, which: str) -> Array:
        return self._tracer.hits({name: own[f"{which}_{name}"] for name in self._tracer.inputs})

    def _pass_through(
        self,
        rays: Streams,
        hits: Array,
        brought: Arrays,
        chain: Stream | None,
        tables: Tables,
        kind: int,
    ) -> None:
        """Let rays that have met transparent surfaces or glass go on behind them: those that meet
        nothing there bring what is left of their light. On the host, where rays are traced, for
        most have met none, and to evaluate what each met takes longer than tracing. `kind`: of the
        lights that they go to."""
        passable = self._passable(tables, kind)
        which = _met(hits, passable)
        if not len(which):
            return
        found = {name: rays[name].elements()[which] for name in _RAY}
        found |= {_BROUGHT[name]: x[which] for name, x in brought.items()}
        found |= {_BEHIND: rays[_BEHIND].elements()[which]} if self._needs.panes else {}
        if self._needs.media:
            found["shadow_medium"] = rays["shadow_medium"].elements()[which]
        found |= {"shadow_hit": hits[which]} | ({"chain": chain.elements()[which]} if chain else {})
        aimed = found["shadow_direction"][:, :3].copy()
        for passed in range(self._most_met):
            behind = self._behind(found, passed, tables)
            there = behind["direction"].any(axis=1)
            # Through glass with faces that are not parallel photons come.
            there &= (behind["direction"][:, :3] * aimed).sum(axis=1) > STRAIGHT
            free = there & (behind["hit"][:, HIT_TRIANGLE] == 0.0)
            hits[which[free]] = 0.0
            if self._left:
                ways = {name: behind[name.removeprefix("shadow_")][free] for name in _WAY}
                left = self._left_of(ways, tables, kind)
                for name, port in _BROUGHT.items():
                    if port in behind:
                        behind[port] = _less(name, behind[port], free, left)
            for name, x in brought.items():
                x[which[free]] = behind[_BROUGHT[name]][free]
            on = _met(behind["hit"], passable)
            which, aimed = which[on], aimed[on]
            if not len(which):
                break
            chains = {"chain": found["chain"][on]} if chain else {}
            found = {_before(name): x[on] for name, x in behind.items()} | chains

    def _behind(self, found: Arrays, passed: int, tables: Tables) -> Arrays:
        """What becomes of rays that have met transparent surfaces after so many others."""
        assert self._through
        own = self._taken(found)
        values = {"passed": passed, "transparent_depth": self._transparent_depth}
        launch(self._through, own, tables, values)
        behind = {name.removeprefix("next_"): x for name, x in own.items() if "next_" in name}
        arrays = {name: x.elements() for name, x in behind.items()} | {
            "hit": self._trace(own, "next")
        }
        return {name: x[: len(found["shadow_hit"])] for name, x in arrays.items()}

    def _taken(self, found: Arrays) -> Streams:
        """Streams that hold some rays, one at least, from the front."""
        rows = -(-len(found["shadow_origin"]) // _WIDTH)
        own = self._of_size((_WIDTH, 1 << (rows - 1).bit_length()), True).streams
        for name, x in found.items():
            own[name].take(x)
        return own

    def _left_of(self, ways: Arrays, tables: Tables, kind: int) -> Array:
        """What media leave of what comes that way from lights of a kind, (n, 3)."""
        assert self._left
        count = len(ways["shadow_medium"])
        if not count:
            return np.ones((0, 3), np.float32)
        if kind in self._worlds:  # as in direct.glsl
            ways["shadow_medium"][:, :2] = tables.media.air, 0.0
        own = self._taken(ways)
        launch(self._left, {**own, "left": own["next_unshadowed"]}, tables, {})
        return own["next_unshadowed"].elements()[:count, :3]

    def _passable(self, tables: Tables, kind: int) -> Passable:
        """Of each triangle, whether shadow rays to such lights may go on behind it."""
        passable = tables.transparent
        if self._needs.shaded_lamps and kind not in self._worlds:
            passable = passable & ~tables.shades_lamps
        return passable | tables.clear if self._needs.panes else passable

    def launches(self) -> dict[str, int]:
        """How often each kernel has run."""
        counts: Counter[str] = Counter()
        for kernel in self._kernels():
            counts[kernel.stem] += kernel.launches
        return counts

    def release(self) -> None:
        """Free streams and kernels."""
        for rays in self._streams.values():
            rays.release()
        for kernel in self._kernels():
            kernel.release()

    def _kernels(self) -> list[Kernel]:
        kernels: list[Kernel] = [*self._aims.values(), self._tracer]
        return [*kernels, *(kernel for kernel in (self._through, self._left) if kernel)]


def _met(hits: Array, passable: Passable) -> NDArray[np.int64]:
    """Which rays have met what they may go on behind."""
    triangles = hits[:, HIT_TRIANGLE].astype(np.int64)
    met = np.flatnonzero(triangles)
    of_those: NDArray[np.int64] = met[passable[triangles[met] - 1]]
    return of_those


def _less(name: str, brought: Array, free: NDArray[np.bool_], left: Array) -> Array:
    """What rays bring to a total, (n, 4), of those that are free (n,) as much as is left."""
    result = brought.copy()
    result[free, :3] *= left if name == "direct" else (left @ LUMINANCE)[:, None]
    return result


def _before(name: str) -> str:
    """What a ray's stream is called where it starts."""
    return name if name.startswith("unshadowed") else f"shadow_{name}"
