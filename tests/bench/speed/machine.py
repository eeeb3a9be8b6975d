# SPDX-License-Identifier: GPL-3.0-or-later
"""What the machine itself can do, measured in the same run: copies, rays, and what starts once."""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np
import photon_stream_native as native
from numpy.typing import NDArray

from addon.photon.backends.backend import open_device
from addon.photon.jobs.process import RendererProcess
from addon.photon.kernels.records import HIT, RAY_DIRECTION, RAY_ORIGIN
from addon.photon.kernels.tracer import Tracer
from addon.photon.prepare import prepare
from addon.photon.scene import Camera, Scene
from addon.photon.settings import Settings
from addon.photon.stage.geometry import Mesh, frame_of
from addon.photon.stage.tables import Tables
from addon.streams import TEXEL, Device, Stream
from tests.scenes import corners_of, plain_material

from ..host import CORES, resident
from .launches import Timer

ROOT = Path(__file__).resolve().parents[3]
RAYS = 1 << 20
_REPEATS = 5
# Of work on a GPU before any is timed: an idle one ticks slowly.
WARM_UP = 0.5  # [s]
_FAR = 1.0e30


def median_seconds(run: Callable[[], Any], repeats: int = _REPEATS) -> float:
    """Of a few runs, after one to warm up."""
    run()
    seconds = []
    for _ in range(repeats):
        start = time.perf_counter()
        run()
        seconds.append(time.perf_counter() - start)
    return statistics.median(seconds)


def device_copies(timer: Timer) -> dict[str, float]:
    """[B/s] read and written: a buffer's and a texture's copy on the device, and to and from it."""
    device = timer.device
    ctx, software = device.ctx, device.is_software
    side = 1024 if software else 4096
    size = side * side * 16
    source, target = ctx.buffer(reserve=size), ctx.buffer(reserve=size)
    streams = Stream(device, TEXEL, (side, side)), Stream(device, TEXEL, (side, side))
    data = np.ones((side, side, 4), np.float32)
    streams[0].upload(data)
    frames = [device.framebuffer([stream.texture]) for stream in streams]

    def seconds(copy: Callable[[], Any], on_device: bool = True) -> float:
        def waited() -> None:
            copy()
            ctx.finish()

        if software or not on_device:
            return median_seconds(waited)
        waited()
        spent = []
        for number in range(_REPEATS):
            query = timer.query(number)
            with query:
                copy()
            spent.append(query.elapsed * 1e-9)
        return statistics.median(spent)

    speeds = {
        "device, buffer": 2 * size / seconds(lambda: ctx.copy_buffer(target, source)),
        "device, texture": 2 * size / seconds(lambda: ctx.copy_framebuffer(frames[1], frames[0])),
        "host to device": size / seconds(lambda: streams[0].upload(data), False),
        "device to host": size / seconds(lambda: streams[0].texture.read_into(data), False),
    }
    for item in (*streams, source, target):
        item.release()
    return speeds


