# SPDX-License-Identifier: GPL-3.0-or-later
"""The images of a pass, put together as paths from the eye find light."""

from __future__ import annotations

from ...streams import PingPong, Stream
from ..film.picture import EMISSION_IMAGES, FILM_IMAGES, MIRROR_IMAGES
from ..kernels.blur import Blur
from ..kernels.combine import CombineAll, CombineMirror, CombinePrimary
from ..kernels.launch import launch
from ..kernels.records import BLUR, ILLUMINANCE_SEEN, RADIANCE
from ..scene import Scene
from ..settings import Settings
from ..stage.needs import SceneNeeds
from ..stage.tables import Tables
from ..ways.way import Way
from .paths import Eye, Path


class PassImages:
    """Streams of what paths of a region's size see."""

    def __init__(
        self,
        way: Way,
        tables: Tables,
        scene: Scene,
        settings: Settings,
        needs: SceneNeeds,
        eye: Eye,
    ) -> None:
        device, layer, size = way.device, way.layer, eye.streams["hit"].size
        self._tables, self._eye = tables, eye
        defines = {**needs.emitter_defines, **needs.gather_defines, **needs.transparent_defines}
        of_primary = {**defines, **needs.illuminance_defines, **needs.camera_defines}
        self._primary = CombinePrimary(device, layer, of_primary)
        self._all = CombineAll(device, layer, defines)
        self._mirror = CombineMirror(device, layer, defines) if needs.secondary_rays else None
        self._blur = Blur(device, layer, defines) if needs.photons else None
        names = (*FILM_IMAGES, *(EMISSION_IMAGES if needs.emitters_seen else ()))
        self._seen = {name: Stream(device, RADIANCE, size) for name in names}
        if needs.illuminance:
            self._seen["illuminance"] = Stream(device, ILLUMINANCE_SEEN, size)
        # The eye sees the background through transparent surfaces, after the first ones.
        self._background = Stream(device, RADIANCE, size) if needs.transparent else None
        self._blurs = PingPong(device, BLUR, size)
        self._mirrors: dict[str, PingPong] = {}
        if needs.secondary_rays:
            pairs = {name: PingPong(device, RADIANCE, size) for name in MIRROR_IMAGES}
            self._mirrors = pairs
        self._world = {
            "background_alpha": 0.0 if settings.transparent else 1.0,
            **eye.camera.view_axis(),
        }

    def begin(self) -> PassImages:
        """Forget the last region's."""
        for pair in (self._blurs, *self._mirrors.values()):
            pair.restart(self._eye.streams["zeros"])
        return self

    def add(
        self,
        path: Path,
        emitted: tuple[Stream, Stream] | None,
        direct: dict[str, Stream],
        indirect: tuple[Stream, Stream],
    ) -> None:
        """Add what a path's rays see: lights and the world, if there are any to see; direct light,
        and illuminance where it is asked for; irradiance and its coverage."""
        streams = {**self._eye.of(path), **direct, "throughput": path.throughput}
        if emitted:
            streams |= dict(zip(("emitted", "environment"), emitted, strict=True))
        streams |= dict(zip(("irradiance", "coverage"), indirect, strict=True))
        if path.depth == 0:
            seen = {f"{name}_seen": stream for name, stream in self._seen.items()}
            launch(self._primary, streams | seen, self._tables, self._world)
        else:
            self._add_to_mirrors(streams)
        if self._blur:
            ends = {"sum": self._blurs.front, "total": self._blurs.back}
            launch(self._blur, streams | ends, self._tables)
            self._blurs.swap()

    def finish(self) -> dict[str, Stream]:
        """By name, and combined of all."""
        zeros = self._eye.streams["zeros"]
        images = self._seen | {"blur": self._blurs.front}
        images |= dict.fromkeys(MIRROR_IMAGES, zeros)
        images |= {name: pair.front for name, pair in self._mirrors.items()}
        seen = {f"{name}_seen": image for name, image in images.items()}
        launch(self._all, seen | {"combined": images["combined"]}, self._tables)
        return images

    def _add_to_mirrors(self, streams: dict[str, Stream]) -> None:
        assert self._mirror
        image, indirect = self._mirrors.values()
        sums = {"sum": image.front, "indirect_sum": indirect.front}
        totals = {"total": image.back, "indirect_total": indirect.back}
        if self._background:
            sums["background_sum"], totals["background_total"] = (
                self._seen["background"],
                self._background,
            )
        launch(self._mirror, streams | sums | totals, self._tables, self._world)
        if self._background:
            self._seen["background"], self._background = (
                self._background,
                self._seen["background"],
            )
        image.swap()
        indirect.swap()

    def launches(self) -> dict[str, int]:
        """How often each kernel has run."""
        kernels = self._primary, self._all, self._mirror, self._blur
        return {kernel.stem: kernel.launches for kernel in kernels if kernel}

    def release(self) -> None:
        """Free streams and kernels."""
        for kernel in (self._primary, self._all, self._mirror, self._blur):
            if kernel:
                kernel.release()
        for stream in (*self._seen.values(), *([self._background] if self._background else [])):
            stream.release()
        for pair in (self._blurs, *self._mirrors.values()):
            pair.release()
