# SPDX-License-Identifier: GPL-3.0-or-later
"""The node's polynomials against the table by which constants are calculated."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("bpy", reason="the table is the add-on's, which needs bpy")

from addon.blender.export.blackbody import blackbody
from tests.kernels.conftest import Bench
from tests.unit.glsl_files import VALUE, declare

KERNEL = declare("run_blackbody", {"value": VALUE}, inputs={"temperature": VALUE})


def test_blackbody(one_bench: Bench) -> None:
    kelvin = np.concatenate([[100.0, 799.0], np.geomspace(800.0, 12000.0, 500), [20000.0]])
    got = one_bench.run(KERNEL, {"temperature": np.repeat(kelvin[:, None], 4, axis=1)})["value"]
    wanted = np.array([blackbody(each) for each in kelvin])
    assert (np.abs(got[:, :3] - wanted) <= 0.008 * np.maximum(wanted, 1.0)).all()
