# SPDX-License-Identifier: GPL-3.0-or-later
"""SceneNeeds: what a scene has no use for is neither compiled nor run."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from addon.photon.prepare import prepare
from addon.photon.scene import Lobe, Material, Scene, phong, world_light
from addon.photon.settings import Settings
from addon.photon.stage.light_tree import MOST_ASKED
from addon.photon.stage.portals import WORLD_RAYS
from addon.streams import Device, Kernel
from tests.scenes import Builder, backdrop, cornell, plain_material, with_cone
from tests.stability.table import Measured
from tests.unit.test_denoiser import needs_it

PHOTONS = {"generator", "projector", "reflector", "cuts", "coverage"}
DIRECT = {"direct"}
MIRROR = {"scatter", "combine_mirror", "add_chain"}
# What rays in smaller streams see the host may add; of so small a frame all move there.
RUN_FOR_MIRRORS = MIRROR - {"add_chain"}
ALWAYS = {"eye_rays", "combine_primary", "combine_all"}
PASSES = 2


@pytest.fixture
def compiled(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[str]]:
    """The stems of the kernels built in a test, with their defines."""
    built: list[str] = []
    build = Kernel.__init__

    def record(
        self: Kernel, device: Device, layer: Any, defines: Any = None, *args: Any, **kwargs: Any
    ) -> None:
        own = [name for name in defines or {} if name in self.structure]
        built.append(" ".join([self.stem, *own]))
        build(self, device, layer, defines, *args, **kwargs)

    monkeypatch.setattr(Kernel, "__init__", record)
    yield built


def run(device: Device, scene: Scene, **settings: Any) -> tuple[dict[str, int], dict[str, Any]]:
    """Launches that were not zero, and the images."""
    # On a layer whose every kernel is GLSL: what is not compiled is not run either.
    settings = {
        "width": 16,
        "height": 16,
        "photons": 2000,
        "passes": PASSES,
        "backend": "fragment",
    } | settings
    renderer = prepare(scene, Settings(**settings), device)
    for _ in range(PASSES):
        renderer.render_pass()
    launches, images = renderer.launches(), renderer.images()
    renderer.release()
    error = images.pop("Error")
    assert np.isinf(error).all()  # unknown: too few passes
    assert all(np.isfinite(image).all() for image in images.values())
    return {name: count for name, count in launches.items() if count}, images


def stems(compiled: list[str]) -> set[str]:
    """But those of the film, and the one that tells whether lights emit anything."""
    rest = {"film", "film_two", "film_batches", "light_flux"}
    return {name.split()[0] for name in compiled} - rest


def test_everything(device: Device, compiled: list[str]) -> None:
    """The measure for the others: a scene that needs it all."""
    launches, images = run(device, cornell(True))
    kernels = ALWAYS | PHOTONS | DIRECT | MIRROR | {"tracer", "shade", "gather"}
    assert launches.keys() | MIRROR == kernels == stems(compiled)
    assert launches.keys() >= RUN_FOR_MIRRORS
    assert launches["eye_rays"] == launches["combine_primary"] == PASSES
    assert launches["generator"] == PASSES
    assert launches["gather"] == launches["direct"]
    assert launches["direct"] == launches["shade"] - launches["reflector"]  # photons'
    assert all(images[name].mean() > 0 for name in ("Direct", "Indirect", "Mirror"))


def test_no_mirror(device: Device, compiled: list[str]) -> None:
    launches, images = run(device, cornell())
    assert not MIRROR & (launches.keys() | stems(compiled))
    assert launches["direct"] == launches["gather"] == PASSES
    assert not images["Mirror"].any() and images["Indirect"].mean() > 0


def test_mirror_that_no_triangle_wears(device: Device, compiled: list[str]) -> None:
    """Materials without triangles make no work."""
    scene = cornell()
    assert any(m.lobes for m in scene.materials)
    run(device, scene)
    assert not MIRROR & stems(compiled)


def test_mirror_depth_zero(device: Device, compiled: list[str]) -> None:
    run(device, cornell(True), mirror_depth=0)
    assert not MIRROR & stems(compiled)


def test_mirror_out_of_sight(device: Device) -> None:
    """No secondary ray alive: one look a pass, and no more."""
    scene = cornell(True)
    matrix = scene.camera.matrix.copy()
    matrix[:3, :3] = np.diag([-1.0, -1.0, 1.0]) @ matrix[:3, :3]  # the camera turns its back
    launches, _ = run(device, replace(scene, camera=replace(scene.camera, matrix=matrix)))
    assert launches["scatter"] == PASSES and "combine_mirror" not in launches
    assert launches["shade"] == PASSES + launches["reflector"]  # photons'


def test_mirror_chain_ends_with_its_rays(device: Device) -> None:
    """A single mirror: its ray, then one look that finds nobody alive, however deep one may go."""
    mirror = plain_material("mirror", (0.0, 0.0, 0.0), (0.9, 0.9, 0.9))
    plate = Builder().quad((-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0))
    scene = cornell()
    view = replace(scene.camera, matrix=np.eye(4) + np.outer([0, 0, 1, 0], [0, 0, 0, 2.0]))
    launches, images = run(
        device,
        plate.scene(view, materials=[mirror], background=(1.0, 1.0, 1.0)),
        mirror_depth=1000,
    )
    assert launches["scatter"] == 2 * PASSES and launches["combine_mirror"] == PASSES
    assert images["Mirror"].max() == pytest.approx(0.9)


@pytest.mark.stability(35)
@pytest.mark.parametrize("lights", ["none", "no power", "dark cone"])
def test_no_light(device: Device, compiled: list[str], lights: str) -> None:
    scene = cornell(True)
    off = replace(scene.lights[0], power=(0.0, 0.0, 0.0))
    shut = with_cone(scene.lights[0], 0.0)
    kinds = {"none": (), "no power": (off, off), "dark cone": (shut,)}
    launches, images = run(device, replace(scene, lights=(*kinds[lights], *backdrop((0.5,) * 3))))
    assert not (PHOTONS | DIRECT | {"gather"}) & (launches.keys() | stems(compiled))
    assert not images["Direct"].any() and not images["Indirect"].any()
    assert images["Mirror"].max() > 0  # the background in the chrome sphere


def test_one_light_of_two_is_off(device: Device) -> None:
    scene = cornell()
    off = replace(scene.lights[0], power=(0.0, 0.0, 0.0))
    launches, images = run(device, replace(scene, lights=(off, scene.lights[0])))
    assert launches["direct"] == PASSES
    _, alone = run(device, scene)
    assert np.array_equal(images["Direct"], alone["Direct"])


def test_black_scene(device: Device, compiled: list[str]) -> None:
    scene = cornell(True)
    black = tuple(replace(m, diffuse=(0.0, 0.0, 0.0), lobes=()) for m in scene.materials)
    launches, images = run(device, replace(scene, materials=black))
    assert stems(compiled) == launches.keys() == ALWAYS | {"tracer", "shade"}
    assert launches["tracer"] == PASSES  # eye rays only
    assert not images["Combined"][..., :3].any()


def test_mirrors_only(device: Device, compiled: list[str]) -> None:
    """Mirrors show no point light, and no photon ever stays on them."""
    scene = cornell(True)
    chrome = tuple(plain_material(m.name, (0.0,) * 3, (0.9,) * 3) for m in scene.materials)
    run(device, replace(scene, materials=chrome))
    assert not (PHOTONS | DIRECT) & stems(compiled) and stems(compiled) >= MIRROR


@pytest.mark.parametrize("tint", [(1.0, 1.0, 1.0), (0.9, 0.5, 0.5)])
def test_layers(device: Device, compiled: list[str], tint: Any) -> None:
    """Only Shade knows them; a tint, who asks for lobes' weights."""
    coat = {"alpha": 0.01, "ior": 1.5, "cover": 1.0}
    rough = Lobe("oren_nayar", (0.1, 0.1, 0.1), {"diffuse_roughness": 1.0})
    scene, settings = cornell(), {"photons": 500}
    for lobes in ((rough,), (Lobe("coat", tint, coat), replace(rough, over=0))):
        compiled.clear()
        materials = tuple(replace(m, lobes=lobes, is_mixture=True) for m in scene.materials)
        run(device, replace(scene, materials=materials), **settings)
        knows = {name.split()[0] for name in compiled if "LAYERS" in name.split()}
        assert knows == ({"shade"} if len(lobes) > 1 else set())
        told = {name.split()[0] for name in compiled if "TINTED" in name.split()}
        assert bool(told) == (len(lobes) > 1 and tint != (1.0, 1.0, 1.0))


