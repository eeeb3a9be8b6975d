# SPDX-License-Identifier: GPL-3.0-or-later
from __future__ import annotations

from collections.abc import Iterator

import pytest

from addon.photon.jobs.process import RendererProcess


@pytest.fixture
def process() -> Iterator[RendererProcess]:
    """A renderer process, ended after the test."""
    made = RendererProcess()
    yield made
    made.close()
