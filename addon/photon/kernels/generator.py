# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel, Table, Uniform, When
from .records import FLUX, LIGHT, LIGHT_LIMIT, RAY_DIRECTION, RAY_ORIGIN


class Generator(Kernel):
    """Emit photons of equal flux from the lights (Marino & Abbate, Generator)."""

    stem = "generator"
    structure = ("VISIBILITY",)
    outputs = {"origin": RAY_ORIGIN, "direction": RAY_DIRECTION, "flux": FLUX}
    uniforms = {
        "seed": Uniform("uint"),
        "pass_index": Uniform("uint"),
        "photons": Uniform("int"),
        "light_count": Uniform("int"),
    }
    tables = {
        "lights": Table(LIGHT),
        "light_limits": When("VISIBILITY", Table(LIGHT_LIMIT)),
    }