@pytest.mark.stability(56)
def test_no_photons(device: Device, compiled: list[str]) -> None:
    launches, images = run(device, cornell(True), photons=0)
    assert not (PHOTONS | {"gather"}) & (launches.keys() | stems(compiled))
    assert images["Direct"].mean() > 0 and not images["Indirect"].any()


def test_photons_carry_direct_light(device: Device, compiled: list[str]) -> None:
    launches, images = run(device, cornell(), direct_by_photons=True)
    assert not DIRECT & stems(compiled)
    assert not images["Direct"].any() and images["Indirect"].mean() > 0
    assert launches["projector"] == launches["reflector"]


@pytest.mark.stability(37)
def test_empty_scene(device: Device, compiled: list[str], measured: Measured) -> None:
    scene = Builder().scene(cornell().camera, cornell().lights, background=(0.1, 0.2, 0.3))
    launches, images = run(device, scene)
    assert stems(compiled) == launches.keys() == ALWAYS | {"emitted"}
    expected = np.float32([0.1, 0.2, 0.3, 1.0])
    error = np.abs(images["Combined"] / expected - 1).max()
    assert measured("background off by", error) <= 1e-6
    assert np.array_equal(images["Combined"][..., :3], images["Background"])
    assert (images["Depth"] >= 1e9).all() and not images["Normal"].any()


