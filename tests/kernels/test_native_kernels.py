# SPDX-License-Identifier: GPL-3.0-or-later
"""The kernels that the native core runs give what the GLSL ones give."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, get_args

import numpy as np
import photon_stream_native as native
import pytest

from addon.photon.backends.native_kernels import NativeTracer, NativeTriangles, tracer_of
from addon.photon.backends.native_photon_grid import MixedPhotonGrid, NativePhotonGrid
from addon.photon.kernels.records import HIT, RAY_DIRECTION, RAY_ORIGIN
from addon.photon.kernels.tracer import Tracer
from addon.photon.photons.mapper import PhotonBatch
from addon.photon.photons.native_photon_mapper import _lights, _materials
from addon.photon.prepare import prepare
from addon.photon.scene import Instruction, Lobe, Material, Result, Scene
from addon.photon.settings import Filter, Settings
from addon.photon.stage.geometry import Mesh, frame_of
from addon.photon.stage.light_tables import choose_lights, light_table
from addon.photon.stage.upload import texels_of, upload_table
from addon.streams import Device, Stream, StreamError
from tests.measure import render
from tests.scenes import cornell

SIZE = (256, 128)
SCENE = cornell(mirror=True, lobe=True)


def rays(seed: int = 3) -> tuple[Any, Any]:
    """Rays of every sort: a tenth goes nowhere, a tenth is short, some pass a triangle by."""
    rng = np.random.default_rng(seed)
    origin = rng.uniform(-0.9, 0.9, (SIZE[1], SIZE[0], 4)).astype(np.float32)
    origin[..., 3] = np.where(rng.random(origin.shape[:2]) < 0.5, -1, rng.integers(0, 50))
    direction = rng.normal(size=origin.shape).astype(np.float32)
    direction[..., :3] /= np.linalg.norm(direction[..., :3], axis=-1, keepdims=True)
    direction[..., 3] = np.where(rng.random(origin.shape[:2]) < 0.1, 0.3, 3e38)
    direction[rng.random(origin.shape[:2]) < 0.1] = 0.0
    return origin, direction


@pytest.mark.parametrize("any_hit", [False, True])
def test_tracer(device: Device, any_hit: bool) -> None:
    mesh = Mesh.build(SCENE, frame_of(SCENE))
    streams = {
        name: Stream(device, record, SIZE)
        for name, record in (("origin", RAY_ORIGIN), ("direction", RAY_DIRECTION), ("hit", HIT))
    }
    origin, direction = rays()
    streams["origin"].upload(origin)
    streams["direction"].upload(direction)
    tables = {
        "nodes": upload_table(device, mesh.tree.nodes),
        "triangles": upload_table(device, texels_of(mesh.triangles)),
    }
    kernels = (
        Tracer(device, "fragment", {"ANY_HIT": 1} if any_hit else {}),
        NativeTracer(device, triangles_of(mesh), any_hit),
    )
    found, counts = [], []
    for kernel, bound in zip(kernels, (tables, {}), strict=True):
        counts.append(kernel.count(streams, bound).wait())
        found.append(streams["hit"].download())
        kernel.release()
    glsl, ours = found
    hit = glsl[..., 1] > 0
    assert 0.5 < hit.mean() < 1 and counts[0] == hit.sum()
    if any_hit:
        # Which one is found first is the tree's business; whether one is found is not.
        assert (hit == (ours[..., 1] > 0)).mean() > 1 - 1e-4
        return
    same = glsl[..., 1] == ours[..., 1]
    assert same.mean() > 1 - 1e-3  # where two triangles meet, either may be hit
    close = np.isclose(ours[same], glsl[same], rtol=2e-4, atol=2e-6)
    assert close.mean() >= (1.0 if device.is_software else 1 - 1e-4)  # grazing rays
    assert abs(counts[0] - counts[1]) < 1e-4 * hit.size


class TestPhotons:
    """What Generator, Tracer, Projector and Reflector do in turns, in one call."""

    SETTINGS = Settings(width=8, height=8, photons=3000, seed=5)

    def deposits(
        self, device: Device, backend: str, index: int = 3, **settings: Any
    ) -> tuple[Any, Any, int]:
        renderer = prepare(SCENE, replace(self.SETTINGS, backend=backend, **settings), device)  # type: ignore[arg-type]
        assert renderer.photons
        renderer.photons.mapper.start(PhotonBatch(index, self.SETTINGS.photons_a_pass))
        place, deposit = (x.copy() for x in renderer.photons.mapper.finish().arrays())
        unfinished = renderer.photons.mapper.unfinished
        renderer.release()
        return place, deposit, unfinished

    @pytest.mark.parametrize(
        ("index", "first_hits"), [(3, False), (3, True), ((1 << 23) + 70, True)]
    )
    def test_same_photons_as_the_kernels(
        self, device: Device, index: int, first_hits: bool
    ) -> None:
        found = [
            self.deposits(device, backend, index, direct_by_photons=first_hits, photon_bounces=4)
            for backend in ("fragment", "native")
        ]
        counts = [len(place) for place, _, _ in found]
        assert min(counts) > 800 and abs(counts[0] - counts[1]) <= 2
        assert found[0][2] == pytest.approx(found[1][2], abs=2)
        for (place, deposit, _), (others, their_deposit, _) in (found, found[::-1]):
            near = np.array([((others[:, :3] - p[:3]) ** 2).sum(axis=1).argmin() for p in place])
            same = np.isclose(others[near], place, atol=1e-4).all(axis=1)
            same &= np.isclose(their_deposit[near, :3], deposit[:, :3], rtol=1e-3).all(axis=1)
            # Rounding turns a path at an edge.
            assert same.mean() > 0.998

    def test_order_is_that_of_bounces_and_photons(self, device: Device) -> None:
        """So fewer bounces are the first photons of more, and fewer threads change nothing."""
        first, _, _ = self.deposits(device, "native", direct_by_photons=True, photon_bounces=1)
        place, _, _ = self.deposits(device, "native", direct_by_photons=True)
        assert 2000 < len(first) < len(place)
        np.testing.assert_array_equal(place[: len(first)], first)

    def test_bad_tables(self) -> None:
        mesh = Mesh.build(SCENE, frame_of(SCENE))
        tracer = tracer_of(mesh)
        normals = texels_of(mesh.normals).reshape(-1, 3, 4)
        table = light_table(SCENE.lights, frame_of(SCENE))
        choose_lights(table, np.ones((len(table), 3)))
        lights = texels_of(_lights(table)).reshape(len(table), -1, 4)
        draw: Any = {"seed": 1, "pass_index": 0, "photons": 100, "bounces": 3, "first_hits": True}
        draw["directions"] = False
        count = len(SCENE.materials)
        materials = texels_of(_materials(SCENE.materials)).reshape(count, -1, 4)
        assert len(tracer.photons(normals, materials, lights, **draw)[0]) > 100
        with pytest.raises(ValueError, match="normals: expected shape"):
            tracer.photons(normals[:-1].copy(), materials, lights, **draw)
        none, _, unfinished = tracer.photons(normals, materials[:0].copy(), lights, **draw)
        assert len(none) == unfinished == 0
        assert len(tracer.photons(normals, materials, lights[:0].copy(), **draw)[0]) == 0


@pytest.mark.parametrize("name", get_args(Filter))
def test_gather_and_coverage(device: Device, name: str) -> None:
    """A picture's indirect light, to rounding, and where coverage is less than one."""
    settings: dict[str, Any] = {"width": 64, "height": 64, "filter": name, "radius": 0.8}
    glsl, ours = (
        render(device, SCENE, backend=backend, passes=2, **settings)
        for backend in ("fragment", "native")
    )
    for image in ("Direct", "Indirect", "Mirror"):
        a, b = glsl[image], ours[image]
        assert a.mean() > 0
        # A photon that meets an edge, or lies within rounding of the radius, may count in one.
        differ = np.abs(a - b) > 1e-3 * np.maximum(a, a.mean())
        assert differ.mean() < (0.02 if name in ("constant", "gaussian") else 0.005), image
        assert abs(b.mean() / a.mean() - 1) < 1e-3, image


