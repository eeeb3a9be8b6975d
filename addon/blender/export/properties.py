# SPDX-License-Identifier: GPL-3.0-or-later
"""Properties by name, as nodes ask for them."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray


def found_property(holders: Iterable[Any], name: str) -> NDArray[np.float64]:
    """(4,): the first property of that name that is a number, or up to four."""
    for holder in holders:
        if holder is None:
            continue
        value = holder.get(name)
        if value is None:
            try:
                value = holder.path_resolve(name)
            except ValueError:
                continue
        if isinstance(value, (bool, int, float)):
            return np.array((value, value, value, 1.0), np.float64)
        if hasattr(value, "__len__") and not isinstance(value, str) and 0 < len(value) <= 4:
            found = np.array((0.0, 0.0, 0.0, 1.0))
            found[: len(value)] = value
            return found
    return np.array((0.0, 0.0, 0.0, 1.0))
