# SPDX-License-Identifier: GPL-3.0-or-later
"""The film: the only state that passes share."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...streams import Device, Kernel, Stream, Table, Uniform
from ...streams.device import Layer
from ..kernels.records import SUM
from ..settings import FEWEST_PASSES
from .blocks import in_blocks

Images = dict[str, NDArray[np.float64]]

PAIR, FOUR = 2, 4  # passes in a batch, see film_batches.glsl
# Batches of four tell the variance better (tests/regression/test_error.py), once there are enough.
PASSES_FOR_FOURS = 16
SPARE = 4  # streams that a film writes to, in place of those that it has read


class Accumulate(Kernel):
    """Add passes to an image's compensated sum."""

    stem = "film"
    inputs = {"sum": SUM, "low": SUM}
    outputs = {"next_sum": SUM, "next_low": SUM}
    uniforms = {
        "passes": Uniform("int"),  # in the image, one's rows above those of the one before
        "added": Uniform("int"),  # a bit for each that counts
    }
    tables = {"image": Table()}


class AccumulateTwo(Kernel):
    """The same for two images: a launch costs a GPU as much as adding one does."""

    stem = "film_two"
    inputs = {
        **Accumulate.inputs,
        "second_sum": SUM,
        "second_low": SUM,
    }
    outputs = {**Accumulate.outputs, "next_second_sum": SUM, "next_second_low": SUM}
    uniforms = {**Accumulate.uniforms, "second_added": Uniform("int")}
    tables = {"image": Table(), "second_image": Table()}


class AccumulateBatches(Kernel):
    """Add passes to an image's sums of squared differences between batches of passes."""

    stem = "film_batches"
    inputs = {
        "sum": SUM,
        "low": SUM,
        "pair": SUM,
        "four": SUM,
        "pair_squares": SUM,
        "four_squares": SUM,
    }
    outputs = {
        "next_pair": SUM,
        "next_four": SUM,
        "next_pair_squares": SUM,
        "next_four_squares": SUM,
    }
    uniforms = {"passes": Uniform("int"), "passes_before": Uniform("int")}
    tables = {"image": Table()}