LONG = {"alpha_x": 0.6, "alpha_y": 0.35, "turn": 0.7, "compensated": 1.0}
ROUND = {"alpha_x": 0.3, "alpha_y": 0.3, "turn": 0.0, "compensated": 0.0}
LOBES = (
    (Lobe("ggx", (0.4, 0.5, 0.6), LONG),),
    (
        Lobe("coat", (0.9, 0.8, 0.7), {"alpha": 0.4, "ior": 1.4, "cover": 0.8}),
        Lobe("ggx_dielectric", (0.05,) * 3, {**ROUND, "ior": 1.6}, covered=(0.2,) * 3),
    ),
    (
        Lobe("ggx_metal", (0.9, 0.6, 0.2), {**LONG, "tint": (0.8, 0.9, 0.5)}),
        Lobe("ggx", (0.1,) * 3, ROUND),
    ),
)
# Of kinds that GLSL alone knows, one beside another of microfacets.
OTHERS = (
    (Lobe("sheen", (0.5, 0.6, 0.7), {"roughness": 0.5}),),
    (LOBES[0][0], Lobe("velvet", (0.3,) * 3, {"sigma": 0.6})),
)
TURNED = Instruction(
    "normal_map", ((0.8, 0.4, 0.9, 1.0), *[(0.0,) * 4] * 2, (0.4,) * 4, (2.0, 0.0, 0.0, 0.0))
)


