# SPDX-License-Identifier: GPL-3.0-or-later
"""A program of a device, and its uniforms."""

from __future__ import annotations

import marshal
from typing import Any

_NEVER = b"", object()  # nothing marshals to that, and it is nothing's value


class Linked:
    """A program of a device, shared by all that run it, and its uniforms, which are written only
    where they change: that takes the host time."""

    def __init__(self, program: Any) -> None:
        self.program = program
        # A compiler may have removed what a #define made unused.
        self._members = {name: program[name] for name in program}
        self._values: dict[str, tuple[bytes, Any]] = {}  # which nobody changes in place

    def set(self, name: str, value: Any) -> None:
        """Set a uniform or a sampler's unit, if the program has it; bytes are those of an array."""
        bits, given = self._values.get(name, _NEVER)
        if given is value:
            return
        member = self._members.get(name)
        if member is None:
            return
        new = marshal.dumps(value)  # as `==` takes -0.0 for 0.0
        if new != bits:
            if isinstance(value, bytes):
                member.write(value)
            else:
                member.value = value
        self._values[name] = new, value
