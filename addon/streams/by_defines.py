# SPDX-License-Identifier: GPL-3.0-or-later
"""ByDefines: programs of one kind by what they are compiled with."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, Protocol, TypeVar

from .declaration import Defines


class Launched(Protocol):
    """Such as a Kernel."""

    launches: int


Programs = TypeVar("Programs", bound=Launched)


class ByDefines(Generic[Programs]):
    """Makes each when it is first asked for, and keeps it."""

    def __init__(self, make: Callable[[Defines], Programs]) -> None:
        """`make` compiles one with defines."""
        self._make = make
        self._made: dict[tuple[tuple[str, int | float], ...], Programs] = {}

    def of(self, defines: Defines) -> Programs:
        """That of these."""
        key = tuple(defines.items())
        if key not in self._made:
            self._made[key] = self._make(defines)
        return self._made[key]

    def made(self) -> list[Programs]:
        """Those that were asked for."""
        return list(self._made.values())

    @property
    def launches(self) -> int:
        """How often all of them have run."""
        return sum(each.launches for each in self._made.values())