@pytest.mark.thorough("False", "2_0")
@pytest.mark.parametrize("bent", [False, True])
@pytest.mark.parametrize("lobes", [(), *LOBES], ids=len)
def test_gather_with_lobes(device: Device, lobes: tuple[Lobe, ...], bent: bool) -> None:
    """By microfacets, also of which some rays are sent, and about normals that nodes bend."""
    program = {"program": (TURNED,), "varying": {"normal": Result(0)}} if bent else {}
    white = Material("white", (0.3,) * 3, lobes, **program)
    scene = replace(cornell(), materials=(white, *cornell().materials[1:]))
    assert_gathered_alike(device, scene, NativePhotonGrid)


@pytest.mark.thorough("2")
@pytest.mark.parametrize("lobes", OTHERS, ids=len)
def test_gather_with_other_lobes(device: Device, lobes: tuple[Lobe, ...]) -> None:
    """The native core gathers with the lobes it knows, GLSL where a point has another."""
    white, red, *rest = cornell().materials
    other, known = replace(white, lobes=lobes), replace(red, lobes=LOBES[1])
    scene = replace(cornell(), materials=(other, known, *rest))
    assert_gathered_alike(device, scene, MixedPhotonGrid)


@pytest.mark.parametrize("roughness", [0.2, float(np.float32(0.4))])
def test_other_lobes_that_gather_nothing(device: Device, roughness: float) -> None:
    """Where a lobe that GLSL alone knows sends rays, as one just as rough as GATHERED_FROM does,
    there is nothing for GLSL to gather."""
    white, red, *rest = cornell().materials
    other = replace(white, lobes=(Lobe("sheen", (0.5, 0.6, 0.7), {"roughness": roughness}),))
    scene = replace(cornell(), materials=(other, replace(red, lobes=LOBES[1]), *rest))
    assert_gathered_alike(device, scene, NativePhotonGrid)


def assert_gathered_alike(device: Device, scene: Scene, native_grid: type) -> None:
    """The light of photons is the same with the native core and without, but for photons that meet
    an edge."""
    found = []
    for backend in ("fragment", "native"):
        settings = Settings(width=48, height=48, radius=0.8, photons=20000, backend=backend, seed=1)  # type: ignore[arg-type]
        renderer = prepare(scene, settings, device)
        grid = renderer.photons and renderer.photons.grid
        assert isinstance(grid, native_grid) == (backend == "native")
        for _ in range(2):
            renderer.render_pass()
        found.append(renderer.images())
        renderer.release()
    glsl, ours = (images["Indirect"] + images["Mirror"] for images in found)
    differ = np.abs(glsl - ours) > 1e-3 * np.maximum(glsl, glsl.mean())
    assert differ.mean() < 0.005 and abs(ours.mean() / glsl.mean() - 1) < 1e-4


def test_backend_is_named(device: Device) -> None:
    for backend in ("auto", "native", "fragment"):
        renderer = prepare(
            cornell(), Settings(width=8, height=8, photons=8, backend=backend), device
        )  # type: ignore[arg-type]
        native_expected = backend == "native" or (backend == "auto" and device.is_software)
        assert (renderer.info()["backend"] == "native") == native_expected
        renderer.release()


def test_ports_are_checked(device: Device) -> None:
    kernel = NativeTracer(device, triangles_of(Mesh.build(SCENE, frame_of(SCENE))))
    stream = Stream(device, RAY_ORIGIN, SIZE)
    with pytest.raises(StreamError, match=r"NativeTracer: streams \['direction', 'hit'\]"):
        kernel.run({"origin": stream})
    stream.release()


def triangles_of(mesh: Mesh) -> NativeTriangles:
    """Those of a mesh."""
    triangles = NativeTriangles()
    triangles.take(mesh)
    return triangles


def even(radius: float) -> Any:
    """One radius everywhere."""
    none = np.zeros((0, 4), np.float32)
    size: Any = {"photons": 1.0, "times": 1.0, "most": radius, "pixel": radius, "eye": None}
    return native.RadiusField(none, none, native.radius_grids(none)[0], **size)