def in_first_half(number: int) -> bool:
    """Whether a film's pass `number`, from 0, counts to the first of two halves, which tell what
    denoising does: by the sequence of Thue and Morse, of pairs of passes. Numbers are even over the
    passes of each half alone (pass_of_half of glsl/lib/rng.glsl)."""
    return (number if number < FOUR else number // PAIR).bit_count() % 2 == 0


def half_of(name: str) -> str:
    """The sum of an image's first half among a film's sums."""
    return f"half_{name}"


@dataclass(frozen=True)
class Squares:
    """Squared differences of the means of batches of passes from the mean of all batches."""

    batches: int
    total: NDArray[np.float32]  # (h, w, 4), of "combined"


def batches_that_tell(passes: int, batches: Mapping[int, int]) -> tuple[int, float] | None:
    """The length of the batches, of as many as there are of each length, that tell the variance of
    the mean of so many passes, and that over their squares; None before FEWEST_PASSES."""
    fours = batches[FOUR] if passes >= PASSES_FOR_FOURS else 0
    length = FOUR if fours >= 2 else PAIR  # merged films of few passes each may have no fours
    n = batches[length]
    if passes < FEWEST_PASSES or n < 2:
        return None
    # Of the mean of n batches; the passes after the last whole one add to the mean, too.
    return length, length / ((n - 1) * passes)


@dataclass(frozen=True)
class Statistics:
    """What a film holds: the images' means over passes, and what tells their variance."""

    passes: int
    means: Images  # (h, w, 4) each, row 0 at the bottom
    squares: Mapping[int, Squares]  # by the number of passes in a batch
    # Means of the passes of the first half, and how many these are, of the images that are halved.
    halves: Images = field(default_factory=dict)
    half_passes: int = 0

    def variance_of_mean(self) -> NDArray[np.float32] | None:
        """Variance of the combined image's mean, (h, w, 4); None before FEWEST_PASSES.

        Batch means of randomised quasi-Monte Carlo (Owen 2013, sec. 17.3): its bias is what batches
        of twice the length would still cancel.
        """
        batches = {length: squares.batches for length, squares in self.squares.items()}
        told = batches_that_tell(self.passes, batches)
        return self.squares[told[0]].total * np.float32(told[1]) if told else None


class Film:
    """Running means of the images of a region, and the variance of the combined one.

    Films of separate pass ranges merge: see `merged`.
    """

    def __init__(
        self,
        device: Device,
        layer: Layer,
        size: tuple[int, int],
        names: Sequence[str],
        spare: list[Stream] | None = None,
        halved: Sequence[str] = (),
    ) -> None:
        """`spare`: streams of SUM, SPARE of them, that films of one size share; `halved`: images
        of which there is a sum of half of the passes besides."""
        self.passes = self.half_passes = 0
        self._names, self._halved = names, halved
        self._kernels: dict[int, Kernel] = {2: AccumulateTwo(device, layer)}  # by their images
        if len(names) % 2 or (len(names) + len(halved)) % 2:
            self._kernels[1] = Accumulate(device, layer)
        self._batch_kernel = AccumulateBatches(device, layer)
        sums = [*names, *map(half_of, halved)]
        self.sums = {name: Stream(device, SUM, size) for name in sums}
        self._lows = {name: Stream(device, SUM, size) for name in sums}
        ports = ("pair", "four", "pair_squares", "four_squares")
        self._batches = {port: Stream(device, SUM, size) for port in ports}
        self._own = [] if spare else [Stream(device, SUM, size) for _ in range(SPARE)]
        self.spare = spare or self._own  # that anybody may write to between passes

    def prepare(self) -> None:
        """Begin with sums of nothing."""
        for stream in (*self.sums.values(), *self._lows.values(), *self._batches.values()):
            stream.clear()

    def add(self, images: dict[str, Stream], passes: int = 1) -> None:
        """Add the images of a pass, or of passes together, one's rows above those of the one before
        (streams by name; "combined" has its variance kept)."""
        spare = self.spare
        backs = {f"next_{port}": spare[k] for k, port in enumerate(self._batches)}
        self._batch_kernel.run(
            {"sum": self.sums["combined"], "low": self._lows["combined"]} | self._batches | backs,
            {"image": images["combined"].texture},
            {"passes": passes, "passes_before": self.passes},
        )
        for k, port in enumerate(self._batches):
            self._batches[port], spare[k] = spare[k], self._batches[port]
        of_half = [in_first_half(self.passes + number) for number in range(passes)]
        added = [(name, name, (1 << passes) - 1) for name in self._names]
        if any(of_half):
            bits = sum(counts << number for number, counts in enumerate(of_half))
            added += [(half_of(name), name, bits) for name in self._halved]
        for first in range(0, len(added), 2):
            self._accumulate(images, passes, added[first : first + 2])
        self.passes += passes
        self.half_passes += sum(of_half)

    def _accumulate(
        self, images: dict[str, Stream], passes: int, added: Sequence[tuple[str, str, int]]
    ) -> None:
        """Add to one sum or two: its name, the image's, and which passes count."""
        ports: dict[str, Stream] = {}
        tables, values, spare = {}, {"passes": passes}, self.spare
        for (name, image, bits), which in zip(added, ("", "second_"), strict=False):
            sums, lows = self.sums[name], self._lows[name]
            next_sums, next_lows = spare.pop(0), spare.pop(0)
            tables[f"{which}image"], values[f"{which}added"] = images[image].texture, bits
            ports |= {f"{which}sum": sums, f"{which}low": lows}
            ports |= {f"next_{which}sum": next_sums, f"next_{which}low": next_lows}
            self.sums[name], self._lows[name] = next_sums, next_lows
            spare += [sums, lows]
        self._kernels[len(added)].run(ports, tables, values)

    def squares(self, length: int) -> Stream:
        """Sums of squared differences of the means of batches of so many passes."""
        return self._batches["pair_squares" if length == PAIR else "four_squares"]

    def means(self) -> Images:
        """The mean of each image so far, float64 (h, w, 4), row 0 at the bottom."""
        return self._means(self._names)

    def _means(self, names: Collection[str]) -> Images:
        return {name: self._mean(name, self.passes) for name in self._names if name in names}

    def _mean(self, name: str, passes: int) -> NDArray[np.float64]:
        return _mean(self.sums[name].download(), self._lows[name].download(), passes)

    def statistics(self, names: Collection[str] | None = None) -> Statistics:
        """All that the film holds; of its images only `names`, if there are any."""
        squares = {
            length: Squares(self.passes // length, self.squares(length).download())
            for length in (PAIR, FOUR)
        }
        halves = {name: self._mean(half_of(name), self.half_passes) for name in self._halved}
        means = self._means(self._names if names is None else names)
        return Statistics(self.passes, means, squares, halves, self.half_passes)

    def release(self) -> None:
        """Free streams and kernels."""
        made = (*self.sums.values(), *self._lows.values(), *self._batches.values())
        for stream in (*made, *self._own):
            stream.release()
        for kernel in (*self._kernels.values(), self._batch_kernel):
            kernel.release()


class HostFilm:
    """What Film is, in arrays, for software OpenGL: there streams are read as fast as memory is,
    and numpy adds faster than Film's kernels do."""

    def __init__(
        self, size: tuple[int, int], names: Sequence[str], halved: Sequence[str] = ()
    ) -> None:
        shape = (size[1], size[0], 4)
        self.passes = self.half_passes = 0
        self._sums = {name: np.zeros(shape) for name in names}
        self._halves = {name: np.zeros(shape) for name in halved}
        self._batches, self._squares = (
            {length: np.zeros(shape, np.float32) for length in (PAIR, FOUR)} for _ in range(2)
        )

    def prepare(self) -> None:
        """As Film.prepare: arrays are made of zeros."""

    def add(self, images: dict[str, Stream], passes: int = 1) -> None:
        """As Film.add, of one pass: software OpenGL renders none together."""
        assert passes == 1
        combined = images["combined"].download()
        for length, batch in self._batches.items():
            place = self.passes % length
            if place == 0:
                batch[:] = 0.0
            batch += combined
            if place == length - 1 and self.passes > place:
                self._end_batch(length, combined)
        first = in_first_half(self.passes)
        for name, total in self._sums.items():
            image = combined if name == "combined" else images[name].download()
            total += image
            if first and name in self._halves:
                self._halves[name] += image
        self.half_passes += first
        self.passes += 1

    def _end_batch(self, length: int, combined: NDArray[np.float32]) -> None:
        """As film_batches.glsl."""
        batches, batch = self.passes // length, self._batches[length]
        before = self._sums["combined"] + combined
        before -= batch
        before /= -batches
        before += batch
        np.square(before, out=before)
        before *= batches / (batches + 1) / length**2
        # Another array: statistics that were taken hold the one that was there.
        self._squares[length] = self._squares[length] + before.astype(np.float32)

    def means(self) -> Images:
        """As Film.means."""
        return self._means(self._sums)

    def _means(self, names: Collection[str]) -> Images:
        sums = self._sums.items()
        return {name: _mean(total, None, self.passes) for name, total in sums if name in names}

    def statistics(self, names: Collection[str] | None = None) -> Statistics:
        """As Film.statistics."""
        squares = {
            length: Squares(self.passes // length, total) for length, total in self._squares.items()
        }
        passes = self.half_passes
        halves = {name: _mean(total, None, passes) for name, total in self._halves.items()}
        means = self._means(self._sums if names is None else names)
        return Statistics(self.passes, means, squares, halves, passes)

    def release(self) -> None:
        """As Film.release."""
        for arrays in (self._sums, self._halves, self._batches, self._squares):
            arrays.clear()


def _mean(total: NDArray[Any], low: NDArray[Any] | None, passes: int) -> NDArray[np.float64]:
    """A sum, and what it had no digits for, over the passes."""
    mean = np.empty(total.shape)

    def work(rows: slice) -> None:
        mean[rows] = total[rows]
        if low is not None:
            mean[rows] += low[rows]
        mean[rows] /= max(passes, 1)

    in_blocks(total.shape, work)
    return mean


def merged(parts: Sequence[Statistics]) -> Statistics:
    """The statistics of all passes, of those of separate ranges of passes.

    Merge first, then make the picture: `picture_of` divides by the coverage, and quotients of parts
    do not average to the quotient of the whole.
    """
    passes, half_passes = sum(p.passes for p in parts), sum(p.half_passes for p in parts)
    means = _together([part.means for part in parts], [part.passes / passes for part in parts])
    of_halves = [part.half_passes / max(1, half_passes) for part in parts]
    halves = _together([part.halves for part in parts], of_halves)
    squares = {}
    for length in parts[0].squares:
        batches = [part.squares[length].batches for part in parts]
        centre = np.tensordot(
            np.array(batches) / max(1, sum(batches)), [p.means["combined"] for p in parts], axes=1
        )
        total = sum(  # Chan, Golub & LeVeque 1983, where means are of n whole batches
            part.squares[length].total
            + (part.passes / length if n else 0) * (part.means["combined"] - centre) ** 2
            for n, part in zip(batches, parts, strict=True)
        )
        squares[length] = Squares(sum(batches), np.asarray(total, np.float32))
    return Statistics(passes, means, squares, halves, half_passes)


def _together(images: Sequence[Images], weights: Sequence[float]) -> Images:
    """Weighted sums of the images of each name."""
    return {
        name: np.tensordot(weights, [image[name] for image in images], axes=1) for name in images[0]
    }