def test_empty_scene_transparent(device: Device) -> None:
    scene = Builder().scene(cornell().camera, background=(0.1, 0.2, 0.3))
    _, images = run(device, scene, transparent=True)
    assert not images["Combined"].any()


@pytest.mark.parametrize("mirror", [False, True])
def test_splat_builds_a_grid_only_for_mirrors(
    device: Device, compiled: list[str], mirror: bool
) -> None:
    launches, _ = run(device, cornell(mirror), estimator="splat")
    assert launches["splat"] == PASSES
    assert ("gather" in launches) == mirror
    assert ("gather" in {name.split()[0] for name in compiled}) == mirror


def test_photons_end_with_the_last_one_alive(device: Device) -> None:
    """A convex scene under the sky: every photon bounces once and is gone. As none lands then,
    others look three times where to start, and the first pass begins again."""
    plate = Builder().quad((-50, -50, 0), (50, -50, 0), (50, 50, 0), (-50, 50, 0))
    scene = plate.scene(cornell().camera, cornell().lights)
    launches, _ = run(device, scene, photon_bounces=1000)
    assert launches["reflector"] == 2 * (PASSES + 3)


def shiny(*lobes: Lobe) -> Scene:
    """The room whose walls have these."""
    scene = cornell()
    return replace(scene, materials=(Material("shiny", (0.1,) * 3, lobes), *scene.materials[1:]))


@pytest.mark.parametrize("count", [1, 2, 3])
def test_lobes_of_a_point(device: Device, compiled: list[str], count: int) -> None:
    """The programs have room for as many as a point has, two at most; photons meet one."""
    kinds = phong((0.1,) * 3, 900.0), phong((0.1,) * 3), phong((0.1,) * 3, 3000.0)
    run(device, shiny(*kinds[:count]))
    several = " TWO_LOBES" if count > 1 else ""
    assert f"shade EYE LOBES{several}" in compiled and f"scatter LOBES{several}" in compiled
    assert f"direct SHADOW_RAYS SMOOTH LOBES{several}" in compiled
    assert "shade PHOTONS LOBES" in compiled and "reflector LOBES" in compiled
    # Lobes that reflect nothing are none.
    compiled.clear()
    run(device, shiny(*(replace(kind, colour=(0.0, 0.0, 0.0)) for kind in kinds)))
    assert "shade" in compiled and not any("LOBES" in name for name in compiled)


def gathering(compiled: list[str]) -> list[str]:
    return [name for name in compiled if "GATHERED_LOBES" in name or "DIRECTIONS" in name]


