# SPDX-License-Identifier: GPL-3.0-or-later
"""Kept: only what changed is made again, and the picture is a fresh render's to the bit."""

from __future__ import annotations

import ctypes
import ctypes.util
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, NamedTuple

import moderngl
import numpy as np
import pytest

from addon.photon.errors import DeviceError
from addon.photon.kernels.eye_rays import EyeRays
from addon.photon.photons import kept as kept_module
from addon.photon.photons.deposits import DEPOSIT_BYTES, DeviceDeposits, HostDeposits
from addon.photon.photons.device_photon_mapper import DevicePhotonMapper
from addon.photon.photons.kept import Kept, Stage, same_but_view
from addon.photon.photons.mapper import PhotonBatch
from addon.photon.photons.photon_pass import Photons
from addon.photon.prepare import prepare
from addon.photon.scene import Scene, phong
from addon.photon.settings import Settings
from addon.photon.ways import way as ways
from addon.streams import Device, Kernel, StreamError
from tests.scenes import backdrop, cornell, plain_light, plain_material, with_cone

# What few photons tell of where others shall start is asked for each view anew.
pytestmark = pytest.mark.usefixtures("not_aimed")
SETTINGS = Settings(width=16, height=12, passes=2, photons=1500, photon_bounces=3)
ALL = SETTINGS.passes  # the first one finds the radii, too
WAYS = [
    ("native", "gather", True),
    ("fragment", "splat", True),
    ("compute", "gather", False),  # as on a GPU: the deposits stay on the device
    ("compute", "splat", False),
]


class Frame(NamedTuple):
    """What a render gave."""

    traced: int  # passes of photons
    images: dict[str, bytes]
    info: dict[str, Any]  # but the time


def render(
    device: Device, scene: Scene, settings: Settings = SETTINGS, kept: Kept | None = None
) -> Frame:
    renderer = prepare(scene, settings, device, kept)
    try:
        for _ in range(settings.passes):
            renderer.render_pass()
        images = {name: image.tobytes() for name, image in renderer.images().items()}
        info = {name: value for name, value in renderer.info().items() if name != "seconds"}
        # A pass begins with the one or the other, kernel by kernel or natively.
        launches = renderer.launches()
        traced = launches.get("generator", 0) + launches.get("photons", 0)
        return Frame(traced, images, info)
    finally:
        renderer.release()


@pytest.fixture
def kept(device: Device) -> Iterator[Kept]:
    made = Kept(device)
    yield made
    made.release()


def moved(scene: Scene, by: float) -> Scene:
    """The camera goes along the room."""
    matrix = scene.camera.matrix.copy()
    matrix[0, 3] += by
    return replace(scene, camera=replace(scene.camera, matrix=matrix))


def relit(scene: Scene, **changes: Any) -> Scene:
    """The light is another."""
    return replace(scene, lights=(replace(scene.lights[0], **changes),))


def repainted(scene: Scene, **changes: Any) -> Scene:
    """The first material is another."""
    return replace(scene, materials=(replace(scene.materials[0], **changes), *scene.materials[1:]))


def pushed(scene: Scene, by: float) -> Scene:
    """The last object, the sphere, lies elsewhere."""
    vertices = scene.vertices.copy()
    vertices[np.unique(scene.triangles[scene.surface == scene.surface.max()])] += (0.0, by, 0.0)
    return replace(scene, vertices=vertices)


def widened(scene: Scene, radius: float) -> Scene:
    """The light is a sphere."""
    return relit(scene, parameters=dict(scene.lights[0].parameters) | {"radius": radius})


def tilted(scene: Scene, by: float) -> Scene:
    """The shading normals are others."""
    normals = scene.corner_normals + np.float32([by, 0.0, 0.0])
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    return replace(scene, corner_normals=normals)


