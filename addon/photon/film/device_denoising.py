# SPDX-License-Identifier: GPL-3.0-or-later
"""From a film to the denoised picture, on the device, which mixes what the denoiser makes of halves
(native/src/mixture.rs). Where the denoiser is on the same GPU it reads and writes there; else the
host carries four images to it, and two back, in each way."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from functools import cache, partial

import numpy as np
from numpy.typing import NDArray

from ...denoiser import CudaBuffers, CudaError, Denoiser, DenoiserError, PreparedFilter, Way
from ...streams import Device, Stream
from ..kernels import mixture
from ..kernels.records import SUM
from .denoise import FEATURE_PORTS, REACH, Opened, by_any, unit_of
from .device_resolver import DeviceResolver, apart_define
from .error import DARK, Error, error_of
from .film import Film
from .picture import FEATURES, images_for
from .resolver import DenoisingResolver, Picture, Telling
from .strips import StripFilm

Texels = NDArray[np.float32]
STREAMS = 13 + 6  # of the picture's size, that a look takes, and what is shared with a denoiser
_X, _Y = (1, 0), (0, 1)
_GIVEN = ("first", "other", "albedo", "normal")  # to the denoiser
_PAIRS = {"first": "clean", "other": "other_clean"}  # what it makes of halves
_SHARED = (*_GIVEN, *_PAIRS.values())
# Writes what a denoiser makes of given halves, in a way.
_Write = Callable[[Denoiser, Mapping[str, Stream], Mapping[str, Stream], Way], None]


class _Lazily(Mapping[str, Texels]):
    """Images that are read when they are asked for: each is gone when the next one is read."""

    def __init__(self, of: Mapping[str, Callable[[], Texels]]) -> None:
        self._of = of

    def __getitem__(self, name: str) -> Texels:
        return self._of[name]()

    def __iter__(self) -> Iterator[str]:
        return iter(self._of)

    def __len__(self) -> int:
        return len(self._of)


class DeviceDenoisingResolver(DenoisingResolver):
    """As DenoisingResolver, to rounding. Of a film of several strips, whose pixels' neighbours are
    in others, as that does it."""

    def __init__(
        self,
        device: Device,
        film: StripFilm,
        plain: DeviceResolver,
        opened: Opened,
        noisy_features: bool,
    ) -> None:
        super().__init__(film, plain, opened, noisy_features)
        self._device, self._of_film = device, plain
        made = (mixture.SplitHalves, mixture.MixtureTold, mixture.BoxMean)
        self._split, self._told, self._mean = (kernel(device, "compute") for kernel in made)
        self._compared = mixture.FiltersCompared(device, "compute")
        self._kept = mixture.MixtureKept(device, "compute")
        self._mix = mixture.Mixture(device, "compute", apart_define(film))
        self._left: Stream | None = None  # of the last look
        self._shared: _Shared | None = None
        self._may_share = True  # until it is known that they can't

    def resolve(self, wanted: Collection[str]) -> tuple[Picture, Telling]:
        """As DenoisingResolver's."""
        film, *others = self._film.films
        if others or not isinstance(film, Film):
            return super().resolve(wanted)
        images, _ = self._plain.resolve({*wanted} - {"Combined", "Error"})
        self._forget()
        look = _Look(self._device, film.sums["combined"].size)
        try:
            combined = self._mixed(film, look)
        finally:
            look.release()
        if "Combined" in wanted:
            images["Combined"] = combined
        tell = partial(self._tell, "Error" in wanted, combined[..., :3], self._left)
        return images, cache(tell)

    def _tell(self, with_image: bool, picture: Texels, left: Stream | None) -> Error:
        assert left and left is self._left, "there was another look"
        look = _Look(self._device, left.size)
        try:
            mean = look.stream()
            self._blur(left, mean, look)
            remains, noise = np.moveaxis(look.read(mean), -1, 0)[:2]
            share = np.divide(remains, noise, out=np.ones_like(noise), where=noise > 0.0)
        finally:
            look.release()
        plain = self._plain.resolve(["Combined"])[0]["Combined"]
        strip_statistics = self._film.strip_statistics(images_for(()))
        share = np.clip(share, 0.0, 1.0)
        return error_of(strip_statistics, plain, with_image, picture, share)

    def _mixed(self, film: Film, look: _Look) -> Texels:
        """The picture (h, w, 4); how much of its noise is left stays on the device."""
        share = self._film.half_passes / self._film.passes
        picture = half = look.stream()  # of one pass they are the same
        self._of_film.write_denoised(film, picture)
        if share < 1.0:
            half = look.stream()
            self._of_film.write_half(film, half)
        mean = self._mean_of(picture)
        unit = unit_of(mean)
        given = {name: look.stream() for name in _GIVEN}
        features = {
            f"{port}_sum": film.sums[FEATURES[name]] for port, name in FEATURE_PORTS.items()
        }
        self._split.run(
            {"picture": picture, "half": half, **features, **given},
            uniforms={"share": share, "unit": unit, "passes": float(self._film.passes)},
        )
        clean = self._clean(given, look, share == 1.0, mean / unit)
        lights = {"share": share, "unit": unit}
        told, kept, mixed = given["first"], given["albedo"], given["normal"]
        self._left = Stream(self._device, SUM, told.size)
        if share < 1.0:
            means = map(self._mean_of, clean.values())
            smooth = unit * sum(x * y for x, y in zip(means, (share, 1.0 - share), strict=True))
            self._told.run(
                {"picture": picture, "half": half, **clean, "told": told},
                uniforms=lights | {"floor_light": DARK * (smooth or 1.0)},
            )
            self._blur(told, told, look)
            self._kept.run({"told": told, "kept": kept}, uniforms={"reach": REACH})
            self._blur(kept, kept, look)
        else:  # nothing tells that the picture is better as it is
            for stream in (told, kept):
                stream.clear()
        ports = {"picture": picture, **clean, "kept": kept, "told": told}
        ports |= {"mixed": mixed, "left": self._left}
        if self._film.emission_is_apart:
            ports["emission"] = film.sums["emission"]
            lights["passes"] = float(self._film.passes)
        self._mix.run(ports, uniforms=lights)
        return look.read(mixed).copy()

    def _clean(
        self, given: Mapping[str, Stream], look: _Look, are_same: bool, mean: float
    ) -> dict[str, Stream]:
        """What the denoiser makes of both halves, as `denoised`; `are_same`: of one pass; `mean`:
        of their light. Where they are, if it is on the same GPU."""
        halves = ("first",) if are_same else tuple(_PAIRS)

        def by(denoiser: Denoiser, write: _Write) -> dict[str, Stream]:
            clean: dict[str, Stream] = {}
            for way in self.ways(denoiser)[: len(halves)]:
                made = {_PAIRS[half]: look.stream() for half in halves}
                write(denoiser, given, made, way)
                clean = self._better(given, clean, made, look, mean) if clean else made
            self.by = denoiser.name
            return {port: clean.get(port, clean["clean"]) for port in _PAIRS.values()}

        if self._may_share:
            try:
                denoiser = self._opened.denoiser()
                if denoiser.is_cuda:
                    self._shared = self._shared or _Shared(self._device, look.shape)
                    return by(denoiser, self._shared.denoise)
            except (CudaError, DenoiserError):
                self._may_share = False
                self._unshare()
        return by_any(self._opened, lambda denoiser: by(denoiser, look.denoise))

    def _better(
        self,
        given: Mapping[str, Stream],
        clean: dict[str, Stream],
        second: dict[str, Stream],
        look: _Look,
        mean: float,
    ) -> dict[str, Stream]:
        """What one filter makes of halves, or the mean with what a second one does."""
        halves = {name: given[name] for name in _PAIRS}
        seconds = {f"second_{port}": stream for port, stream in second.items()}
        both = {port: look.stream() for port in ("mean", "other_mean", "worse")}
        floor_light = DARK * (mean or 1.0)
        ports = {**halves, **clean, **seconds, **both}
        self._compared.run(ports, uniforms={"floor_light": floor_light})
        worse = both.pop("worse")
        found = float(self._of_film.sums(worse, worse.size[0] * worse.size[1])[:, 0].sum())
        for stream in (worse, *second.values()):
            look.put_back(stream)
        return dict(zip(_PAIRS.values(), both.values(), strict=True)) if found < 0.0 else clean

    def _unshare(self) -> None:
        shared, self._shared = self._shared, None
        if shared:
            shared.release()

    def _mean_of(self, stream: Stream) -> float:
        """Of three channels."""
        pixels = stream.size[0] * stream.size[1]
        return float(self._of_film.sums(stream, pixels)[:, :3].sum()) / (3.0 * pixels)

    def _blur(self, stream: Stream, mean: Stream, look: _Look) -> None:
        """Write the means over squares of pixels, perhaps in the stream's place."""
        between = look.stream()
        for along, source, target in ((_X, stream, between), (_Y, between, mean)):
            self._mean.run(
                {"mean": target}, {"image": source.texture}, {"reach": REACH, "along": along}
            )
        look.put_back(between)

    def _forget(self) -> None:
        if self._left:
            self._left.release()
            self._left = None

    def release(self) -> None:
        """As DenoisingResolver's."""
        self._forget()
        self._unshare()
        for kernel in (self._split, self._compared, self._told, self._mean, self._kept, self._mix):
            kernel.release()
        super().release()


