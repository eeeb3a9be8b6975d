# SPDX-License-Identifier: GPL-3.0-or-later
from ...streams import Kernel
from .records import BLUR, COVERAGE, DIFFUSE, IRRADIANCE, THROUGHPUT
from .shade import GLOSSY


class Blur(Kernel):
    """Add what indirect light changes by from the inner radius to the radius."""

    stem = "blur"
    structure = ("GATHERED_LOBES",)
    inputs = {
        "sum": BLUR,
        "diffuse": DIFFUSE,
        "irradiance": IRRADIANCE,
        "coverage": COVERAGE,
        "throughput": THROUGHPUT,
        **GLOSSY,
    }
    outputs = {"total": BLUR}
