# SPDX-License-Identifier: GPL-3.0-or-later
"""Ask a kernel what surfaces have at points of triangles."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...streams import Kernel, Stream


def asked_at(
    kernel: Kernel,
    places: NDArray[np.intp],
    weights: NDArray[np.float64],
    directions: NDArray[np.float64],
    tables: Mapping[str, Any],
) -> NDArray[np.float32]:
    """(m, n, 3) of the kernel's output, for rays of directions (m, n, 3) that end at points of
    triangles at places (n,) of a mesh; `weights`: (m, n, 2) of their second and third corners, or
    what becomes that."""
    rows, width, _ = directions.shape
    ports = {**kernel.inputs, **kernel.outputs}
    (output,) = kernel.outputs
    streams = {name: Stream(kernel.device, record, (width, rows)) for name, record in ports.items()}
    hits, rays = (np.zeros((rows, width, 4), np.float32) for _ in range(2))
    hits[..., 0], hits[..., 1], hits[..., 2:] = 1.0, places + 1, weights
    rays[..., :3] = directions
    try:
        streams["hit"].upload(hits)
        streams["direction"].upload(rays)
        kernel.run(streams, tables)
        found: NDArray[np.float32] = streams[output].download()[..., :3]
    finally:
        for stream in streams.values():
            stream.release()
    return found