def test_broad_lobes_gather_photons(device: Device, compiled: list[str]) -> None:
    """Where all are broad no secondary rays are sent; where none is nobody asks for directions."""
    broad, half, sharp = (phong((0.1,) * 3, 2 / r**4 - 2) for r in (0.6, 0.45, 0.3))
    launches, images = run(device, shiny(broad))
    assert not MIRROR & launches.keys() and not images["Mirror"].any()
    stems = {name.split()[0] for name in gathering(compiled)}
    assert stems == {"shade", "projector", "gather", "combine_primary"}
    for lobes in ((half,), (sharp, broad)):
        launches, images = run(device, shiny(*lobes))
        assert launches.keys() >= RUN_FOR_MIRRORS and images["Mirror"].any()
    compiled.clear()
    run(device, shiny(sharp))
    for no_photons in ({"photons": 0}, {"mirror_depth": 0}, {"estimator": "splat"}):
        run(device, shiny(broad), **no_photons)
    met_alone = replace(cornell().lights[0], found_by=("camera", "diffuse", "chains"))
    run(device, replace(shiny(broad), lights=(met_alone,)))  # by rays of lobes, not by shadow rays
    assert not gathering(compiled)


def test_mirrors_show_no_light(device: Device, compiled: list[str]) -> None:
    """Direct light asks nothing of delta lobes."""
    run(device, shiny(phong((0.5,) * 3)))
    assert "direct SHADOW_RAYS SMOOTH" in compiled and "shade EYE LOBES" in compiled


def test_only_bent_surfaces_have_a_terminator(device: Device, compiled: list[str]) -> None:
    scene = cornell()
    flat = np.repeat(scene.corner_normals[:, :1], 3, axis=1)
    run(device, replace(scene, corner_normals=flat))
    assert "direct SHADOW_RAYS" in compiled


@pytest.mark.parametrize("more", [0, 1])
def test_more_lights_than_a_point_asks(device: Device, compiled: list[str], more: int) -> None:
    scene = cornell()
    off = replace(scene.lights[0], power=(0.0, 0.0, 0.0))  # does not count
    lights = scene.lights * (MOST_ASKED + more)
    launches, _ = run(device, replace(scene, lights=(off, *lights)))
    assert f"direct SHADOW_RAYS{' DRAWN' if more else ''} SMOOTH" in compiled
    assert launches["direct"] == PASSES


def test_native_way_of_shadow_rays(device: Device, compiled: list[str]) -> None:
    """A program for each kind, launched once a light that there is to ask, and oftener for the sky,
    which shines in by the front; without any, none."""
    camera = replace(cornell().lights[0], found_by=("camera",))
    sky = world_light("sky", (0.1,) * 3)
    scene = replace(cornell(), lights=(*cornell().lights * 6, sky, camera))
    launches, images = run(device, scene, backend="native")
    assert "direct" not in launches
    assert launches["shadow_rays"] == (6 + WORLD_RAYS) * PASSES
    assert sum(name.startswith("shadow_rays ") for name in compiled) == 2
    assert images["Direct"].mean() > 0
    compiled.clear()
    run(device, replace(scene, lights=()), backend="native")
    assert "shadow_rays" not in stems(compiled)


@pytest.mark.parametrize(
    "settings", [pytest.param({"denoise": True}, marks=needs_it), {"denoising_data": True}], ids=str
)
def test_what_denoisers_go_by(
    device: Device, compiled: list[str], settings: dict[str, Any]
) -> None:
    """Is found where it is asked for alone."""
    launches, _ = run(device, cornell(True))
    assert "features" not in launches and not any("FEATURES" in name for name in compiled)
    compiled.clear()
    launches, _ = run(device, cornell(True), **settings)
    assert launches["features"] == launches["combine_primary"] + launches["combine_mirror"]
    assert any("add_chain" in name and "FEATURES" in name for name in compiled)


def test_what_is_emissive(device: Device, compiled: list[str]) -> None:
    """Its triangles are lights: shadow rays and photons without a lamp. Only they ask for more."""
    scene = replace(cornell(), lights=())
    run(device, scene)
    assert not {"direct", "generator", "emitted"} & stems(compiled)
    compiled.clear()
    material = scene.materials[0]
    emissive = replace(material, emission=(1.0, 1.0, 1.0))
    images = run(device, replace(scene, materials=(emissive, *scene.materials[1:])))[1]
    assert {"direct", "generator"} <= stems(compiled)
    assert any(name.split()[0] == "emitted" and "EMISSIVE" in name for name in compiled)
    assert all(images[name].max() > 0 for name in ("Direct", "Indirect", "Emission"))
