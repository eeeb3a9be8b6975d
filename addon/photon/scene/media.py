# SPDX-License-Identifier: GPL-3.0-or-later
"""Media: what absorbs and scatters light on its way, and emits some."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..errors import SceneError
from .checks import BLACK, RGB, check_finite
from .programs import Program, Result, check_program, read_program

COEFFICIENTS = ("absorption", "scattering", "emission")  # of Medium
MOST_ANISOTROPY = 0.999  # as Cycles has it: beyond it all goes straight on


@dataclass(frozen=True, eq=False)
class Grid:
    """What a medium has at places of a box, float32 (z, y, x, 3), as Medium has it, two at least
    along each axis; between them it goes evenly. `beyond`: of what is everywhere the same about
    that box and on, at places ever farther apart (stage/far.py)."""

    low: NDArray[np.float64]  # (3,) [m]
    high: NDArray[np.float64]
    extinction: NDArray[np.float32]
    scattering: NDArray[np.float32]
    emission: NDArray[np.float32]
    beyond: Grid | None = None


@dataclass(frozen=True)
class Medium:
    """What is inside a mesh, or everywhere: per channel what it absorbs and scatters of light
    [1/m], and what it adds to radiance [W/(m^3 sr)], or which results of its program, which is
    asked at places in it; the mean cosine of what it scatters to straight on, by the phase function
    of Henyey & Greenstein 1941. What is everywhere emits nothing."""

    absorption: RGB | Result = BLACK
    scattering: RGB | Result = BLACK
    anisotropy: float = 0.0
    emission: RGB | Result = BLACK
    program: Program = ()
    # What that has given, which the other values are means of then.
    grid: Grid | None = None

    def check(self, who: str) -> None:
        """Raise SceneError naming the medium's owner and the first value out of its range."""
        for name in COEFFICIENTS:
            value = getattr(self, name)
            if isinstance(value, Result):
                check_program(who, self.program, [{name: value}])
            else:
                check_finite(f"{who}: {name}", value, 0.0)
        if not abs(self.anisotropy) <= MOST_ANISOTROPY:
            text = f"{who}: anisotropy = {self.anisotropy} is outside +-{MOST_ANISOTROPY}"
            raise SceneError(text)

    @property
    def is_there(self) -> bool:
        """Whether light loses or gains anything in it."""
        return any(_may_be(getattr(self, name)) for name in COEFFICIENTS)

    @property
    def glows(self) -> bool:
        """Whether it emits light."""
        return _may_be(self.emission)

    @property
    def absorbs(self) -> bool:
        """Whether some light ends in it."""
        return _may_be(self.absorption)

    @property
    def scatters(self) -> bool:
        """Whether it scatters light on."""
        return _may_be(self.scattering)

    @property
    def coefficients(self) -> NDArray[np.float64]:
        """(3, 3) what it absorbs, scatters and emits, which no program tells."""
        return np.array([getattr(self, name) for name in COEFFICIENTS], np.float64)

    @property
    def asks(self) -> bool:
        """Whether its program tells what it is."""
        return any(isinstance(getattr(self, name), Result) for name in COEFFICIENTS)

    @property
    def varies(self) -> bool:
        """Whether it differs from place to place."""
        return self.grid is not None or self.asks

    @staticmethod
    def read(values: Mapping[str, Any]) -> Medium:
        """Of a snapshot's."""
        absorption, scattering, emission = (
            Result(**value) if isinstance(value, Mapping) else tuple(value)
            for value in (values.get(name, BLACK) for name in COEFFICIENTS)
        )
        program = read_program(values.get("program", ()))
        return Medium(absorption, scattering, values["anisotropy"], emission, program)


def _may_be(value: RGB | Result) -> bool:
    """Whether it may be above 0."""
    return isinstance(value, Result) or max(value) > 0.0


NO_MEDIUM = Medium()
