# SPDX-License-Identifier: GPL-3.0-or-later
"""The images of a pass, put together as paths from the eye find light."""

from __future__ import annotations

from dataclasses import dataclass

from ...streams import Kernel, PingPong, Stream
from ..backends.backend import Backend
from ..film.picture import (
    CAUSTIC_IMAGES,
    EMISSION_IMAGES,
    FEATURE_IMAGES,
    FILM_IMAGES,
    ILLUMINANCE_IMAGES,
    MIRROR_IMAGES,
    MIST_IMAGES,
)
from ..kernels.add_chain import AddChain
from ..kernels.combine import CombineAll, CombineCaustics, CombineMirror, CombinePrimary
from ..kernels.features import Features
from ..kernels.launch import launch
from ..kernels.records import BLUR, ILLUMINANCE_SEEN, LOST, RADIANCE
from ..settings import Settings
from ..stage.needs import SceneNeeds
from ..stage.tables import Tables
from .eye import Eye
from .moved_sums import MovedSums
from .path import Path

NO_LIMIT = 1e38  # to the light of a sample
# What chains add to, by the name of the sum: an image, and what a ray adds to it.
_SUMS = {
    "sum": ("mirror", "seen"),
    "indirect_sum": ("mirror_indirect", "indirect_seen"),
    "blur_sum": ("blur", "blur_seen"),
    "background_sum": ("background", "lost"),
    "mist_sum": ("mist", "mist_seen"),
    "albedo_sum": ("albedo", "albedo_seen"),
    "normal_sum": ("normal_shown", "normal_seen"),
    "caustics_sum": ("mirror_caustics", "caustics_seen"),
}


def film_images(needs: SceneNeeds) -> list[str]:
    """Those of a pass that the film adds up, in its order."""
    names = [*FILM_IMAGES, *(MIRROR_IMAGES if needs.secondary_rays else ())]
    names += EMISSION_IMAGES if needs.emitters_seen else ()
    names += ILLUMINANCE_IMAGES if needs.illuminance else ()
    names += MIST_IMAGES if needs.mist else ()
    names += CAUSTIC_IMAGES[: 1 + needs.secondary_rays] if needs.caustics else ()
    names += FEATURE_IMAGES if needs.features else ()
    names += ["blur"] if needs.photons else []
    return names


@dataclass(frozen=True)
class _Images:
    """Streams of images, and those that chains add to, by name."""

    seen: dict[str, Stream]
    sums: dict[str, PingPong]

    @property
    def pairs(self) -> dict[str, PingPong]:
        """Of chains, by the names of the sums."""
        return {name: self.sums[image] for name, (image, _) in _SUMS.items() if image in self.sums}

    def first_rows(self, rows: int) -> _Images:
        """Those of the first rows."""
        return _Images(
            {name: stream.first_rows(rows) for name, stream in self.seen.items()},
            {name: pair.first_rows(rows) for name, pair in self.sums.items()},
        )


