# SPDX-License-Identifier: GPL-3.0-or-later
"""What one light of a scene answers to a kernel."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from addon.photon.kernels.records import LIGHT
from addon.photon.scene import Light
from addon.photon.stage.geometry import Frame
from addon.photon.stage.kinds import light_kinds, made_lights
from addon.photon.stage.tables import light_table
from addon.streams import Table
from tests.kernels.conftest import Bench
from tests.unit.glsl_files import VALUE, declare

COUNT = 1 << 18
SAMPLE, DENSITY, EMIT, FLUX, SEEN = range(5)
FRAME = Frame(np.array([0.5, -1.0, 2.0]), 2.0)
BOUNDS = 1.5  # [scene units]
UP = (0.0, 0.0, 1.0)
PROBE = declare(
    "probe_light",
    {"first": VALUE, "second": VALUE},
    inputs={"a": VALUE, "b": VALUE, "c": VALUE},
    tables={"lights": Table(LIGHT)},
    structure=("ASK",),
)


def probe(
    bench: Bench, light: Light | NDArray[Any], ask: int, a: Any, b: Any, normal: Any = UP
) -> tuple[Any, Any]:
    """The kernel's two outputs, (n, 4) each; `light`: or its row of LIGHT."""
    table = light_table((light,), FRAME, BOUNDS) if isinstance(light, Light) else light
    (kind,) = (name for name, kind in light_kinds().items() if kind.number == table["kind"][0])
    inputs = {}
    for name, given in (("a", a), ("b", b), ("c", normal)):
        inputs[name] = np.zeros((len(b), 4), np.float32)
        inputs[name][:, : np.shape(given)[-1]] = given
    result = bench.run(
        PROBE,
        inputs,
        tables={"lights": table},
        defines={"ASK": ask},
        made=made_lights({kind}),
    )
    first, second = result["first"].astype(float), result["second"].astype(float)
    assert np.isfinite(first).all() and np.isfinite(second).all()
    return first, second


def numbers(seed: int = 11, count: int = COUNT) -> tuple[NDArray[Any], NDArray[Any]]:
    """Two of 24 bits each, twice, as random4 gives them."""
    both = np.random.default_rng(seed).integers(0, 1 << 24, (2, count, 2)) / (1 << 24)
    return both[0], both[1]
