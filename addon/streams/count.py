# SPDX-License-Identifier: GPL-3.0-or-later
"""Count: how many elements a run did not skip, once it is known."""

from __future__ import annotations

from collections.abc import Callable


class Count:
    """A number that is on its way from the device."""

    def __init__(self, read: Callable[[], int]) -> None:
        """`read` waits for the device."""
        self._read: Callable[[], int] | None = read
        self._number = 0

    @staticmethod
    def of(number: int) -> Count:
        """One that is known."""
        return Count(lambda: number)

    def wait(self) -> int:
        """The number; waits for the device the first time."""
        if self._read:
            self._number, self._read = self._read(), None
        return self._number
