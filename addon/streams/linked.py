# SPDX-License-Identifier: GPL-3.0-or-later
"""A program of a device, and its uniforms."""

from __future__ import annotations

import marshal
from collections.abc import Callable, Mapping
from typing import Any

_NEVER = b"", object()  # nothing marshals to that, and it is nothing's value


class Linked:
    """A program of a device, shared by all that run it, and its uniforms, which are written only
    where they change: that takes the host time."""

    def __init__(self, link: Callable[[], Any]) -> None:
        """`link` gives the program when it is first asked for, or raises StreamError."""
        self._link = link
        self._program: Any = None
        self._members: dict[str, Any] = {}
        self._values: dict[str, tuple[bytes, Any]] = {}  # which nobody changes in place
        self._waiting: dict[str, Any] = {}  # values that were set before there was a program

    @property
    def program(self) -> Any:
        """What OpenGL runs."""
        if self._program is None:
            self._program = self._link()
            # A compiler may have removed what a #define made unused.
            self._members = {name: self._program[name] for name in self._program}
            for name, value in self._waiting.items():
                self.set(name, value)
            self._waiting.clear()
        return self._program

    def set_all(self, values: Mapping[str, Any]) -> None:
        """As `set`, of several."""
        for name, value in values.items():
            self.set(name, value)

    def set(self, name: str, value: Any) -> None:
        """Set a uniform or a sampler's unit, if the program has it; bytes are those of an array."""
        if self._program is None:
            self._waiting[name] = value
            return
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

    def release(self) -> None:
        """Free the program, if there is one."""
        if self._program is not None:
            self._program.release()