class _Shared:
    """Buffers that OpenGL and a denoiser on the same GPU have together."""

    def __init__(self, device: Device, shape: tuple[int, int]) -> None:
        """CudaError where they can't."""
        self._device, self._shape = device, shape
        size = 16 * shape[0] * shape[1]
        self._buffers = {name: device.ctx.buffer(reserve=size) for name in _SHARED}
        self._filters: dict[Way, PreparedFilter] = {}
        self._places: dict[str, int] = {}  # that these know
        try:
            self._shared = CudaBuffers({name: x.glo for name, x in self._buffers.items()})
        except CudaError:
            self._free()
            raise

    def denoise(
        self,
        denoiser: Denoiser,
        given: Mapping[str, Stream],
        made: Mapping[str, Stream],
        way: Way,
    ) -> None:
        """Write clean halves."""
        self._device.bind.settle()
        for name, stream in given.items():
            stream.texture.read_into(self._buffers[name])
        self._device.ctx.finish()
        with self._shared.mapped() as places:
            if self._places != places:
                self._forget_filters()
                self._places = places
            if way not in self._filters:
                self._filters[way] = denoiser.filter_there(self._shape, places, _PAIRS, way)
            self._filters[way].clean_features()
            for half, port in _PAIRS.items():
                if port in made:
                    self._filters[way].run(half)
        for port, stream in made.items():
            self._device.write(stream.texture, self._buffers[port])

    def release(self) -> None:
        """Free them."""
        self._forget_filters()
        self._shared.release()
        self._free()

    def _forget_filters(self) -> None:
        for prepared in self._filters.values():
            prepared.release()
        self._filters.clear()

    def _free(self) -> None:
        for buffer in self._buffers.values():
            buffer.release()


