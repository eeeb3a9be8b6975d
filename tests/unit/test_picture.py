# SPDX-License-Identifier: GPL-3.0-or-later
"""Picture files, read back by other means than ours."""

from __future__ import annotations

import os
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
from numpy.typing import NDArray

from addon.photon.errors import RenderError
from addon.photon.film.picture_file import check_writable, write_picture

WIDTH, HEIGHT = 5, 3


def decode(data: bytes) -> tuple[NDArray[np.uint8], list[bytes]]:
    """The pixels (h, w, 4), row 0 at the top, of an 8-bit RGBA PNG without filters."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    at, chunks = 8, []
    while at < len(data):
        (length,) = struct.unpack_from(">I", data, at)
        kind, body = data[at + 4 : at + 8], data[at + 8 : at + 8 + length]
        (crc,) = struct.unpack_from(">I", data, at + 8 + length)
        assert crc == zlib.crc32(kind + body)
        chunks.append((kind, body))
        at += 12 + length
    found = dict(chunks)
    width, height, *rest = struct.unpack(">IIBBBBB", found[b"IHDR"])
    assert rest == [8, 6, 0, 0, 0]
    rows = np.frombuffer(zlib.decompress(found[b"IDAT"]), np.uint8).reshape(height, -1)
    assert not rows[:, 0].any()
    return rows[:, 1:].reshape(height, width, 4), [kind for kind, _ in chunks]


def images(**changed: Any) -> dict[str, NDArray[np.float32]]:
    """Every pass, with other values in each."""
    rng = np.random.default_rng(2)
    named = {name: rng.random((HEIGHT, WIDTH, 3)) for name in ("Direct", "Indirect", "Normal")}
    named["Depth"] = rng.random((HEIGHT, WIDTH, 1)) * 1e10
    named["Combined"] = rng.random((HEIGHT, WIDTH, 4)) * 3
    named["Combined"][..., 3] = 1.0
    return {name: image.astype(np.float32) for name, image in (named | changed).items()}


def test_png_values(tmp_path: Path) -> None:
    """sRGB (IEC 61966-2-1) of known linear values; beyond [0, 1] is clipped."""
    linear = [0.0, 0.0031308, 0.0021, 0.214041, 0.5, 1.0, 7.0, -1.0]
    expected = [0, 10, 7, 127, 188, 255, 255, 0]
    combined = np.ones((1, len(linear), 4))
    combined[0, :, :3] = np.array(linear)[:, None]
    write_picture(tmp_path / "a.png", images(Combined=combined), {})
    pixels, kinds = decode((tmp_path / "a.png").read_bytes())
    assert kinds == [b"IHDR", b"IDAT", b"IEND"]
    assert (pixels[0, :, 3] == 255).all()
    assert np.abs(pixels[0, :, :3].astype(int) - np.array(expected)[:, None]).max() <= 0


def test_png_is_upright(tmp_path: Path) -> None:
    combined = np.zeros((HEIGHT, WIDTH, 4))
    combined[..., 3] = 1.0
    combined[0, 1, 0] = 1.0  # red in the bottom row
    combined[2, 4, 2] = 1.0  # blue at the top right
    write_picture(tmp_path / "a.PNG", images(Combined=combined), {})
    pixels, _ = decode((tmp_path / "a.PNG").read_bytes())
    assert pixels.shape == (HEIGHT, WIDTH, 4)
    assert pixels[2, 1].tolist() == [255, 0, 0, 255] and pixels[0, 4].tolist() == [0, 0, 255, 255]
    assert np.count_nonzero(pixels[..., :3]) == 2


def test_png_alpha_is_straight(tmp_path: Path) -> None:
    """The film is premultiplied; PNG is not."""
    combined = np.zeros((1, 4, 4))
    combined[0, 0] = (0.25, 0.25, 0.25, 0.5)
    combined[0, 1] = (0.5, 0.5, 0.5, 1.0)
    combined[0, 2] = (0.3, 0.3, 0.3, 0.0)  # nothing there
    combined[0, 3] = (0.5, 0.5, 0.5, 2.0)
    write_picture(tmp_path / "a.png", images(Combined=combined), {})
    pixels, _ = decode((tmp_path / "a.png").read_bytes())
    assert pixels[0].tolist() == [[188] * 3 + [128], [188] * 3 + [255], [0] * 4, [188] * 3 + [255]]


def test_png_of_every_byte(tmp_path: Path) -> None:
    """Each 8-bit value, decoded to linear and encoded again, is itself."""
    value = np.arange(256) / 255.0
    linear = np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)
    combined = np.ones((1, 256, 4))
    combined[0, :, :3] = linear[:, None]
    write_picture(tmp_path / "a.png", images(Combined=combined), {})
    pixels, _ = decode((tmp_path / "a.png").read_bytes())
    assert np.array_equal(pixels[0, :, 0], np.arange(256))


def test_exr_round_trip(tmp_path: Path) -> None:
    passes = images()
    passes["Combined"][0, 0] = (1e-30, 1e30, np.inf, 0.25)
    metadata = {"seed": 7, "device": "grey box", "seconds": {"eye": 0.5}}
    write_picture(tmp_path / "a.exr", passes, metadata)
    with OpenEXR.File(str(tmp_path / "a.exr"), separate_channels=True) as file:
        channels, header = file.channels(), file.header()
        names = {f"ViewLayer.Combined.{c}" for c in "RGBA"} | {"ViewLayer.Depth.Z"}
        names |= {f"ViewLayer.{name}.{c}" for name in ("Direct", "Indirect") for c in "RGB"}
        names |= {f"ViewLayer.Normal.{c}" for c in "XYZ"}
        assert set(channels) == names
        for name in names:
            _, layer, letter = name.split(".")
            at = {"Normal": "XYZ", "Depth": "Z"}.get(layer, "RGBA").index(letter)
            pixels = channels[name].pixels
            assert pixels.dtype == np.float32
            assert np.array_equal(pixels, passes[layer][::-1, :, at]), name
        assert header["photon_stream.seed"] == "7"
        assert header["photon_stream.device"] == "grey box"
        assert header["photon_stream.seconds"] == "{'eye': 0.5}"


@pytest.mark.parametrize("suffix", [".png", ".exr"])
def test_one_pixel(tmp_path: Path, suffix: str) -> None:
    one = {name: image[:1, :1] for name, image in images().items()}
    write_picture(tmp_path / f"one{suffix}", one, {})
    assert [file.name for file in tmp_path.iterdir()] == [f"one{suffix}"]


@pytest.mark.parametrize("name", ["picture", "picture.jpg", "picture.png.txt", ".png"])
def test_wrong_suffix(tmp_path: Path, name: str) -> None:
    with pytest.raises(RenderError, match=r"the name must end in \.png or \.exr"):
        check_writable(tmp_path / name)


def test_names_that_can_be_written(tmp_path: Path) -> None:
    for name in ("a.png", "a.EXR", "with space.png", "Grüße 床.exr", "a.b.png"):
        check_writable(tmp_path / name)
        write_picture(tmp_path / name, images(), {})
        assert (tmp_path / name).stat().st_size > 0
    assert len(list(tmp_path.iterdir())) == 5


def test_no_folder(tmp_path: Path) -> None:
    with pytest.raises(RenderError, match=r"a\.png: no folder .*none"):
        check_writable(tmp_path / "none" / "a.png")
    (tmp_path / "file").touch()
    with pytest.raises(RenderError, match=r"a\.png: no folder .*file"):
        check_writable(tmp_path / "file" / "a.png")
    (tmp_path / "folder.png").mkdir()
    with pytest.raises(RenderError, match=r"folder\.png: is a folder"):
        check_writable(tmp_path / "folder.png")


def test_unwritable_folder(tmp_path: Path) -> None:
    folder = tmp_path / "shut"
    folder.mkdir(mode=0o500)
    if os.geteuid() == 0:  # whom modes don't stop
        folder = Path("/proc/self")
        if not folder.is_dir():
            pytest.skip("root, and no /proc")
    with pytest.raises(RenderError, match=r"a\.png: cannot be written \("):
        check_writable(folder / "a.png")


@pytest.mark.parametrize("suffix", [".png", ".exr"])
def test_failure_leaves_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str
) -> None:
    """The last picture stays as it was, and no half one beside it."""
    path = tmp_path / f"a{suffix}"
    path.write_text("the last picture")

    def fail(*_: Any) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("addon.photon.film.picture_file.os.replace", fail)
    with pytest.raises(RenderError, match=r"cannot be written \(.*No space left on device"):
        write_picture(path, images(), {})
    assert [file.name for file in tmp_path.iterdir()] == [path.name]
    assert path.read_text() == "the last picture"


@pytest.mark.parametrize(
    "suffix",
    [
        ".png",
        ".exr",
    ],
)
def test_folder_gone_meanwhile(tmp_path: Path, suffix: str) -> None:
    with pytest.raises(RenderError, match="cannot be written"):
        write_picture(tmp_path / "gone" / f"a{suffix}", images(), {})


def test_interrupted_half_way(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("addon.photon.film.picture_file.os.replace", interrupt)
    with pytest.raises(KeyboardInterrupt):
        write_picture(tmp_path / "a.png", images(), {})
    assert not list(tmp_path.iterdir())