SceneStep = tuple[str, Callable[[Scene], Scene], bool]  # what changes, and whether photons do
SCENE_STEPS: list[SceneStep] = [
    ("nothing", lambda s: s, False),
    ("camera", lambda s: moved(s, 0.7), False),
    ("lens", lambda s: replace(s, camera=replace(s.camera, window=(-0.5, 0.4, -0.3, 0.3))), False),
    ("a world", lambda s: replace(s, lights=(*s.lights, *backdrop((0.1, 0.2, 0.3)))), True),
    ("light's place", lambda s: relit(s, position=(4.0, 5.0, 9.9)), True),
    ("camera again", lambda s: moved(s, -0.2), False),
    ("light's power", lambda s: relit(s, power=(3000.0, 2000.0, 3000.0)), True),
    ("light's cone", lambda s: replace(s, lights=(with_cone(s.lights[0], 1.5),)), True),
    ("object", lambda s: pushed(s, 0.5), True),
    ("camera once more", lambda s: moved(s, 0.3), False),
    ("material", lambda s: repainted(s, diffuse=(0.5, 0.6, 0.7)), True),
    ("gloss", lambda s: repainted(s, lobes=(phong((0.2, 0.2, 0.2), 30.0),)), True),
    ("normals", lambda s: tilted(s, 0.3), True),
    ("assignment", lambda s: replace(s, material=s.material[::-1].copy()), True),
    ("nothing more", lambda s: s, False),
]
# Of those, where deposits stay on the device: one of each kind of what is kept.
FEW_STEPS = {"nothing", "camera", "a world", "camera again", "object", "material", "nothing more"}
SETTING_STEPS: list[tuple[dict[str, Any], int]] = [  # changes, and passes of photons they take
    ({"width": 12, "height": 16}, 0),
    ({"region": (2, 3, 7, 9)}, 0),
    ({"radius": 0.5}, 0),
    ({"radius_decay": 1.0, "filter": "cone", "boundary_correction": False}, 0),
    ({"mirror_depth": 1, "transparent": True}, 0),
    ({"passes": 4}, 2),
    ({"first_pass": 3}, 1),
    ({"seed": 1}, ALL),
    ({"photons": 3000}, ALL),
    ({"photons": None}, ALL),
    ({"photons": None, "width": 80, "height": 60}, ALL),  # more pixels, so more photons
    ({"photons": None, "width": 60, "height": 80}, 0),
    ({"photon_bounces": 1}, ALL),
    ({"direct_by_photons": True}, ALL),
    ({}, ALL),
]
FEW_SETTINGS = ("region", "passes", "first_pass", "seed", "photons")  # likewise


@pytest.mark.thorough("compute-splat")
@pytest.mark.parametrize(("backend", "estimator", "on_host"), WAYS)
def test_scene_changes(
    device: Device,
    kept: Kept,
    monkeypatch: pytest.MonkeyPatch,
    backend: Any,
    estimator: Any,
    on_host: bool,
    thorough: bool,
) -> None:
    """One change after the other: photons are traced for those that they meet, and no others."""
    if backend == "compute" and not device.has_compute:
        pytest.skip(f"{device.name} has no compute programs")
    monkeypatch.setattr(device, "prefers_native", on_host)
    settings = replace(SETTINGS, backend=backend, estimator=estimator)
    scene = cornell(mirror=True)
    assert render(device, scene, settings, kept).traced == ALL
    pictures = [b""]
    for name, change, retraced in SCENE_STEPS:
        if not (on_host or thorough or name in FEW_STEPS):
            continue
        scene = change(scene)
        frame, fresh = render(device, scene, settings, kept), render(device, scene, settings)
        assert frame.traced == (ALL if retraced else 0), name
        assert fresh.traced == ALL
        assert frame.images == fresh.images, name
        assert frame.info == fresh.info and frame.info["unfinished_photons"] > 0, name
        assert (frame.images["Combined"] == pictures[-1]) == (name == "nothing more"), name
        pictures.append(frame.images["Combined"])


@pytest.fixture
def on_device(device: Device, monkeypatch: pytest.MonkeyPatch) -> Settings:
    """Settings of a render whose lists stay on the device, as on GPUs."""
    if not device.has_compute:
        pytest.skip(f"{device.name} has no compute programs")
    monkeypatch.setattr(device, "prefers_native", False)
    return replace(SETTINGS, backend="compute", passes=3)


