# SPDX-License-Identifier: GPL-3.0-or-later
"""Every OpenGL that is to be had here renders one picture; and none is busy for long at once.

Pictures of other machines count where $PHOTON_STREAM_PICTURES names a folder: the test compares
with what it finds there, and leaves its own. $PHOTON_STREAM_MESA is a folder with another Mesa's
`usr` in it, as `dpkg -x` makes it of libegl-mesa0, libgl1-mesa-dri, mesa-libgallium, libgbm1 and
libdrm2.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from itertools import combinations
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
import pytest

from addon.photon.prepare import prepare
from addon.photon.settings import Settings
from addon.streams import Device
from tests.flip import mean_flip
from tests.scenes import closed_sphere, cornell, hills, random_room
from tests.stability.table import Measured

ROOT = Path(__file__).resolve().parents[2]
RENDER = """
import json, sys
import numpy as np
from addon.photon.errors import PhotonStreamError
from addon.photon.backends.backend import open_device
from addon.photon.prepare import prepare
from addon.photon.settings import Settings
from tests.measure import render_clean
from tests.scenes import cornell, random_room
index, passes, file = int(sys.argv[1]), int(sys.argv[2]), sys.argv[3]
try:
    device = open_device(Settings(device_index=index))
except PhotonStreamError as error:
    print(json.dumps({"error": str(error)}))
    sys.exit()
name = f"{device.name}, OpenGL {device.version}"
scenes = {"cornell": cornell(True, True), "room": random_room(2)}
pictures = {}
backends = ("native", "fragment", "compute")[: 2 + device.has_compute]
for backend in backends[:1] if "softpipe" in name else backends:  # which takes minutes for a loop
    for scene in scenes:
        settings = dict(width=64, height=64, photons=20000, passes=passes, backend=backend)
        found = render_clean(device, scenes[scene], **settings)["Combined"][..., :3]
        pictures[f"{backend} {scene}"] = found
