# SPDX-License-Identifier: GPL-3.0-or-later
"""What one light of a scene answers to a kernel."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from addon.photon.kernels.records import LIGHT
from addon.photon.scene import Image, Light
from addon.photon.stage.environments import environment_table
from addon.photon.stage.geometry import Frame
from addon.photon.stage.kinds import light_kinds
from addon.photon.stage.light_tables import light_table
from addon.photon.stage.switches import light_defines, made_lights
from addon.streams import Table, When
from tests.kernels.conftest import Bench
from tests.unit.glsl_files import VALUE, declare

COUNT = 1 << 18
SAMPLE, DENSITY, EMIT, FLUX, SEEN, CARRIED = range(6)
FRAME = Frame(np.array([0.5, -1.0, 2.0]), 2.0)
BOUNDS = 1.5  # [scene units]
UP = (0.0, 0.0, 1.0)
PROBE = declare(
    "probe_light",
    {"first": VALUE, "second": VALUE},
    inputs={"a": VALUE, "b": VALUE, "c": VALUE},
    tables={"lights": Table(LIGHT), "environments": When("ENVIRONMENT", Table())},
    structure=("ASK", "ENVIRONMENT"),
)


# Of coarse pixels, dark ones and ones of other colours among them.
IMAGE = Image("blobs", np.random.default_rng(3).gamma(0.5, 1.0, (6, 12, 3)).astype(np.float32))
IMAGE.pixels[1:3, 2:6] = 0.0


def probe(
    bench: Bench, light: Light | NDArray[Any], ask: int, a: Any, b: Any, normal: Any = UP
) -> tuple[Any, Any]:
    """The kernel's two outputs, (n, 4) each; `light`: or its row of LIGHT."""
    texels, places = environment_table((IMAGE,))
    is_row = not isinstance(light, Light)
    table = light if is_row else light_table((light,), FRAME, BOUNDS, places)
    (kind,) = (name for name, kind in light_kinds().items() if kind.number == table["kind"][0])
    inputs = {}
    for name, given in (("a", a), ("b", b), ("c", normal)):
        inputs[name] = np.zeros((len(b), 4), np.float32)
        inputs[name][:, : np.shape(given)[-1]] = given
    result = bench.run(
        PROBE,
        inputs,
        tables={"lights": table, "environments": texels},
        defines={"ASK": ask, **light_defines({kind})},
        made=made_lights({kind}),
    )
    first, second = result["first"].astype(float), result["second"].astype(float)
    assert np.isfinite(first).all() and np.isfinite(second).all()
    return first, second


def numbers(seed: int = 11, count: int = COUNT) -> tuple[NDArray[Any], NDArray[Any]]:
    """Two of 24 bits each, twice, as random4 gives them."""
    both = np.random.default_rng(seed).integers(0, 1 << 24, (2, count, 2)) / (1 << 24)
    return both[0], both[1]
