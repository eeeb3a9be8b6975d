# SPDX-License-Identifier: GPL-3.0-or-later
"""From films to the picture and its error, on the device: the host reads what is wanted."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from functools import cache, partial

import numpy as np
from numpy.typing import NDArray

from ...streams import Defines, Device, Program, Stream
from ..kernels import resolve
from .blocks import in_blocks
from .error import (
    EVEN,
    INNER_AREA,
    LEAST_SQUARE,
    Error,
    ErrorParts,
    Totals,
    dark_of,
    error_by,
    error_with_image,
    unknown_error,
)
from .film import FOUR, PAIR, Film, batches_that_tell
from .picture import (
    CAUSTIC_IMAGES,
    CHANNELS,
    LEAST_COVERAGE,
    MIRROR_IMAGES,
    OPTIONAL,
    caustics_of,
    illuminance_of,
    mist_of,
)
from .resolver import Picture, Telling
from .strips import StripFilm

# Images that are means of the film's own.
MEANS = {
    "Direct": "direct",
    "Emission": "emission",
    "Background": "background",
    "Normal": "normal",
    **OPTIONAL,
}
# What caustics_of reads, of the images that a film has.
OF_CAUSTICS = ("direct", "indirect", *MIRROR_IMAGES, *CAUSTIC_IMAGES)
RESOLVED = {"Combined": "picture", "Indirect": "indirect_part", "Mirror": "mirror_part"}
SUMMED = 2048  # texels that a work group sums
EVEN_COUNTS = 2 * SUMMED  # a pixel with an even disc counts so, a lit one 1: sums are exact
DECLARATIONS = f"const int SUMMED = {SUMMED};"  # what sum_texels is compiled with


def resolver_defines(names: Collection[str]) -> Defines:
    """What the kernels are compiled with for a film of these images."""
    there = {"mirror": "MIRRORED", "emission": "EMITTERS", "blur": "BLURRED"}
    return {
        "LEAST_COVERAGE": LEAST_COVERAGE,
        "LEAST_SQUARE": LEAST_SQUARE,
        "INNER_AREA": INNER_AREA,
        "EVEN": EVEN,
        "EVEN_COUNTS": float(EVEN_COUNTS),
        **{define: 1 for name, define in there.items() if name in names},
    }


def apart_define(film: StripFilm) -> Defines:
    """What kernels are compiled with that know of emission that is not denoised."""
    return {"EMISSION_APART": 1} if film.emission_is_apart else {}


class DeviceResolver:
    """Resolves by compute programs, which write where films write during a pass."""

    def __init__(self, device: Device, film: StripFilm, names: Sequence[str]) -> None:
        """`names` of the film's images."""
        self._device, self._film = device, film
        defines = resolver_defines(names)
        self._resolve = resolve.Resolve(device, "compute", defines)
        self._parts = resolve.ErrorParts(device, "compute", defines)
        self._half: resolve.FirstHalf | None = None
        if film.has_halves:
            self._half = resolve.FirstHalf(device, "compute", {**defines, **apart_define(film)})
        self._sum = Program(device, "sum_texels", DECLARATIONS)

    def resolve(self, wanted: Collection[str]) -> tuple[Picture, Telling]:
        """As HostResolver's, to rounding."""
        return self._images(wanted), cache(partial(self._error, "Error" in wanted))

    def first_half(self) -> NDArray[np.float32]:
        """As HostResolver's, to rounding."""
        half = np.empty((*self._film.shape, 3), np.float32)
        for film, rows, count in self._strips():
            self.write_half(film, film.spare[0])
            shape = rows.stop - rows.start, self._film.shape[1], 4
            texels = self._device.shown(film.spare[0].texture, count).reshape(shape)
            half[rows] = texels[..., :3]
        return half

    def write_half(self, film: Film, half: Stream) -> None:
        """Write a strip's first half to a stream."""
        assert self._half
        inputs = {name: film.sums[name] for name in self._half.inputs}
        passes = {"half_passes": float(self._film.half_passes)}
        self._half.run({**inputs, "first_half": half}, uniforms=passes)

    def write_denoised(self, film: Film, picture: Stream) -> None:
        """Write what of a strip's Combined denoisers see to a stream."""
        self._resolved(film, picture, of_emission=float(not self._film.emission_is_apart))

    def _images(self, wanted: Collection[str]) -> Picture:
        there = next(self._strips())[0].sums
        made = {"Caustics", *RESOLVED, *(own for own, name in MEANS.items() if name in there)}
        # What is written need not be cleared before.
        images = {
            name: (np.empty if self._film.passes and name in made else np.zeros)(
                (*self._film.shape, channels), np.float32
            )
            for name, channels in CHANNELS.items()
            if name in wanted and (name not in OPTIONAL or OPTIONAL[name] in there)
        }
        if not self._film.passes:
            return images
        for film, rows, count in self._strips():
            resolved = self._resolved(film) if RESOLVED.keys() & images.keys() else {}
            streams = resolved | {
                own: film.sums[name] for own, name in MEANS.items() if name in there
            }
            if "Caustics" in images:
                images["Caustics"][rows] = self._caustics(film, rows, count)
                del streams["Caustics"]
            for name in images.keys() & streams.keys():
                shape = rows.stop - rows.start, self._film.shape[1], 4
                texels = self._device.shown(streams[name].texture, count).reshape(shape)
                in_blocks(shape, partial(self._write, name, images[name][rows], texels))
        return images

    def _write(
        self, name: str, image: NDArray[np.float32], texels: NDArray[np.float32], rows: slice
    ) -> None:
        """Make rows of an image of what was read."""
        own = {"Illuminance": illuminance_of, "Mist": mist_of}
        if name in own:
            image[rows] = own[name](texels[rows] / np.float32(self._film.passes))
        elif name in MEANS:
            image[rows] = texels[rows, :, : image.shape[2]] / np.float32(self._film.passes)
        else:
            image[rows] = texels[rows, :, : image.shape[2]]

    def _caustics(self, film: Film, rows: slice, count: int) -> NDArray[np.float64]:
        """(h, w, 3) of a strip."""
        shape = rows.stop - rows.start, self._film.shape[1], 4
        means = {
            name: self._device.shown(film.sums[name].texture, count).reshape(shape) / film.passes
            for name in OF_CAUSTICS
            if name in film.sums
        }
        found: NDArray[np.float64] = caustics_of(means)
        return found

    def _error(self, with_image: bool) -> Error:
        shape, passes = self._film.shape, self._film.passes
        pixels = shape[0] * shape[1]
        told = batches_that_tell(passes, {length: passes // length for length in (PAIR, FOUR)})
        if told is None:
            return unknown_error(shape, with_image)
        light = sum(
            self.sums(self._resolved(film)["Combined"], texels)[:, :3].sum()
            for film, _, texels in self._strips()
        )
        floor, sums, read = dark_of(float(light), pixels), np.zeros(5), []
        for film, _, texels in self._strips():
            stream = self._parts_of(film, *told, floor)
            of_groups = self.sums(stream, texels)
            counts = np.divmod(of_groups[:, 3], EVEN_COUNTS)
            sums += [*of_groups[:, :3].sum(axis=0), counts[1].sum(), counts[0].sum()]
            if with_image:
                read.append(self._device.shown(stream.texture, texels).copy())
        noise, change, even_change, lit, even = sums.tolist()
        error = error_by(Totals(pixels, noise, change, even_change, int(lit), int(even)))
        if not with_image:
            return error
        noises, changes, _, codes = np.moveaxis(np.concatenate(read).reshape(*shape, 4), -1, 0)
        parts = ErrorParts(noises, changes, codes % EVEN_COUNTS > 0, codes >= EVEN_COUNTS)
        combined = self._images(["Combined"])["Combined"]
        return error_with_image(error, parts, combined, floor, passes // PAIR)

    def _strips(self) -> Iterator[tuple[Film, slice, int]]:
        """Their films, their own rows of the picture, and how many texels those are."""
        for film, strip in zip(self._film.films, self._film.strips, strict=True):
            assert isinstance(film, Film)
            yield film, strip.rows, strip.height * strip.size[0]

    def _resolved(
        self, film: Film, picture: Stream | None = None, of_emission: float = 1.0
    ) -> dict[str, Stream]:
        """Streams of RESOLVED, of which that of Combined may be given, and be without emission."""
        inputs = {name: film.sums[name] for name in self._resolve.inputs}
        outputs = dict(zip(self._resolve.outputs, film.spare, strict=False))
        outputs |= {"picture": picture} if picture else {}
        values = {"passes": float(self._film.passes), "of_emission": of_emission}
        values = {name: values[name] for name in self._resolve.uniforms}
        self._resolve.run({**inputs, **outputs}, uniforms=values)
        return {name: outputs[port] for name, port in RESOLVED.items()}

    def _parts_of(self, film: Film, length: int, of_squares: float, floor: float) -> Stream:
        """ErrorParts, by squares of batches of a length."""
        picture, parts = self._resolved(film)["Combined"], film.spare[-1]
        own = {"picture": picture, "squares": film.squares(length)}
        sums = {name: film.sums[name] for name in self._parts.inputs if name not in own}
        uniforms = {
            "passes": float(self._film.passes),
            "of_squares": of_squares,
            "unit": 1.0 / floor,
        }
        self._parts.run({**own, **sums, "parts": parts}, uniforms=uniforms)
        return parts

    def sums(self, stream: Stream, texels: int) -> NDArray[np.float64]:
        """Of a stream's first texels, (work groups, 4)."""
        groups = -(-texels // SUMMED)
        buffer = self._device.buffer(16 * groups)
        self._sum.run(texels, [buffer], {"texels": stream.texture}, groups=groups)
        read = self._device.read(buffer, 4 * groups).reshape(groups, 4)
        self._device.put_back(buffer)
        return read.astype(float)

    def release(self) -> None:
        """As HostResolver's."""
        for kernel in (self._resolve, self._parts, self._half):
            if kernel:
                kernel.release()
