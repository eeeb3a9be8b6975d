# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel, Table, Uniform, When
from .records import FLUX, LIGHT, RAY_DIRECTION, RAY_ORIGIN, VISIBILITY
from .shade import FIRST_LOBE, POINT


class Reflector(Kernel):
    """Scatter or absorb each photon by Russian roulette (Marino & Abbate, Reflector)."""

    stem = "reflector"
    structure = (
        "LOBES",
        "TINTED",
        "TRANSMITS",
        "TRANSPARENT",
        "ARRIVALS",
        "ENVIRONMENT",
        "VISIBILITY",
        "NORMALS",
    )
    inputs = {
        "origin": When("ARRIVALS", RAY_ORIGIN),
        "direction": RAY_DIRECTION,
        "flux": FLUX,
        **POINT,
        **FIRST_LOBE,
    }
    outputs = {"next_origin": RAY_ORIGIN, "next_direction": RAY_DIRECTION, "next_flux": FLUX}
    uniforms = {"seed": Uniform("uint"), "pass_index": Uniform("uint"), "bounce": Uniform("int")}
    tables = {
        "lights": When("ARRIVALS", Table(LIGHT)),
        "environments": When("ENVIRONMENT", Table()),
        "visibility": When("VISIBILITY", Table(VISIBILITY)),
    }
