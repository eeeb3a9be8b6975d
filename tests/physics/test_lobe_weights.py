# SPDX-License-Identifier: GPL-3.0-or-later
"""What a lobe weighs that is drawn seldom, for others that outshine it."""

from __future__ import annotations

import pytest

from addon.photon.scene import BLACK, Lobe, Material
from addon.streams import Device
from tests.measure import render
from tests.scenes import Builder, orthographic

GLOSS = Lobe("ggx", (0.9,) * 3, {"alpha_x": 0.6, "alpha_y": 0.6, "turn": 0.0, "compensated": 0.0})
COAT = Lobe("coat", (0.5, 0.8, 0.9), {"alpha": 0.3, "ior": 1.6, "cover": 0.8})


@pytest.mark.parametrize("is_tinted", [False, True])
def test_a_weak_mirror_over_gloss(device: Device, is_tinted: bool) -> None:
    """It shows a lamp of 100 W/(m^2 sr) as 0.5, also where weights are packed because something
    else in the scene has a coloured coat: a ray of 180 goes by the mirror."""
    found = []
    for mirror in (0.005, 0.0):
        below = Material("floor", BLACK, (Lobe("mirror", (mirror,) * 3), GLOSS))
        coated = Material(
            "coated", BLACK, (COAT, Lobe("ggx", (0.5,) * 3, GLOSS.parameters, over=0))
        )
        materials = [below, Material("lamp", BLACK, (), (100.0,) * 3)]
        built = Builder().quad((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0))
        built.quad((-4.3, -0.3, 4), (-3.7, -0.3, 4), (-3.7, 0.3, 4), (-4.3, 0.3, 4), 1)
        if is_tinted:
            built.quad((9, 0, -1), (9, 1, -1), (8, 1, -1), (8, 0, -1), 2)
            materials.append(coated)
        eye = orthographic((4, 0, 4), (0, 1, 0), (-1, 0, 1), 0.1)
        scene = built.scene(eye, [], materials)
        settings = {"width": 24, "height": 24, "passes": 64, "photons": 0, "mirror_depth": 1}
        found.append(float(render(device, scene, **settings)["Combined"][..., :3].mean()))
    assert found[0] - found[1] == pytest.approx(0.5, rel=0.2)