np.savez(file, **pictures)
print(json.dumps({"name": name}))
"""


def drivers(folder: Path, thorough: bool) -> Iterator[tuple[int, dict[str, str]]]:
    """Device numbers and environments that may lead to different OpenGLs."""
    yield from ((index, {}) for index in range(8))
    for version in ("3.3", "4.1")[: 1 + thorough]:  # GLSL with less in it; Mesa's alone
        yield 0, {"MESA_GL_VERSION_OVERRIDE": version}
    yield 0, {"GALLIUM_DRIVER": "softpipe"}
    if mesa := os.environ.get("PHOTON_STREAM_MESA"):
        (libraries,) = Path(mesa).glob("usr/lib/*-linux-gnu")
        vendor = folder / "mesa.json"
        icd = {"library_path": str(libraries / "libEGL_mesa.so.0")}
        vendor.write_text(json.dumps({"file_format_version": "1.0.0", "ICD": icd}))
        other = {
            "LD_LIBRARY_PATH": str(libraries),
            "LIBGL_DRIVERS_PATH": str(libraries / "dri"),
            "__EGL_VENDOR_LIBRARY_FILENAMES": str(vendor),
        }
        yield 0, other
        yield 0, other | {"GALLIUM_DRIVER": "softpipe"}


def pictures(folder: Path, passes: int, thorough: bool) -> dict[str, dict[str, Any]]:
    """By driver, by backend and scene."""
    found: dict[str, dict[str, Any]] = {}
    for index, environment in drivers(folder, thorough):
        if index and len(found) < index:  # there was none before it
            continue
        file = folder / "pictures.npz"
        done = subprocess.run(
            [sys.executable, "-c", RENDER, str(index), str(passes), str(file)],
            cwd=ROOT,
            env=os.environ | environment,
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stderr
        said = json.loads(done.stdout.splitlines()[-1])
        if "name" in said and said["name"] not in found:
            with np.load(file) as data:
                found[said["name"]] = dict(data)
    return found


@pytest.mark.stability(57)
def test_drivers_agree(tmp_path: Path, measured: Measured, thorough: bool) -> None:
    """Every backend on every driver shows the picture that every other shows."""
    passes = 8 if thorough else 2
    found = pictures(tmp_path, passes, thorough)
    assert found, "no OpenGL"
    if shared := os.environ.get("PHOTON_STREAM_PICTURES"):
        for name, own in found.items():
            file = "".join(x if x.isalnum() else "_" for x in name)
            np.savez(Path(shared) / f"{file}_{passes}.npz", name=name, **own)
        for file in Path(shared).glob(f"*_{passes}.npz"):
            with np.load(file) as data:
                found.setdefault(str(data["name"]), {x: data[x] for x in data if x != "name"})
    every = [
        (name, *key.split(), image) for name, own in found.items() for key, image in own.items()
    ]
    worst: dict[tuple[str, str], float] = {}
    for one, other in combinations(every, 2):
        is_same_way = one[1] == other[1] or one[0] == other[0]  # backend, or driver
        if one[2] == other[2] and is_same_way:
            pair = one[0], other[0]
            worst[pair] = max(worst.get(pair, 0.0), mean_flip(one[3], other[3]))
    for (one, other), flip in worst.items():
        print(f"FLIP {flip:.6f}: {one} {sorted({key.split()[0] for key in found[one]})}; {other}")
    assert measured(f"of {len(found)} OpenGLs, mean FLIP", max(worst.values())) <= 0.01


class Clock:
    """Times every launch on the device, one after the other [s]."""

    def __init__(self, device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
        self.longest, self.total, self.launches = 0.0, 0.0, 0
        self._query = device.ctx.query(time=True)
        for kind, name in ((moderngl.ComputeShader, "run"), (moderngl.VertexArray, "render")):
            monkeypatch.setattr(kind, name, self._timed(getattr(kind, name)))

    def _timed(self, launch: Any) -> Any:
        def timed(*arguments: Any, **options: Any) -> None:
            with self._query:
                launch(*arguments, **options)
            seconds = self._query.elapsed * 1e-9
            self.longest = max(self.longest, seconds)
            self.total += seconds
            self.launches += 1

        return timed


WORST: dict[str, tuple[Any, dict[str, Any]]] = {
    "a mirror and lobes": (lambda: cornell(True, True), {}),
    "every photon goes on": (
        lambda: closed_sphere(1.0),
        {"photon_bounces": 64, "photons": 200_000},
    ),
    "2 million triangles": (lambda: hills(1000), {}),
    "mirrors among mirrors": (lambda: random_room(3), {"mirror_depth": 16}),
    "all photons within reach": (cornell, {"radius": 5.0}),
    "all photons within reach, splatted": (cornell, {"radius": 5.0, "estimator": "splat"}),
    "a million photons within reach": (cornell, {"radius": 1.0, "photons": 1 << 20}),
}


@pytest.mark.stability(51)
@pytest.mark.parametrize("case", WORST)
def test_longest_dispatch(
    device: Device,
    measured: Measured,
    thorough: bool,
    monkeypatch: pytest.MonkeyPatch,
    case: str,
) -> None:
    """A driver ends a program that holds a GPU for seconds, and Blender's windows wait for it."""
    if device.is_software:
        pytest.skip(f"{device.name} is no GPU")
    make, given = WORST[case]
    side = 1024 if thorough else 256
    settings = Settings(**({"width": side, "height": side, "passes": 2} | given))
    renderer = prepare(make(), settings, device)
    try:
        renderer.render_pass()
        clock = Clock(device, monkeypatch)
        renderer.render_pass()
    finally:
        renderer.release()
    print(f"{case}: {clock.launches} launches, {clock.total:.4f} s; longest {clock.longest:.4f} s")
    assert measured("longest", clock.longest, " s") <= 0.1