def host_copy(threads: int) -> float:
    """[B/s] read and written by numpy's copies on so many threads."""
    size = 1 << 27  # [B] more than caches hold
    ones = np.ones(size // 4, np.float32)
    pairs = [(ones.copy(), ones.copy()) for _ in range(threads)]
    with ThreadPoolExecutor(threads) as pool:
        seconds = median_seconds(lambda: list(pool.map(lambda p: np.copyto(*p), pairs)))
    return 2 * size * threads / seconds


def bumpy_sphere(rows: int = 400) -> Scene:
    """A closed surface of 2 rows^2 triangles, seen from within."""
    v, u = np.meshgrid(*2 * [np.arange(rows + 1) / rows], indexing="ij")
    radius = 1.0 + 0.05 * np.sin(40 * np.pi * u) * np.sin(20 * np.pi * v)
    around, down = 2 * np.pi * u, np.pi * v
    points = radius[..., None] * np.stack(
        [np.cos(around) * np.sin(down), np.sin(around) * np.sin(down), np.cos(down)], axis=-1
    )
    at = np.arange((rows + 1) ** 2).reshape(rows + 1, rows + 1)
    a, b, c, d = at[:-1, :-1], at[:-1, 1:], at[1:, 1:], at[1:, :-1]
    triangles = np.concatenate(
        [np.stack(corners, -1).reshape(-1, 3) for corners in ((a, b, c), (a, c, d))]
    ).astype(np.int32)
    count = len(triangles)
    return Scene(
        vertices=points.reshape(-1, 3),
        triangles=triangles,
        corner_normals=np.zeros((count, 3, 3), np.float32),
        material=np.zeros(count, np.int32),
        surface=np.zeros(count, np.int32),
        camera=Camera("PERSP", np.eye(4), (-1.0, 1.0, -1.0, 1.0)),
        materials=(plain_material("grey", (0.5, 0.5, 0.5)),),
        surfaces=("sphere",),
    )


def room_with_spheres(rows: int) -> Scene:
    """A cube and two round balls in it, of 4 rows^2 triangles."""
    ball = bumpy_sphere(rows)
    unit = ball.vertices / np.linalg.norm(ball.vertices, axis=1, keepdims=True)
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    box = np.array([t for a, b, c, d in sides for t in ((a, b, c), (a, c, d))])
    parts = [unit * 0.3 + (-0.4, -0.2, -0.6), unit * 0.35 + (0.4, 0.3, -0.6), corners]
    triangles = [ball.triangles, ball.triangles + len(unit), box + 2 * len(unit)]
    count = sum(map(len, triangles))
    return replace(
        ball,
        vertices=np.concatenate(parts),
        triangles=np.concatenate(triangles).astype(np.int32),
        corner_normals=np.zeros((count, 3, 3), np.float32),
        material=np.zeros(count, np.int32),
        surface=np.zeros(count, np.int32),
    )


def wall_rays(count: int) -> Any:
    """Rays that leave the walls of `room_with_spheres` by the cosine, as photons do after a bounce:
    origins and directions, (count, 3) each."""
    random, every = np.random.default_rng(1), np.arange(count)
    axis, side = random.integers(0, 3, count), random.choice([-1.0, 1.0], count)
    origins, directions = random.uniform(-1, 1, (count, 3)), random.normal(size=(count, 3))
    origins[every, axis] = 0.9999 * side
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    directions[every, axis] -= 1.0001 * side
    return origins.astype(np.float32), directions.astype(np.float32)


def as_streams(rays: Any) -> list[NDArray[np.float32]]:
    """Origins and directions, (count, 3) each, as the tracer takes them: rows of 1024."""
    return [
        np.concatenate([part, np.full((len(part), 1), fourth, np.float32)], 1).reshape(-1, 1024, 4)
        for part, fourth in zip(rays, (-1.0, _FAR), strict=True)
    ]


def device_rays(timer: Timer, scene: Scene, mesh: Mesh) -> float:
    """Closest hits a second of the tracer's kernel for `wall_rays`."""
    device = timer.device
    layer = device.choose_layer("auto")
    count = 1 << (17 if device.is_software else 23)
    tables = Tables.upload(device, layer, scene, frame_of(scene), mesh)
    kernel = Tracer(device, layer)
    size = (1024, count // 1024)
    streams = {
        name: Stream(device, record, size)
        for name, record in (("origin", RAY_ORIGIN), ("direction", RAY_DIRECTION), ("hit", HIT))
    }
    for name, texels in zip(("origin", "direction"), as_streams(wall_rays(count)), strict=True):
        streams[name].upload(texels)

    def run() -> None:
        kernel.run(streams, tables.of(kernel))
        device.ctx.finish()

    warmed = time.perf_counter() + (0.0 if device.is_software else WARM_UP)
    while time.perf_counter() < warmed:
        run()
    seconds = median_seconds(run, 15)
    for item in (*streams.values(), tables, kernel):
        item.release()
    return count / seconds


def build_bvh(scene: Scene) -> tuple[float, Mesh]:
    """[s] of building tables and BVH, and what was built."""
    frame = frame_of(scene)
    return median_seconds(lambda: Mesh.build(scene, frame)), Mesh.build(scene, frame)


def incoherent_rays(corners: NDArray[np.float32], count: int = RAYS) -> Any:
    """Origins between random surface points and uniform directions, (count, 3) each."""
    random = np.random.default_rng(0)
    weights = random.dirichlet(np.ones(3), (2, count))
    triangles = random.integers(len(corners), size=(2, count))
    ends = np.einsum("erk,erkc->erc", weights, corners[triangles][..., :3].astype(np.float64))
    share = random.random((count, 1))
    directions = random.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    origins = ends[0] + share * (ends[1] - ends[0])
    return origins.astype(np.float32), directions.astype(np.float32)


def native_rays(mesh: Mesh, rays: Any) -> float:
    """Closest hits a second of the native core, all cores; `rays`: RAYS origins and directions."""
    origin, direction = as_streams(rays)
    tracer = native.Tracer(mesh.tree.nodes, corners_of(mesh))
    return RAYS / median_seconds(lambda: tracer.trace(origin, direction, False))


def embree_rays(mesh: Mesh) -> float | str:
    """The same rays by Embree through PyPI's embreex, a thread a core; or why not."""
    try:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene
    except ImportError as error:
        return f"not here: {error}"
    scene = EmbreeScene()
    TriangleMesh(scene, np.ascontiguousarray(corners_of(mesh)[..., :3]))
    rays = list(
        zip(*(np.array_split(x, CORES) for x in incoherent_rays(corners_of(mesh))), strict=True)
    )
    with ThreadPoolExecutor(CORES) as pool:
        seconds = median_seconds(
            lambda: list(pool.map(lambda r: scene.run(*r, query="INTERSECT"), rays)), 3
        )
    return RAYS / seconds


def process_start(scene: Scene) -> tuple[float, float]:
    """[s] from asking the renderer process for a picture of 64x64 px to having it: the first time,
    which starts the process, and the next."""
    process = RendererProcess()
    seconds = []
    try:
        for _ in range(2):
            start = time.perf_counter()
            for _progress in process.render(scene, Settings(64, 64, passes=1), previews=False):
                pass
            seconds.append(time.perf_counter() - start)
    finally:
        process.close()
    return seconds[0], seconds[1]


def peak_memory(scene: Scene, settings: Settings) -> tuple[int, int]:
    """[B] that a process holds at most to render one pass, and what it held before the renderer."""
    with tempfile.TemporaryDirectory() as folder:
        snapshot = Path(folder) / "scene.npz"
        scene.save(snapshot)
        code = f"from {__name__} import _render; _render({str(snapshot)!r}, {asdict(settings)!r})"
        command = [sys.executable, "-c", code]
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True)
    before, peak = map(int, done.stdout.split())
    return peak, before


def _render(snapshot: str, values: dict[str, Any]) -> None:
    """Print the peak of this process's memory before and after a pass."""
    settings = Settings(**values)
    device, scene = open_device(settings), Scene.load(Path(snapshot))
    before = resident("VmHWM")
    renderer = prepare(scene, settings, device)
    renderer.render_pass()
    renderer.images()
    print(before, resident("VmHWM"))


def describe(device: Device) -> str:
    """The OpenGL device."""
    kind = "software" if device.is_software else "GPU"
    return f"{device.name}, OpenGL {device.version} ({kind})"