class _Look:
    """Streams of a look, of the picture's size."""

    def __init__(self, device: Device, size: tuple[int, int]) -> None:
        self._device, self._size = device, size
        self.shape = size[1], size[0]
        self._taken: list[Stream] = []

    def stream(self) -> Stream:
        """Another one, whatever is in it."""
        self._taken.append(Stream(self._device, SUM, self._size))
        return self._taken[-1]

    def put_back(self, stream: Stream) -> None:
        """Before the look ends."""
        self._taken.remove(stream)
        stream.release()

    def read(self, stream: Stream) -> Texels:
        """Texels (h, w, 4), which may be gone at the next call."""
        count = self._size[0] * self._size[1]
        return self._device.shown(stream.texture, count).reshape(*self.shape, 4)

    def denoise(
        self,
        denoiser: Denoiser,
        given: Mapping[str, Stream],
        made: Mapping[str, Stream],
        way: Way,
    ) -> None:
        """As _Shared.denoise, by way of the host."""
        read = {name: partial(self.read, stream) for name, stream in given.items()}
        features = _Lazily({name: read[name] for name in FEATURE_PORTS})
        halves = [half for half, port in _PAIRS.items() if port in made]
        with denoiser.filtering((*self.shape, 4), features, way) as filtered:
            found = [filtered(read[half]()) for half in halves]
        for stream, texels in zip(made.values(), found, strict=True):
            stream.upload(texels)

    def release(self) -> None:
        """Put all back."""
        for stream in self._taken:
            stream.release()
