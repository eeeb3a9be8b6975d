# SPDX-License-Identifier: GPL-3.0-or-later
"""Denoised pictures that a GPU mixes are those that the host mixes."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from addon.denoiser import (
    CudaBuffers,
    CudaError,
    Denoiser,
    DenoiserError,
    PreparedFilter,
    Way,
)
from addon.denoiser.cuda import DRIVER
from addon.photon.backends import backend as backend_module
from addon.photon.film import denoise, device_denoising
from addon.photon.film.device_denoising import DeviceDenoisingResolver
from addon.photon.film.resolver import DenoisingResolver
from addon.photon.prepare import prepare
from addon.photon.renderer import Renderer
from addon.photon.settings import FEWEST_PASSES, Settings
from addon.streams import Device
from tests.scenes import cornell
from tests.unit.test_denoiser import needs_it

pytestmark = needs_it
# Wider than high, and not whole work groups; few photons, so that all of it is mixed.
SETTINGS = Settings(width=43, height=29, photons=2000, passes=9, seed=5, denoise=True)


@pytest.fixture(params=[False, True], ids=["", "bulb"])
def renderer(device: Device, resident: None, request: pytest.FixtureRequest) -> Iterator[Renderer]:
    """Of mirrors, as on a GPU, and perhaps a bulb that is seen."""
    scene = cornell(mirror=True, bulb=request.param)
    made = prepare(scene, replace(SETTINGS, backend="compute"), device)
    yield made
    made.release()


def from_passes(passes: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Denoise in two ways from so many passes on, whatever denoises."""
    for number in (False, True):
        monkeypatch.setitem(denoise.FEWEST_FOR_TWO, number, passes)


def both(renderer: Renderer) -> tuple[Any, Any]:
    """Images and error of the device, and of the host."""
    denoised = renderer._denoised
    assert isinstance(denoised, DeviceDenoisingResolver)
    found = []
    for resolve in (denoised.resolve, lambda wanted: DenoisingResolver.resolve(denoised, wanted)):
        images, telling = resolve(["Combined", "Direct", "Error"])
        assert images.keys() == {"Combined", "Direct"}
        found.append((images, telling()))
    return found[0], found[1]


