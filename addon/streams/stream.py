# SPDX-License-Identifier: GPL-3.0-or-later
"""Stream: an array of records in a texture."""

from __future__ import annotations

import copy

import moderngl
import numpy as np
from numpy.typing import NDArray

from .compute import fill
from .device import Device
from .record import Record
from .source import StreamError

# The element as four plain numbers: a port of this record takes streams of any, and a stream of it
# is taken by every input.
TEXEL = Record("Texel", {"texel": "vec4"})


class Stream:
    """A `size` = (width, height) array of `record`s, float32 RGBA, on `device`."""

    def __init__(self, device: Device, record: Record, size: tuple[int, int]) -> None:
        limit = device.texture_limit
        if record.texels > 1:
            raise StreamError(f"stream of {record.name}: {record.texels} texels an element, not 1")
        if not (0 < size[0] <= limit and 0 < size[1] <= limit):
            raise StreamError(f"stream of {record.name}: size {size} is outside 1..{limit}")
        self.device, self.record, self.size = device, record, size
        self._is_own = True
        self.texture: moderngl.Texture = device.texture(size, 4)

    def clear(self) -> None:
        """Set every element to zero: "no element"."""
        self.fill(0.0)

    def fill(self, value: float) -> None:
        """Set every channel of every element."""
        fill(self.device, self.texture, value)

    def upload(self, data: NDArray[np.float32]) -> None:
        """Fill from float32 (height, width, 4)."""
        expected = (self.size[1], self.size[0], 4)
        if data.shape != expected or data.dtype != np.float32:
            raise StreamError(
                f"stream of {self.record.name}: expected float32{expected}, "
                f"got {data.dtype}{data.shape}"
            )
        self.device.write(self.texture, np.ascontiguousarray(data), (0, 0, *self.size))

    def download(self) -> NDArray[np.float32]:
        """The elements as float32 (height, width, 4)."""
        return self.elements().reshape(self.size[1], self.size[0], 4)

    def elements(self) -> NDArray[np.float32]:
        """As download, one after the other: (width * height, 4)."""
        count = None if self._is_own else self.size[0] * self.size[1]
        return self.device.texels(self.texture, count).reshape(-1, 4)

    def take(self, elements: NDArray[np.float32]) -> None:
        """Fill from the front with (n, 4); "no element" behind them."""
        width, height = self.size
        whole = np.zeros((width * height, 4), np.float32)
        whole[: len(elements)] = elements
        self.upload(whole.reshape(height, width, 4))

    def copy(self) -> moderngl.Buffer:
        """The elements as they are, on the device: Device.copy."""
        whole = self.device.copy(self.texture)
        if self._is_own:
            return whole
        size = 16 * self.size[0] * self.size[1]
        part = self.device.buffer(size)
        self.device.copy_buffer(part, whole, size)
        self.device.put_back(whole)
        return part

    def first_rows(self, rows: int) -> Stream:
        """A stream that is the first rows of this one; `fill` fills all of them."""
        part = copy.copy(self)
        part.size, part._is_own = (self.size[0], rows), False
        return part

    def release(self) -> None:
        """Put the texture back, if it is its own."""
        if self._is_own:
            self.device.put_back(self.texture)


class PingPong:
    """Two streams that change places: `front` is read, `back` written, then `swap`."""

    def __init__(self, device: Device, record: Record, size: tuple[int, int]) -> None:
        self._own = Stream(device, record, size), Stream(device, record, size)
        self.front, self.back = self._own

    def first_rows(self, rows: int) -> PingPong:
        """A pair that is the first rows of this one, with places of its own."""
        part = copy.copy(self)
        part._own = self._own[0].first_rows(rows), self._own[1].first_rows(rows)
        part.front, part.back = part._own
        return part

    def restart(self, front: Stream) -> None:
        """Begin anew with another stream to read, such as one of zeros; that is never written."""
        self.front, self.back = front, self._own[0]

    def swap(self) -> None:
        """What was written becomes what is read."""
        first, second = self._own
        self.front, self.back = self.back, second if self.back is first else first

    def release(self) -> None:
        """Put both back."""
        for stream in self._own:
            stream.release()