class TestBindings:
    """What the native classes refuse."""

    def tracer(self) -> Any:
        return tracer_of(Mesh.build(SCENE, frame_of(SCENE)))

    def test_shapes(self) -> None:
        tracer, (origin, direction) = self.tracer(), rays()
        with pytest.raises(ValueError, match=r"direction has shape .* but origin has"):
            tracer.trace(origin, direction[:-1].copy(), False)
        with pytest.raises(ValueError, match=r"origin: expected shape \[any, any, 4\]"):
            tracer.trace(origin[0], direction, False)
        with pytest.raises(TypeError, match="origin: expected float32"):
            tracer.trace(origin.astype(float), direction, False)
        with pytest.raises(ValueError, match="nodes"):
            native.Tracer(np.zeros((0, 16), np.float32), np.zeros((0, 3, 4), np.float32))

    def test_not_finite_rays_miss(self) -> None:
        origin, direction = rays()
        origin[0], direction[1], direction[2, :, 3] = np.nan, np.inf, np.nan
        assert not self.tracer().trace(origin, direction, False)[:3].any()

    def test_photon_map(self) -> None:
        place, deposit = np.zeros((2, 5, 4), np.float32)
        grid: tuple[Any, ...] = ((-1.0, -1.0, -1.0), 0.5, (4, 4, 4))
        points = np.ones((1, 2, 4), np.float32)
        photons = native.PhotonMap(place, deposit, *grid)
        radii = even(0.1)
        streams = (points,) * 5
        assert photons.gather(streams, radii, 1.0, "cone").shape == (1, 2, 4)
        with pytest.raises(ValueError, match='filter = "box" is none of'):
            photons.gather(streams, radii, 1.0, "box")
        with pytest.raises(ValueError, match="of this map have no directions"):
            photons.gather(streams, radii, 1.0, "cone", (points, points))
        photons = native.PhotonMap(place, deposit, *grid, True)
        with pytest.raises(ValueError, match="lobes: expected 3 or 8 streams, got 2"):
            photons.gather_lobes(streams, (points,) * 2, radii, 1.0, "cone")
        with pytest.raises(ValueError, match="base: expected shape"):
            photons.gather(streams, radii, 1.0, "cone", (points, points[:, :1].copy()))
        with pytest.raises(ValueError, match="deposits has 4 rows, but places has 5"):
            native.PhotonMap(place, deposit[:4], *grid)
        place[3, 1] = np.nan
        with pytest.raises(ValueError, match=r"positions\[3, 1\] = NaN is not finite"):
            native.PhotonMap(place, deposit, *grid)

    def test_gather_sums_by_hand(self) -> None:
        """Photons within the radius, of the surface and of its side, by the tilt where it is cut;
        points that are NaN or have no normal gather nothing."""
        up = 4095 * 0.5 + 0.5
        code = np.floor(up) * 4096 + np.floor(up)  # octahedral (0, 0, 1)
        place = np.array([[0, 0, 0, 1], [0.05, 0, 0, 1], [0.2, 0, 0, 1], [0, 0, 0, 2]], np.float32)
        deposit = np.array([[1, 2, 3, code]] * 4, np.float32)
        photons = native.PhotonMap(place, deposit, (-1.0, -1.0, -1.0), 0.1, (20, 20, 20))
        points = np.zeros((1, 6, 4), np.float32)
        points[0, :, 3] = 1, 2, 0, 1, 1, 1
        points[0, 3, 0] = np.nan
        facing = np.array([[[0, 0, 1, 0]] * 6], np.float32)
        facing[0, 4:] = [[0.0] * 4, [np.nan] * 4]
        peak = 1 / (np.pi * 0.1**2)
        cuts, coverage, tilt = np.zeros_like(points), np.ones_like(points), np.zeros_like(points)
        discs, args = (cuts, coverage, tilt), (even(0.1), 1.0, "constant")
        sums = photons.gather((points, facing, *discs), *args)[0]
        np.testing.assert_allclose(sums[0, :3], 2 * peak * np.array([1, 2, 3]), rtol=1e-5)
        np.testing.assert_allclose(sums[1, :3], peak * np.array([1, 2, 3]), rtol=1e-5)
        assert not sums[2:].any()
        cuts[0, :2] = (25.0, 0.0, 0.0, 0.0), (0.0, 0.0, -30.0, 0.0)  # at x = 0.04, and behind
        sums = photons.gather((points, facing, *discs), *args)[0]
        np.testing.assert_allclose(sums[0, :3], peak * np.array([1, 2, 3]), rtol=1e-5)
        np.testing.assert_allclose(sums[1, :3], peak * np.array([1, 2, 3]), rtol=1e-5)
        assert not photons.gather((points, -facing, *discs), *args)[..., :3].any()
        cuts[0, 0] = (
            -30.0,
            0.0,
            0.0,
            0.0,
        )  # behind: the first two photons count
        coverage[0, 0] = 1.0, 1.0, 2.0, 3.0  # twice, within the inner radius thrice
        tilt[0, 0] = 10.0, 0.0, 20.0, 0.0
        sums = photons.gather((points, facing, *discs), *args)[0]
        wanted = 2 * (1 + 1.5) * peak * np.array([1, 2, 3])
        np.testing.assert_allclose(sums[0, :3], wanted, rtol=1e-5)
        np.testing.assert_allclose(sums[0, 3], 3 * (1 + 2) * 2 * peak * 2, rtol=1e-5)
        coverage[0, 0], tilt[0, 0], scale = 1.0, 0.0, 0.9 * 0.63  # of 0.63: SHRUNK
        for away, radius in ((0.2, 0.1), (0.097, 0.097), (0.06, 0.1 * np.sqrt(0.9))):
            cuts[0, 0] = -1.0 / away, 0.0, 0.0, 0.0
            radii = even(0.1 / scale)
            sums = photons.gather((points, facing, *discs), radii, scale, "constant")[0]
            wanted = 2 / (np.pi * radius**2) * np.array([1, 2, 3])
            np.testing.assert_allclose(sums[0, :3], wanted, rtol=1e-5)

    @pytest.mark.parametrize("cells", [1, 3, 9, 33])
    @pytest.mark.parametrize("count", [0, 1, 7, 8, 9, 17, 129, 1025])
    def test_gather_is_a_sum_over_all(self, count: int, cells: int) -> None:
        """However rows of cells begin and end within the groups of eight that it reads."""
        rng = np.random.default_rng(count)
        place = rng.uniform(-1, 1, (count, 4)).astype(np.float32)
        place[:1, :3], place[-1:, :3] = 1, -1  # at the grid's ends
        place[:, 3] = rng.integers(1, 3, count)
        deposit = rng.uniform(0, 1, (count, 4)).astype(np.float32)
        deposit[:, 3] = 2048 * 4096 + 2048  # octahedral, nearly (0, 0, 1)
        photons = native.PhotonMap(place, deposit, (-1.0, -1.0, -1.0), 2 / cells, (cells,) * 3)
        points = rng.uniform(-1.1, 1.1, (8, 32, 4)).astype(np.float32)
        points[..., 3] = rng.integers(0, 3, (8, 32))
        points[0, :count] = place[:32]  # the corners, too
        facing = np.broadcast_to(np.float32([0, 0, 1, 0]), points.shape).copy()
        for radius in (0.05, 0.31, 0.9):
            none = np.zeros_like(points)
            args = (points, facing, none, none + 1, none), even(radius), 1.0, "constant"
            offset = points[..., None, :3].astype(float) - place[:, :3]
            near = (offset**2).sum(-1) <= np.float32(radius) ** 2
            near &= (points[..., None, 3] == place[:, 3]) & (points[..., None, 3] > 0)
            near &= 2 * offset[..., 2] ** 2 <= (offset**2).sum(-1) + 1e-10  # within 45 degrees
            expected = near @ deposit[:, :3].astype(float) / (np.pi * radius**2)
            np.testing.assert_allclose(photons.gather(*args)[..., :3], expected, rtol=1e-4)


def test_host_and_glsl_draw_the_same_numbers(device: Device) -> None:
    """Coverage of a plate's edge depends on every probe: equal means equal numbers."""
    scene = cornell()
    pictures = []
    for backend in ("fragment", "native"):
        renderer = prepare(
            scene,
            Settings(width=48, height=48, photons=64, seed=9, backend=backend),  # type: ignore[arg-type]
            device,
        )
        renderer.render_pass()
        pictures.append(renderer.film.means()["indirect"][..., 3])
        renderer.release()
    glsl, ours = pictures
    assert (glsl > 0).mean() > 0.5
    partial = (glsl > 0.01) & (glsl < 0.65)
    assert partial.sum() > 50
    # A probe that grazes an edge may fall to either side.
    assert (np.abs(glsl - ours) > 1e-4).mean() < 0.01