@pytest.mark.parametrize("ways", [(Way.GIVEN,), (Way.FILTERED,), (Way.GIVEN, Way.LARGEST)])
def test_as_the_host_does(
    renderer: Renderer, ways: tuple[Way, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    """To rounding, after any number of passes, and what is told of the error; the plain picture is
    another."""
    assert renderer._denoised
    renderer._denoised._noisy_features = Way.FILTERED in ways
    from_passes(2 if Way.LARGEST in ways else SETTINGS.passes + 1, monkeypatch)
    for index in range(SETTINGS.passes):
        renderer.render_pass()
        if index in (0, 1, 2, 8):
            (ours, error), (theirs, true) = both(renderer)
            for name, image in theirs.items():
                np.testing.assert_allclose(ours[name], image, rtol=2e-5, atol=1e-6 * image.max())
            assert error.total == pytest.approx(true.total, rel=1e-4)
            assert error.bias == pytest.approx(true.bias, rel=1e-4)
    with Denoiser() as denoiser:
        assert renderer._denoised.ways(denoiser) == ways
    if Way.LARGEST in ways:  # the mean of both is better
        from_passes(SETTINGS.passes + 1, monkeypatch)
        in_one_way = renderer._denoised.resolve(["Combined"])[0]["Combined"]
        assert not np.array_equal(in_one_way, ours["Combined"])
    np.testing.assert_allclose(error.image, true.image, rtol=2e-3, atol=1e-4 * true.image.max())
    plain = renderer._resolver.resolve(["Combined"])[0]["Combined"]
    assert np.abs(plain - ours["Combined"]).max() > 0.01 * plain.max()


def test_of_several_strips(
    device: Device, renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Neighbours are in others: the host mixes, with the same picture."""
    for name in ("STRIP_PIXELS", "GPU_STRIP_PIXELS"):
        monkeypatch.setattr(backend_module, name, 10 * SETTINGS.width)
    other = prepare(renderer.scene, replace(SETTINGS, backend="compute"), device)
    assert len(other.film.strips) == 3
    pictures = []
    for each in (renderer, other):
        for _ in range(3):
            each.render_pass()
        pictures.append(each.images(["Combined"])["Combined"])
    other.release()
    np.testing.assert_allclose(*pictures, rtol=2e-5, atol=1e-6 * pictures[0].max())


class _InPlace:
    """CudaBuffers for a denoiser on the processor: OpenGL's buffers, copied to and fro."""

    def __init__(self, names: dict[str, int]) -> None:
        self._texels = {
            name: np.empty(SETTINGS.width * SETTINGS.height * 4, "f4") for name in names
        }
        self.buffers: dict[str, Any] = {}
        self.released = 0

    @contextmanager
    def mapped(self) -> Iterator[dict[str, int]]:
        for name, texels in self._texels.items():
            self.buffers[name].read_into(texels)
        yield {name: texels.ctypes.data for name, texels in self._texels.items()}
        for name, texels in self._texels.items():
            self.buffers[name].write(texels)

    def release(self) -> None:
        self.released += 1


def in_place(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch, two_ways: bool = False
) -> tuple[DeviceDenoisingResolver, device_denoising._Shared, Any]:
    """Who denoises in place from now on, features first; with what; and the same picture by way of
    the host."""
    monkeypatch.setattr(device_denoising, "CudaBuffers", _InPlace)
    denoised = renderer._denoised
    assert isinstance(denoised, DeviceDenoisingResolver)
    for _ in range(FEWEST_PASSES):
        renderer.render_pass()
    denoised._may_share, denoised._noisy_features = False, True
    from_passes(FEWEST_PASSES + (not two_ways), monkeypatch)
    by_way_of_host = denoised.resolve(["Combined"])[0]["Combined"]
    monkeypatch.setattr(Denoiser, "is_cuda", True)
    denoised._may_share = True
    denoised._shared = shared = device_denoising._Shared(renderer.device, by_way_of_host.shape[:2])
    stand_in: Any = shared._shared
    stand_in.buffers = shared._buffers
    return denoised, shared, by_way_of_host


@pytest.mark.parametrize("two_ways", [False, True])
def test_what_opengl_shares_with_the_denoiser(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch, two_ways: bool
) -> None:
    """Filtered in place it has the same bits as by way of the host."""
    denoised, shared, by_way_of_host = in_place(renderer, monkeypatch, two_ways)
    stand_in: Any = shared._shared
    filters = []
    for _ in range(2):  # the second with the filters of the first
        assert np.array_equal(denoised.resolve(["Combined"])[0]["Combined"], by_way_of_host)
        filters.append(dict(shared._filters))
    assert filters[0] == filters[1] and len(filters[0]) == 1 + two_ways and denoised._may_share
    shared._places = {}  # elsewhere than these know
    assert np.array_equal(denoised.resolve(["Combined"])[0]["Combined"], by_way_of_host)
    assert shared._filters[Way.FILTERED] is not filters[0][Way.FILTERED]
    denoised._unshare()
    assert stand_in.released == 1 and not shared._filters


def test_what_cannot_be_shared(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    """It is tried once, and goes by way of the host."""
    tried = []

    def refused(names: dict[str, int]) -> None:
        tried.append(names)
        raise CudaError("there are 2 GPUs")

    for _ in range(3):
        renderer.render_pass()
    before = renderer.images(["Combined"])["Combined"]
    monkeypatch.setattr(device_denoising, "CudaBuffers", refused)
    monkeypatch.setattr(Denoiser, "is_cuda", True)
    for _ in range(2):
        assert np.array_equal(renderer.images(["Combined"])["Combined"], before)
    assert len(tried) == 1 and not renderer.warnings


def test_what_fails_in_place(renderer: Renderer, monkeypatch: pytest.MonkeyPatch) -> None:
    """Goes by way of the host, and what was taken is given back."""
    monkeypatch.setattr(device_denoising, "CudaBuffers", _InPlace)
    for _ in range(3):
        renderer.render_pass()
    before = renderer.images(["Combined"])["Combined"]
    released: list[int] = []
    monkeypatch.setattr(_InPlace, "release", lambda _: released.append(1))
    monkeypatch.setattr(_InPlace, "mapped", refuse)
    monkeypatch.setattr(Denoiser, "is_cuda", True)
    assert np.array_equal(renderer.images(["Combined"])["Combined"], before)
    assert len(released) == 1 and not renderer.warnings
    assert np.isfinite(renderer.radius(0)) and renderer.error().total > 0.0


def test_what_fails_after_features_were_filtered(
    renderer: Renderer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Those that the host takes are the film's, not the filtered ones."""
    denoised, _, by_way_of_host = in_place(renderer, monkeypatch)
    run, ran = PreparedFilter.run, list[str]()

    def failing(self: PreparedFilter, picture: str) -> None:
        ran.append(picture)
        if picture == "other":
            raise DenoiserError("OpenImageDenoise: out of memory")
        run(self, picture)

    monkeypatch.setattr(PreparedFilter, "run", failing)
    assert np.array_equal(denoised.resolve(["Combined"])[0]["Combined"], by_way_of_host)
    assert ran == ["first", "other", "color", "color"] and not denoised._may_share


@contextmanager
def refuse(_: Any) -> Iterator[dict[str, int]]:
    raise CudaError("cuGraphicsMapResources: error 700")
    yield {}


class _Driver:
    """Stands in for CUDA's: each call is written down, and some fail."""

    def __init__(self, failing: str) -> None:
        self.failing, self.called = failing, list[str]()

    def __getattr__(self, name: str) -> Any:
        def call(*_: Any) -> int:
            self.called.append(name)
            if name == "cuDeviceGetCount":
                _[0]._obj.value = 1
            if name == "cuDevicePrimaryCtxRetain":
                _[0]._obj.value = 5
            return 700 if name == self.failing else 0

        setattr(self, name, call)
        return call


@pytest.mark.parametrize(
    "failing", ["", "cuCtxSynchronize", "cuGraphicsUnregisterResource", "cuCtxPushCurrent_v2"]
)
def test_cuda_lets_go(monkeypatch: pytest.MonkeyPatch, failing: str) -> None:
    """Whatever it has lost: what was mapped is unmapped, and releasing raises nothing."""
    driver = _Driver("")
    monkeypatch.setattr(ctypes, "CDLL", lambda _: driver)
    buffers = CudaBuffers({"one": 3, "other": 4})
    driver.failing = failing
    fails = failing in ("cuCtxSynchronize", "cuCtxPushCurrent_v2")
    expected: Any = pytest.raises(CudaError, match=failing) if fails else nullcontext()
    with expected, buffers.mapped() as places:
        assert [*places] == ["one", "other"]
    mapped = driver.called.count("cuGraphicsMapResources")
    assert driver.called.count("cuGraphicsUnmapResources") == mapped
    buffers.release()
    assert driver.called.count("cuDevicePrimaryCtxRelease_v2") == 1
    buffers.release()
    assert driver.called.count("cuDevicePrimaryCtxRelease_v2") == 1


def test_no_cuda(device: Device) -> None:
    try:
        ctypes.CDLL(DRIVER)
    except OSError:
        with pytest.raises(CudaError, match=DRIVER):
            CudaBuffers({})
    else:
        pytest.skip(f"{device.name} has CUDA")
