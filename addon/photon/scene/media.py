# SPDX-License-Identifier: GPL-3.0-or-later
"""Media: what absorbs and scatters light on its way."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ..errors import SceneError
from .checks import BLACK, RGB, check_finite

MOST_ANISOTROPY = 0.999  # as Cycles has it: beyond it all goes straight on


@dataclass(frozen=True)
class Medium:
    """A homogeneous medium: per channel what it absorbs and scatters of light [1/m]; the mean
    cosine of what it scatters to straight on, by the phase function of Henyey & Greenstein 1941."""

    absorption: RGB = BLACK
    scattering: RGB = BLACK
    anisotropy: float = 0.0

    def check(self, who: str) -> None:
        """Raise SceneError naming the medium's owner and the first value out of its range."""
        check_finite(f"{who}: absorption", self.absorption, 0.0)
        check_finite(f"{who}: scattering", self.scattering, 0.0)
        if not abs(self.anisotropy) <= MOST_ANISOTROPY:
            text = f"{who}: anisotropy = {self.anisotropy} is outside +-{MOST_ANISOTROPY}"
            raise SceneError(text)

    @property
    def is_there(self) -> bool:
        """Whether light loses anything in it."""
        return max(*self.absorption, *self.scattering) > 0.0

    @property
    def scatters(self) -> bool:
        """Whether it scatters light on."""
        return max(self.scattering) > 0.0

    @staticmethod
    def read(values: Mapping[str, Any]) -> Medium:
        """Of a snapshot's."""
        return Medium(
            tuple(values["absorption"]), tuple(values["scattering"]), values["anisotropy"]
        )


NO_MEDIUM = Medium()