class PassImages:
    """Streams of what paths of a region's size see."""

    def __init__(
        self,
        backend: Backend,
        tables: Tables,
        settings: Settings,
        needs: SceneNeeds,
        eye: Eye,
    ) -> None:
        device, layer, size = backend.device, backend.layer, eye.streams.size
        self._tables, self._eye, self._device = tables, eye, device
        defines = needs.combine_defines
        of_primary = {**defines, **needs.illuminance_defines, **needs.camera_defines}
        self._primary = CombinePrimary(device, layer, of_primary)
        self._all = CombineAll(device, layer, defines)
        self._caustics = CombineCaustics(device, layer, defines) if needs.caustics else None
        self._mirror: CombineMirror | None = None
        self._add: AddChain | None = None
        self._moved = MovedSums()
        self._features: Features | None = None
        if needs.features:
            self._features = Features(device, layer, needs.feature_defines, made=needs.made)
        other = {"illuminance": ILLUMINANCE_SEEN, "blur": BLUR}
        seen = {
            name: Stream(device, other.get(name, RADIANCE), size)
            for name in film_images(needs)
            if name not in (*MIRROR_IMAGES, "mirror_caustics")
        }
        sums: dict[str, PingPong] = {}
        self._of_rays: dict[tuple[int, int], dict[str, Stream]] = {}  # what they see, by size
        if needs.secondary_rays:
            self._mirror = CombineMirror(device, layer, defines)
            self._add = AddChain(device, layer, defines)
            records = dict.fromkeys(MIRROR_IMAGES, RADIANCE)
            records |= {"blur": BLUR} if needs.photons else {}
            records |= {"mirror_caustics": RADIANCE} if needs.caustics else {}
            # The eye sees the background through transparent surfaces, after the first ones.
            through = ("background", *(MIST_IMAGES if needs.mist else ()))
            records |= dict.fromkeys(through, RADIANCE) if needs.transparent else {}
            records |= dict.fromkeys(FEATURE_IMAGES, RADIANCE) if needs.features else {}
            sums = {name: PingPong(device, record, size) for name, record in records.items()}
        self._all_rows = self._now = _Images(seen, sums)
        self._by_size = {size: self._all_rows}
        self._zeros = eye.streams.ones["zeros"]
        if sums:
            self._seen_by_rays(size)
        self._world = {
            "background_alpha": 0.0 if settings.transparent else 1.0,
            "clamps": tuple(
                x or NO_LIMIT for x in (settings.clamp_direct, settings.clamp_indirect)
            ),
            **eye.camera.view_axis(),
            **eye.camera.mist(),
        }

    def begin(self, path: Path) -> PassImages:
        """Forget the last region's."""
        self._moved.begin()
        size, whole = path.at.size, self._all_rows
        if size not in self._by_size:
            self._by_size[size] = whole.first_rows(size[1])
            if whole.sums:
                rays = self._seen_by_rays(self._eye.streams.size)
                self._of_rays[size] = {n: x.first_rows(size[1]) for n, x in rays.items()}
        self._now = self._by_size[size]
        self._zeros = path.at.ones["zeros"]
        for name, pair in self._now.sums.items():
            pair.restart(self._now.seen.get(name, self._zeros))
        return self

    def add(self, path: Path) -> None:
        """Add what a path's rays see, once their light is found."""
        assert path.direct and path.coverage
        streams = {**self._eye.of(path), **path.direct, "throughput": path.throughput}
        streams |= {"arriving": path.arriving, "end": path.at.ones["hit"]}
        if path.emitted:
            streams |= dict(zip(("emitted", "environment"), path.emitted, strict=True))
        streams["coverage"] = path.coverage
        if path.depth == 0:
            seen = {f"{name}_seen": stream for name, stream in self._now.seen.items()}
            launch(self._primary, streams | seen, self._tables, self._world)
            if self._features:
                names = zip(("albedo_seen", "normal_seen"), FEATURE_IMAGES, strict=True)
                shown = {port: self._now.seen[name] for port, name in names}
                launch(self._features, streams | shown, self._tables)
            if self._caustics:
                launch(self._caustics, streams | seen, self._tables)
        else:
            self._add_chain(path, streams)

    def finish(self) -> dict[str, Stream]:
        """By name, and combined of all."""
        self._moved.finish(self._now.pairs)
        images = dict.fromkeys((*MIRROR_IMAGES, "blur"), self._zeros) | self._now.seen
        images |= {name: pair.front for name, pair in self._now.sums.items()}
        seen = {f"{name}_seen": image for name, image in images.items()}
        launch(self._all, seen | {"combined": images["combined"]}, self._tables)
        return images

    def _add_chain(self, path: Path, streams: dict[str, Stream]) -> None:
        assert self._mirror and self._add
        seen = self._seen_by_rays(path.at.size)
        launch(self._mirror, streams | seen, self._tables, self._world | {"depth": path.depth})
        if self._features:
            launch(self._features, streams | seen, self._tables)
        if self._caustics:
            launch(self._caustics, streams | seen, self._tables)
        if path.pixels is not None:
            own = {name: seen[_SUMS[name][1]] for name in self._now.pairs}
            self._moved.add(path.pixels, self._now.pairs, own)
            return
        ports = dict(seen)
        for name, pair in self._now.pairs.items():
            ports |= {name: pair.front, name.replace("sum", "total"): pair.back}
        self._add.run(ports)
        for pair in self._now.pairs.values():
            pair.swap()

    def _seen_by_rays(self, size: tuple[int, int]) -> dict[str, Stream]:
        """Streams of what rays of a size see."""
        if size not in self._of_rays:
            records = {"blur_seen": BLUR, "lost": LOST}
            self._of_rays[size] = {
                name: Stream(self._device, records.get(name, RADIANCE), size)
                for image, name in _SUMS.values()
                if image in self._all_rows.sums
            }
        return self._of_rays[size]

    def launches(self) -> dict[str, int]:
        """How often each kernel has run."""
        counts: dict[str, int] = {}
        for kernel in self._kernels():
            counts[kernel.stem] = counts.get(kernel.stem, 0) + kernel.launches
        return counts

    def release(self) -> None:
        """Free streams and kernels."""
        for kernel in self._kernels():
            kernel.release()
        for streams in (self._all_rows.seen, *self._of_rays.values()):
            for stream in streams.values():
                stream.release()
        for pair in self._all_rows.sums.values():
            pair.release()

    def _kernels(self) -> list[Kernel]:
        own = self._primary, self._all, self._mirror, self._add, self._caustics, self._features
        return [kernel for kernel in own if kernel]
