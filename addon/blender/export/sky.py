# SPDX-License-Identifier: GPL-3.0-or-later
"""The disc of the sun in a Sky Texture, as a light of its own: no pixel of an image is as small."""

from __future__ import annotations

import math
from dataclasses import dataclass

import bpy
import numpy as np
from numpy.typing import NDArray

from ...photon.scene import RGB, triple
from ...photon.stage.environments import solid_angles
from .environment import EnvironmentMap
from .links import Scope
from .working_space import luminance_weights
from .world_nodes import evaluate

WITHOUT_DISC = {"PREETHAM", "HOSEK_WILKIE"}  # types of skies
# What is evaluated is as wide or wider, for all of its pixels to be met: it brings as much light.
LEAST_ANGLE = math.radians(0.5)


@dataclass(frozen=True)
class Disc:
    """The sun's."""

    direction: RGB  # in which it shines
    irradiance: NDArray[np.float64]  # (3,) [W/m^2] of what faces it
    angle: float  # [rad]


def has_disc(node: bpy.types.Node) -> bool:
    """Whether the whole of a sun's disc is above a sky's horizon."""
    shines = node.sky_type not in WITHOUT_DISC and node.sun_disc and node.sun_intensity > 0.0
    size = max(node.sun_size, LEAST_ANGLE)
    return bool(shines and math.sin(node.sun_elevation) > math.sin(size / 2))


def read_sky(
    node: bpy.types.Node, output: bpy.types.NodeSocket, scope: Scope
) -> tuple[EnvironmentMap, Disc | None]:
    """A sky without its disc, and that. Raises Unsuited."""
    sky = evaluate(node, output, scope, {"sun_disc": False})
    wide = {"sun_size": max(float(node.sun_size), LEAST_ANGLE)}
    more = evaluate(node, output, scope, wide).astype(np.float64) - sky
    height, width = sky.shape[:2]
    rows = np.flatnonzero(more.max(axis=(1, 2)) > 0.0)
    brought = more[rows].clip(0.0) * solid_angles(height, width)[rows, None, None]
    irradiance = brought.sum(axis=(0, 1))
    if not irradiance.any():
        return EnvironmentMap(sky, np.eye(3)), None
    up = np.pi * ((rows[:, None] + 0.5) / height - 0.5)
    around = np.pi * (1.0 - 2.0 * (np.arange(width) + 0.5) / width)
    places = [np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up) + 0.0 * around]
    weights = luminance_weights()
    middle = np.array([(brought @ weights * place).sum() for place in places])
    direction = triple(-middle / np.linalg.norm(middle))
    return EnvironmentMap(sky, np.eye(3)), Disc(direction, irradiance, float(node.sun_size))
