# SPDX-License-Identifier: GPL-3.0-or-later
from ..streams import Kernel, Table
from .records import BLUR, COVERAGE, FACING, IRRADIANCE, THROUGHPUT


class Blur(Kernel):
    """Add what indirect light changes by from the inner radius to the radius."""

    stem = "blur"
    inputs = {
        "sum": BLUR,
        "facing": FACING,
        "irradiance": IRRADIANCE,
        "coverage": COVERAGE,
        "throughput": THROUGHPUT,
    }
    outputs = {"total": BLUR}
    tables = {"materials": Table()}
