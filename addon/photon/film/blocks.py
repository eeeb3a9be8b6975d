# SPDX-License-Identifier: GPL-3.0-or-later
"""Work on large images, or lists, in blocks of rows: a block's intermediate results stay in the
caches, and blocks go to all cores, for numpy lets other threads run meanwhile.

All rows at once would take far longer than a GPU takes for a pass.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from functools import cache

PIXELS = 1 << 15  # of a block


def in_blocks(shape: tuple[int, ...], work: Callable[[slice], None]) -> None:
    """Call `work(rows)` for blocks of the rows of an image (h, w, ...), or of a list (h,), in any
    order; it must write to these rows alone, and not call this function. Whatever it raises is
    raised here."""
    height, width = (*shape, 1)[:2]
    rows = max(1, PIXELS // max(1, width))
    blocks = [slice(row, min(row + rows, height)) for row in range(0, height, rows)]
    if len(blocks) == 1:
        work(blocks[0])
    else:
        list(_pool().map(work, blocks))


@cache
def _pool() -> ThreadPoolExecutor:
    return ThreadPoolExecutor(os.cpu_count() or 1, "blocks")