def test_the_next_photons_fly_while_the_host_waits(
    device: Device, on_device: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    """For the rays of mirrors, in each pass but the last, behind which there is none."""
    events: list[str] = []
    start, counted = DevicePhotonMapper.start, Kernel._counted

    def watched_start(mapper: DevicePhotonMapper, batch: PhotonBatch) -> None:
        events.append(f"photons {batch.index}")
        start(mapper, batch)

    def watched_wait(kernel: Kernel, reading: Any) -> int:
        events.append("wait")
        return counted(kernel, reading)

    monkeypatch.setattr(DevicePhotonMapper, "start", watched_start)
    monkeypatch.setattr(Kernel, "_counted", watched_wait)
    renderer = prepare(cornell(mirror=True), on_device, device)
    for index in range(on_device.passes):
        renderer.render_pass()
        events.append(f"pass {index}")
    renderer.release()
    in_passes = " ".join(events).split(" pass ")
    assert in_passes[0].startswith("photons 0 photons 1 wait")
    assert in_passes[1].startswith("0 photons 2 wait")
    assert in_passes[2].startswith("1 wait") and "photons" not in in_passes[2]


@pytest.mark.parametrize("estimator", ["gather", "splat"])
def test_early_photons_change_nothing(
    device: Device, on_device: Settings, monkeypatch: pytest.MonkeyPatch, estimator: Any
) -> None:
    """Strips go on reading this pass's."""
    settings = replace(on_device, estimator=estimator, first_pass=2)
    pictures = []
    for is_early, pixels in ((False, 1 << 20), (True, 1 << 20), (True, 5 * SETTINGS.width)):
        with monkeypatch.context() as patch:
            if not is_early:
                patch.setattr(Photons, "prefetch", lambda *_: None)
            for name in ("STRIP_PIXELS", "GPU_STRIP_PIXELS"):
                patch.setattr(ways, name, pixels)
            pictures.append(render(device, cornell(mirror=True), settings).images)
    assert pictures[0] == pictures[1] == pictures[2]


def test_eye_rays_go_before_the_host_waits(
    device: Device, on_device: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    """For the photons that tell the radii; the first pass sends no others."""
    events: list[str] = []
    for kind, name in ((EyeRays, "run"), (DevicePhotonMapper, "finish")):
        monkeypatch.setattr(kind, name, watched(getattr(kind, name), events))
    renderer = prepare(cornell(), on_device, device)
    assert events == ["run", "finish"]
    renderer.render_pass()
    assert events == ["run", "finish"]
    renderer.render_pass()
    assert events[2:] == ["run", "finish"]
    renderer.release()


def watched(function: Any, events: list[str]) -> Any:
    """Lists its calls."""

    def run(*arguments: Any, **named: Any) -> Any:
        events.append(function.__name__)
        return function(*arguments, **named)

    return run


def test_a_pass_that_failed_is_begun_anew(
    device: Device, on_device: Settings, monkeypatch: pytest.MonkeyPatch
) -> None:
    """There was no room for its photons, and then there was."""
    fresh = render(device, cornell(), on_device)

    def refuse(*_: Any) -> None:
        raise StreamError("no room")

    renderer = prepare(cornell(), on_device, device)
    renderer.render_pass()
    with monkeypatch.context() as patch:
        patch.setattr(DeviceDeposits, "make_room", refuse)
        with pytest.raises(DeviceError, match="no room"):
            renderer.render_pass()
    while renderer.film.passes < on_device.passes:
        renderer.render_pass()
    images = {name: image.tobytes() for name, image in renderer.images().items()}
    renderer.release()
    assert images == fresh.images


@pytest.mark.parametrize("passes", [1, 2])
def test_a_render_that_was_stopped(
    device: Device, kept: Kept, on_device: Settings, passes: int
) -> None:
    """Its next photons were on their way: nothing of them is in what is told and in the next."""
    scene = cornell(mirror=True)
    fresh = render(device, scene, on_device)
    told = render(device, scene, replace(on_device, passes=passes)).info
    stopped = prepare(scene, on_device, device, kept)
    for _ in range(passes):
        stopped.render_pass()
    info = stopped.info()
    assert {name: info[name] for name in told if name != "error"} == {
        name: told[name] for name in told if name != "error"
    }
    stopped.release()
    again = render(device, moved(scene, 0.0), on_device, kept)
    assert again.images == fresh.images and again.info == fresh.info
    assert again.traced == on_device.passes - passes


@pytest.mark.parametrize("on_host", [True, False])
def test_settings_changes(
    device: Device, kept: Kept, monkeypatch: pytest.MonkeyPatch, on_host: bool, thorough: bool
) -> None:
    if not on_host and not device.has_compute:
        pytest.skip(f"{device.name} has no compute programs")
    monkeypatch.setattr(device, "prefers_native", on_host)
    base = SETTINGS if on_host else replace(SETTINGS, backend="compute")
    scene = cornell(mirror=True, lobe=True)
    render(device, scene, base, kept)
    for changes, traced in SETTING_STEPS:
        if not (on_host or thorough or next(iter(changes), "photons") in FEW_SETTINGS):
            continue
        settings = replace(base, **changes)
        frame, fresh = render(device, scene, settings, kept), render(device, scene, settings)
        assert frame.traced == traced, changes
        assert frame.images == fresh.images and frame.info == fresh.info, changes


def test_layers_keep_their_own(device: Device, kept: Kept) -> None:
    """On GPUs their photons differ by rounding."""
    for backend in ("native", "fragment", "native"):
        settings = replace(SETTINGS, backend=backend)  # type: ignore[arg-type]
        frame = render(device, cornell(), settings, kept)
        assert frame.traced == ALL
        assert frame.images == render(device, cornell(), settings).images


def test_animation_traces_photons_once(device: Device, kept: Kept) -> None:
    """24 frames with a still light; then the light moves."""
    settings = replace(SETTINGS, backend="fragment")
    launches: list[dict[str, int]] = []
    for frame in range(25):
        scene = moved(cornell(), 0.05 * frame)
        renderer = prepare(scene if frame < 24 else widened(scene, 0.1), settings, device, kept)
        for _ in range(settings.passes):
            renderer.render_pass()
        launches.append(renderer.launches())
        renderer.release()
    for stem in ("generator", "projector", "reflector"):
        assert launches[0][stem] == launches[24][stem] > 0
        assert [counts[stem] for counts in launches[1:24]] == [0] * 23
    assert launches[0]["generator"] == ALL
    # Eye rays are traced in every frame.
    assert all(counts["tracer"] == settings.passes for counts in launches[1:24])


def test_dropped_photons_are_counted_again(
    device: Device, kept: Kept, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Deposits that are not finite fall out once, and show in each render's account."""
    append = HostDeposits.append

    def spoil(self: HostDeposits, place: Any, deposit: Any, *more: Any) -> None:
        fluxes = deposit.download()
        y, x = np.argwhere(place.download()[..., 3] != 0)[10]
        fluxes[y, x, 1] = np.nan
        deposit.upload(fluxes)
        append(self, place, deposit, *more)

    settings = replace(SETTINGS, backend="fragment")
    monkeypatch.setattr(HostDeposits, "append", spoil)
    frames = [render(device, moved(cornell(), x), settings, kept) for x in (0.0, 0.0, 1.0)]
    assert [frame.traced for frame in frames] == [ALL, 0, 0]
    dropped = {frame.info["dropped_photons"] for frame in frames}
    assert len(dropped) == 1 and dropped.pop() >= SETTINGS.passes


# Memory.


@pytest.mark.thorough("compute-gather-False-scene0", "compute-splat-False-scene0")
@pytest.mark.parametrize("scene", [cornell(), cornell(True)])
@pytest.mark.parametrize(("backend", "estimator", "on_host"), WAYS)
def test_textures_put_back(
    device: Device,
    monkeypatch: pytest.MonkeyPatch,
    backend: Any,
    estimator: Any,
    on_host: bool,
    scene: Scene,
) -> None:
    """A render finds those of the last one, as on GPUs, and whatever they hold is nothing to it."""
    monkeypatch.setattr(device, "prefers_native", on_host)
    settings = replace(SETTINGS, backend=backend, estimator=estimator)
    fresh = render(device, scene, settings)
    put_back, made = device.put_back, 0

    def spoil(item: moderngl.Texture | moderngl.Buffer) -> None:
        if isinstance(item, moderngl.Buffer):
            item.write(np.full(item.size // 4, np.nan, np.float32))
        else:
            kind = np.float32 if item.dtype == "f4" else np.uint32
            value = np.nan if item.dtype == "f4" else 0xFFFFFFFF
            item.write(np.full((item.height, item.width, item.components), value, kind))
        put_back(item)

    def count(*arguments: Any) -> Any:
        nonlocal made
        made += 1
        return texture(*arguments)

    monkeypatch.setattr(device, "reuses", True)
    monkeypatch.setattr(device, "put_back", spoil)
    try:
        first = render(device, scene, settings)
        texture = device._new_texture
        monkeypatch.setattr(device, "_new_texture", count)
        again = render(device, scene, settings)
        assert first.images == again.images == fresh.images
        few = made  # what is uploaded anew in each pass, if anything is
        device.drop_spare()
        assert render(device, scene, settings).images == fresh.images
        assert made - few > 20 + few
    finally:
        device.drop_spare()


def test_no_room_beside_what_was_put_back(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """It goes first, and then what is kept: a texture that the driver has no room for at once."""
    monkeypatch.setattr(device, "reuses", True)
    device.put_back(device.texture((8, 8), 4))
    real, asked = device.ctx, []

    class Full:
        """Refuses while anything is put back."""

        error = property(lambda self: self.refused.pop() if self.refused else real.error)

        def __init__(self) -> None:
            self.refused: list[str] = []

        def texture(self, *arguments: Any, **named: Any) -> Any:
            asked.append(arguments[0])
            if any(device._spare.values()):
                self.refused.append("GL_OUT_OF_MEMORY")
            return real.texture(*arguments, **named)

        def __getattr__(self, name: str) -> Any:
            return getattr(real, name)

    monkeypatch.setattr(device, "ctx", Full())
    device.free(device.texture((16, 8), 4))
    assert asked == [(16, 8)] * 2 and not any(device._spare.values())


def test_deposits_without_room(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """What was put back for longer lists is put back once."""
    monkeypatch.setattr(device, "reuses", True)
    deposits = DeviceDeposits(device)

    def refuse(*_: Any) -> None:
        raise StreamError("no room")

    with monkeypatch.context() as patch:
        patch.setattr(device, "_new_texture", refuse)
        with pytest.raises(StreamError):
            deposits.make_room(1 << 20)
    deposits.release()
    textures = [device.texture((4096, 1), 4) for _ in range(4)]
    assert len({texture.glo for texture in textures}) == 4
    for texture in textures:
        device.free(texture)
    device.drop_spare()


def test_budget(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    """What goes beyond it is traced again: never less, never other pictures."""
    everything, none = Kept(device), Kept(device, budget=0)
    scene = cornell()
    fresh = render(device, scene, kept=everything)
    whole = everything.photon_bytes
    sizes = [kept.deposits.bytes for kept in everything._passes.values()]
    assert whole == sum(sizes) and all(size % DEPOSIT_BYTES == 0 for size in sizes)
    some = Kept(device, budget=sizes[0] + DEPOSIT_BYTES)
    for kept, expected in ((everything, [0, 0]), (some, [ALL, 1]), (none, [ALL, ALL])):
        frames = [render(device, scene, kept=kept) for _ in range(2)]
        assert [frame.traced for frame in frames] == expected
        assert all(frame.images == fresh.images for frame in frames)
    assert (some.photon_bytes, none.photon_bytes) == (sizes[0], 0)
    for kept in (everything, some, none):
        kept.release()
        assert kept.photon_bytes == 0


def living(device: Device) -> dict[str, int]:
    """How many objects of each kind OpenGL holds for the device."""
    ctx, library = device.ctx, ctypes.util.find_library("EGL")
    find = ctypes.CDLL(library).eglGetProcAddress
    find.restype, find.argtypes = ctypes.c_void_p, [ctypes.c_char_p]
    texture, buffer = ctx.texture((1, 1), 4), ctx.buffer(reserve=4)
    framebuffer = ctx.framebuffer([texture])
    program = ctx.program(vertex_shader="#version 330 core\nvoid main() { gl_Position = vec4(0); }")
    made = {
        "VertexArray": ctx.vertex_array(program, []),
        "Program": program,
        "Framebuffer": framebuffer,
        "Texture": texture,
        "Buffer": buffer,
    }
    counts = {}
    for kind, item in made.items():
        lives = ctypes.CFUNCTYPE(ctypes.c_ubyte, ctypes.c_uint)(find(f"glIs{kind}".encode()))
        counts[kind] = sum(lives(name) for name in range(1, max(1 << 13, item.glo + 1)))
    for item in made.values():
        item.release()
    return counts


@pytest.fixture(params=WAYS, ids=lambda way: "-".join(map(str, way)))
def way(
    request: pytest.FixtureRequest, device: Device, monkeypatch: pytest.MonkeyPatch
) -> Settings:
    """Settings of each of WAYS."""
    backend, estimator, on_host = request.param
    if backend == "compute" and not device.has_compute:
        pytest.skip(f"{device.name} has no compute programs")
    monkeypatch.setattr(device, "prefers_native", on_host)
    return replace(SETTINGS, backend=backend, estimator=estimator)


@pytest.fixture(params=[moved, lambda s, x: widened(s, x)], ids=["eye", "light"])
def frames(request: pytest.FixtureRequest, device: Device, kept: Kept, way: Settings) -> Any:
    """Renders so many frames in which that changes, one each time it is asked."""

    def rendered(count: int) -> Iterator[None]:
        for frame in range(count):
            render(device, request.param(cornell(mirror=True), 0.02 * (frame + 1)), way, kept)
            yield

    return rendered


@pytest.mark.thorough("eye-compute-gather", "light-compute-splat")
def test_spare_streams_do_not_add_up(
    device: Device, monkeypatch: pytest.MonkeyPatch, frames: Any
) -> None:
    """As GPUs render animations: what is put back serves the next frame."""
    monkeypatch.setattr(device, "reuses", True)
    spare = [sum(map(len, device._spare.values())) for _ in frames(8)]
    device.drop_spare()
    assert max(spare[4:]) <= max(spare[:4]) + 2 and spare[-1] > 0


@pytest.mark.thorough("compute-gather-False-eye", "compute-splat-False-light")
@pytest.mark.skipif(sys.platform != "linux", reason="asks OpenGL through EGL")
def test_animations_hold_no_more_from_frame_to_frame(
    device: Device, kept: Kept, monkeypatch: pytest.MonkeyPatch, way: Settings, frames: Any
) -> None:
    monkeypatch.setattr(device, "reuses", False)  # what is put back is freed
    device.drop_spare()
    device._release_framebuffers()  # a cache with a limit of its own
    before = living(device)
    counts, sizes = [], []
    for _ in frames(6):
        device._release_framebuffers()
        counts.append(living(device))
        sizes.append(kept.photon_bytes)
    print(f"OpenGL holds {counts[0]}, {sizes[0]} bytes of deposits")
    assert counts[1:] == [counts[0]] * 5
    tables = 5 if way.backend == "native" else 6  # the stage's, with the tree
    assert counts[0]["Texture"] - before["Texture"] == tables
    assert max(sizes) <= 1.1 * sizes[0]
    kept.release()
    after = living(device)
    assert after | {"Program": 0} == before | {"Program": 0}


def test_what_was_kept_goes_before_the_next_is_built(
    device: Device, kept: Kept, monkeypatch: pytest.MonkeyPatch
) -> None:
    build, seen = Stage.build, []
    monkeypatch.setattr(device, "reuses", False)  # nor is put back, as on GPUs

    def spy(device: Device, scene: Scene, layer: str, *rest: Any) -> Stage:
        seen.append([isinstance(t.mglo, moderngl.InvalidObject) for t in textures])
        assert kept.photon_bytes == 0
        made = build(device, scene, layer, *rest)
        textures[:] = made.tables.textures.values()
        return made

    textures: list[moderngl.Texture] = []
    monkeypatch.setattr(kept_module.Stage, "build", staticmethod(spy))
    for scene in (cornell(), widened(cornell(), 0.1)):
        render(device, scene, kept=kept)
        assert kept.photon_bytes > 0
    assert seen[0] == [] and seen[1] and all(seen[1])


# What is equal.


def test_same_but_view() -> None:
    scene = cornell()
    other = cornell()
    assert same_but_view(scene, other)
    for name, change, retraced in SCENE_STEPS:
        assert same_but_view(scene, change(other)) != retraced, name
    nan = scene.vertices.copy()
    nan[0] = np.nan
    assert same_but_view(replace(scene, vertices=nan), replace(scene, vertices=nan.copy()))
    assert not same_but_view(replace(scene, vertices=nan), scene)
    assert not same_but_view(scene, replace(scene, surfaces=(*scene.surfaces, "more")))
    assert not same_but_view(scene, replace(scene, lights=()))
    assert not same_but_view(scene, replace(scene, triangles=scene.triangles[:-1]))


@pytest.mark.parametrize("where", ["light", "material", "vertex", "parameter"])
def test_zeros_have_signs(where: str) -> None:
    """-0.0 == 0.0, but a frame about an axis (0, 0, -0.0) is another."""

    def scene(zero: float) -> Scene:
        signed = dict.fromkeys(("light", "material", "vertex", "parameter"), 0.0) | {where: zero}
        made = cornell()
        vertices = made.vertices.copy()
        vertices[0] = signed["vertex"]
        light = plain_light("l", "SPOT", (0, 0, 0), (1, 1, 1), (1.0, 0.0, signed["light"]))
        light = replace(light, parameters={**light.parameters, "radius": signed["parameter"]})
        material = plain_material("m", (0.5, signed["material"], 0.5))
        return replace(
            made, vertices=vertices, lights=(light,), materials=(material, *made.materials)
        )

    assert scene(0.0).lights == scene(-0.0).lights and scene(0.0).materials == scene(-0.0).materials
    assert same_but_view(scene(-0.0), scene(-0.0))
    assert not same_but_view(scene(0.0), scene(-0.0))
