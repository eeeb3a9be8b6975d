# SPDX-License-Identifier: GPL-3.0-or-later
"""Three numbers, a colour's or a vector's, as the scene's values have them."""

from __future__ import annotations

from collections.abc import Iterable

from ...photon.scene import RGB


def triple(numbers: Iterable[float]) -> RGB:
    """Of three numbers of any type."""
    x, y, z = map(float, numbers)
    return x, y, z
