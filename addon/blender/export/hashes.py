# SPDX-License-Identifier: GPL-3.0-or-later
"""The random numbers that Cycles makes of others (util/hash.h): Jenkins' lookup3."""

from __future__ import annotations

from typing import Any

WHOLE = 0xFFFFFFFF  # the largest number of 32 bits


def hashed_name(name: str) -> int:
    """The number of 32 bits of an object's name."""
    number = 0
    for byte in name.encode():
        number = (number * 37 + byte) & WHOLE
    return int(hashed(number))


def hashed(number: Any) -> Any:
    """The number of 32 bits of a number, or each of an array of int64, and 0."""
    return _hashed(number, 2)


def hashed_one(number: Any) -> Any:
    """The number of 32 bits of a number alone, or each of an array of int64."""
    return _hashed(number, 1)


def _hashed(number: Any, count: int) -> Any:
    b = c = (0xDEADBEEF + (count << 2) + 13) & WHOLE
    a = (b + number) & WHOLE
    for turn in (14, 11, 25, 16, 4, 14, 24):
        left = ((b << turn) | (b >> (32 - turn))) & WHOLE
        c = ((c ^ b) - left) & WHOLE
        a, b, c = b, c, a
    return b
