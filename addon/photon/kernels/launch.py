# SPDX-License-Identifier: GPL-3.0-or-later
"""Launching a kernel on what a pass has under way: of streams, tables and uniforms it takes those
that it declares."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ...streams import Count, Kernel, Stream, Tally
from ..stage.tables import Tables

Streams = Mapping[str, Stream]


def launch(
    kernel: Kernel, streams: Streams, tables: Tables, uniforms: Mapping[str, Any] | None = None
) -> None:
    """As Kernel.run."""
    kernel.run(*_bound(kernel, streams, tables, uniforms or {}))


def launch_and_count(
    kernel: Kernel, streams: Streams, tables: Tables, uniforms: Mapping[str, Any] | None = None
) -> Count:
    """As Kernel.count."""
    return kernel.count(*_bound(kernel, streams, tables, uniforms or {}))


def launch_and_tally(
    kernel: Kernel,
    streams: Streams,
    tables: Tables,
    uniforms: Mapping[str, Any] | None = None,
    *,
    into: Tally,
) -> None:
    """As Kernel.tally."""
    kernel.tally(*_bound(kernel, streams, tables, uniforms or {}), into=into)


def _bound(
    kernel: Kernel, streams: Streams, tables: Tables, uniforms: Mapping[str, Any]
) -> tuple[dict[str, Stream], dict[str, Any], dict[str, Any]]:
    ports = {name: streams[name] for name in (*kernel.inputs, *kernel.outputs)}
    values = {name: value for name, value in uniforms.items() if name in kernel.uniforms}
    return ports, tables.of(kernel), values
