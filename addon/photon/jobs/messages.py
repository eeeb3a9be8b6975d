# SPDX-License-Identifier: GPL-3.0-or-later
"""Messages between the renderer process and its parent: JSON objects behind their length."""

from __future__ import annotations

import json
import struct
from typing import Any, BinaryIO

Message = dict[str, Any]

_LENGTH = struct.Struct("<Q")


def send(pipe: BinaryIO, message: Message) -> None:
    """Write one message; OSError if the other side is gone."""
    text = json.dumps(message).encode()
    pipe.write(_LENGTH.pack(len(text)) + text)
    pipe.flush()


def receive(pipe: BinaryIO) -> Message | None:
    """Read one message; None if the other side is gone, ValueError if it is damaged."""
    head = pipe.read(_LENGTH.size)
    if len(head) < _LENGTH.size:
        return None
    length = _LENGTH.unpack(head)[0]
    text = pipe.read(length)
    if len(text) < length:  # gone in the middle of a word
        return None
    return json.loads(text)  # type: ignore[no-any-return]
