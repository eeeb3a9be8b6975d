# SPDX-License-Identifier: GPL-3.0-or-later
"""OpenImageDenoise: where it is found, what it says, and that its bits are the same."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from addon.denoiser import VARIABLE, Denoiser, DenoiserError, Way, find, library

needs_it = pytest.mark.skipif(find() is None, reason="OpenImageDenoise is not here")
SIZE = (70, 90, 3)


@pytest.fixture
def nowhere(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing is installed."""
    monkeypatch.delenv(VARIABLE, raising=False)
    monkeypatch.setattr(library, "_folders_of", lambda package: [])
    monkeypatch.setattr(library.Path, "glob", lambda *_: ())
    monkeypatch.setattr(library.Path, "is_file", lambda path: "/usr" not in str(path) and _is(path))


def _is(path: Path) -> bool:
    return path.exists() and not path.is_dir()


@pytest.mark.usefixtures("nowhere")
@pytest.mark.parametrize(
    ("program", "inside", "name"),
    [
        ("blender-5.0", "lib", "libOpenImageDenoise.so.2"),
        ("Blender 5.0", "blender.shared", "OpenImageDenoise.dll"),
        ("Blender.app/Contents/Resources", "lib", "libOpenImageDenoise.dylib"),
    ],
)
def test_beside_blender(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, program: str, inside: str, name: str
) -> None:
    """By its folder, by the variable, by its Python, by its modules."""
    platform = next(known for known, names in library.NAMES.items() if name in names)
    monkeypatch.setattr(library.sys, "platform", platform)
    folder = tmp_path / program / inside
    folder.mkdir(parents=True)
    assert find(tmp_path / program) is None and find() is None
    with pytest.raises(DenoiserError, match="is not here: Blender brings it"):
        Denoiser()
    (folder / name).write_text("no library")
    assert find(tmp_path / program) == folder / name
    monkeypatch.setenv(VARIABLE, str(tmp_path / program))
    assert find() == folder / name
    monkeypatch.setenv(VARIABLE, str(folder / name))
    assert find() == folder / name
    monkeypatch.delenv(VARIABLE)
    version = tmp_path / program / "5.0"
    with monkeypatch.context() as patch:  # as the Python of that Blender
        patch.setattr(library.sys, "prefix", str(version / "python"))
        assert find() == folder / name
    modules = [str(version / "scripts" / "modules" / "bpy")]  # which both have on their path
    monkeypatch.setattr(library, "_folders_of", lambda package: modules)
    assert find() == folder / name


def test_no_library(tmp_path: Path) -> None:
    path = tmp_path / "libOpenImageDenoise.so.2"
    path.write_text("nothing")
    with pytest.raises(DenoiserError, match=r"libOpenImageDenoise.so.2 is no OpenImageDenoise 2: "):
        Denoiser(path)


def test_another_library(tmp_path: Path) -> None:
    """That lacks its functions."""
    import photon_stream_native

    with pytest.raises(DenoiserError, match="is no OpenImageDenoise 2: .*oidnNewDevice"):
        Denoiser(next(Path(photon_stream_native.__file__).parent.rglob("photon_stream_native*.so")))


@needs_it
def test_noise_goes_and_bits_stay() -> None:
    """High dynamic range; for any number of threads and each time."""
    rng = np.random.default_rng(1)
    truth = np.full(SIZE, 4.0, np.float32)
    truth[:, 45:] = 0.05
    albedo = np.where(truth > 1.0, 0.8, 0.4).astype(np.float32)
    normal = np.zeros(SIZE, np.float32)
    normal[..., 2] = 1.0
    noisy = (truth * rng.gamma(4.0, 0.25, SIZE)).astype(np.float32)
    made = []
    for threads in (0, 1, 2):
        with Denoiser(on_cpu=True, threads=threads) as denoiser:
            features = {"albedo": albedo, "normal": normal}
            for _ in range(2):
                with denoiser.filtering(SIZE, features) as filtered:
                    made += [filtered(noisy) for _ in range(2)]
            assert denoiser.name.startswith("OpenImageDenoise 2.")
            assert denoiser.name.endswith(", CPU")
    assert all(np.array_equal(one, made[0]) for one in made)
    before, after = (float(np.square(x / truth - 1.0).mean()) for x in (noisy, made[0]))
    assert after < 0.25 * before


@needs_it
def test_noisy_features() -> None:
    """Where they are filtered first, their noise does not come back in the picture."""
    rng = np.random.default_rng(3)
    truth = np.full(SIZE, 0.6, np.float32)
    truth[:, 45:] = 0.3
    noisy, albedo = (
        np.clip(truth * rng.gamma(9.0, 1.0 / 9.0, SIZE), 0.0, 1.0).astype(np.float32)
        for _ in range(2)
    )
    normal = rng.normal((0.0, 0.0, 1.0), 0.3, SIZE).astype(np.float32)
    features = {"albedo": albedo, "normal": normal}
    given, errors = albedo.copy(), []
    with Denoiser(on_cpu=True) as denoiser:
        for way in Way:
            with denoiser.filtering(SIZE, features, way) as filtered:
                errors.append(float(np.square(filtered(noisy) / truth - 1.0).mean()))
    assert np.array_equal(albedo, given)  # a copy is filtered
    assert max(errors[1:]) < 0.5 * errors[0]


@needs_it
@pytest.mark.parametrize("way", Way)
def test_four_channels_and_in_place(way: Way) -> None:
    """The same bits as of three, given and where they are; what is behind the third stays."""
    rng = np.random.default_rng(2)
    images = {name: rng.random(SIZE, np.float32) for name in ("first", "albedo", "normal")}
    wide = {
        name: np.dstack([image, np.full(SIZE[:2], 7.0, "f4")]) for name, image in images.items()
    }
    wide["clean"] = np.full((*SIZE[:2], 4), 7.0, np.float32)
    made = []
    with Denoiser(on_cpu=True) as denoiser:
        for given in (images, wide):
            features = {name: given[name] for name in ("albedo", "normal")}
            shape = given["first"].shape
            with denoiser.filtering(shape, features, way) as filtered:
                made.append(filtered(given["first"])[..., :3])
        places = {name: image.ctypes.data for name, image in wide.items()}
        there = denoiser.filter_there(SIZE[:2], places, {"first": "clean"}, way)
        there.clean_features()
        there.run("first")
        there.release()
        assert not denoiser.is_cuda
    made.append(wide["clean"][..., :3])
    assert np.array_equal(made[0], made[1]) and np.array_equal(made[0], made[2])
    assert (wide["clean"][..., 3] == 7.0).all() and np.ptp(made[0]) > 0.1


@needs_it
def test_what_it_complains_of_is_raised() -> None:
    picture = np.ones((4, 4, 3), np.float32)
    with (
        Denoiser(on_cpu=True) as denoiser,
        pytest.raises(DenoiserError, match="OpenImageDenoise: "),
        denoiser.filtering(picture.shape, {"normal": picture}) as filtered,  # without albedo
    ):
        filtered(picture)
