# SPDX-License-Identifier: GPL-3.0-or-later
from ..streams import Kernel, Table, Uniform
from .records import FLUX, HIT, RAY_DIRECTION, RAY_ORIGIN


class Reflector(Kernel):
    """Scatter or absorb each photon by Russian roulette (Marino & Abbate, Reflector)."""

    stem = "reflector"
    inputs = {"direction": RAY_DIRECTION, "hit": HIT, "flux": FLUX}
    outputs = {"next_origin": RAY_ORIGIN, "next_direction": RAY_DIRECTION, "next_flux": FLUX}
    uniforms = {"seed": Uniform("uint"), "pass_index": Uniform("uint"), "bounce": Uniform("int")}
    tables = {"bvh_corners": Table(), "bvh_normals": Table(), "materials": Table()}
