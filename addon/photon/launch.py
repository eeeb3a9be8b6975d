# SPDX-License-Identifier: GPL-3.0-or-later
"""Launching a kernel on what a pass has under way."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from ..streams import Kernel, Stream
from ..streams.device import nothing
from .tables import Tables


def launch(
    kernel: Kernel,
    streams: Mapping[str, Stream],
    tables: Tables,
    uniforms: Mapping[str, Any] | None = None,
    count: bool = False,
    meanwhile: Callable[[], None] = nothing,
) -> int:
    """Run a kernel on those of the streams, tables and uniforms that it declares; as Kernel.run."""
    ports = {name: streams[name] for name in (*kernel.inputs, *kernel.outputs)}
    values = {name: value for name, value in (uniforms or {}).items() if name in kernel.uniforms}
    return kernel.run(ports, tables.of(kernel), values, count, meanwhile)
