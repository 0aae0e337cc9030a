"""The path loop against Mitsuba's own path integrator: images of both differ by their noise and by nothing else."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from agreement import Agreement, compare, mitsuba_image, our_channels, our_image
from agreement_scenes import SCENES, box, ceiling_lamp
from numpy.typing import NDArray

from fullwell.radiometry import Spectrum
from fullwell.render import choose_variant
from fullwell.render.light import LightRequest, render_light
from fullwell.render.transport import progressive
from fullwell.scene import SceneDescription

pytestmark = pytest.mark.skipif(
    choose_variant().variant != "llvm_ad_spectral", reason="without LLVM it is Mitsuba's integrator that renders"
)

IMAGES = 4
"""Of each renderer, with seeds of their own."""

MEAN_LIMIT = 4.0
"""Standard errors of the image's mean in any of ten bands; exceeded by chance once in 1,600 times."""

SHARPEST = 0.02
"""A tile and band must be known to this, relative to the image's mean, or the test would pass for lack of light."""


QUICK = ("diffuse_box", "point_and_spot")
"""Scenes for the quick run: an area lamp, point and spot lights."""


def assert_agreement(found: Agreement) -> None:
    low, high = found.square_limits
    assert np.abs(found.means).max() < MEAN_LIMIT
    assert found.worst_tile < found.worst_tile_limit
    assert low < found.squares.min()
    assert found.squares.max() < high
    assert found.tile_error < SHARPEST


@pytest.mark.parametrize("name", [pytest.param(name, marks=() if name in QUICK else pytest.mark.slow) for name in SCENES])
def test_scene_agrees_with_mitsuba_within_the_noise_of_both(name: str) -> None:
    comparison = SCENES[name]()
    ours = np.stack([our_image(comparison, seed) for seed in range(IMAGES)])
    theirs = np.stack([mitsuba_image(comparison, 100 + seed) for seed in range(IMAGES)])
    assert_agreement(compare(ours, theirs))


@pytest.mark.slow
def test_bands_counted_as_channels_agree_with_mitsuba_too() -> None:
    """Channels draw their wavelengths by chance where bands are visited by turns."""
    comparison = replace(SCENES["disk_and_cylinder_lamps"](), samples=128)
    theirs = np.stack([mitsuba_image(comparison, 100 + seed) for seed in range(IMAGES)])
    assert_agreement(compare(our_channels(comparison, 0), theirs))


def test_two_per_cent_more_light_or_four_in_one_tile_would_be_found() -> None:
    comparison = SCENES["constant_environment"]()
    ours = np.stack([our_image(comparison, seed) for seed in range(IMAGES)])
    theirs = np.stack([mitsuba_image(comparison, 100 + seed) for seed in range(IMAGES)])
    brighter = compare(1.02 * ours, theirs)
    assert np.abs(brighter.means).min() > 4 * MEAN_LIMIT
    ours[:, 16:24, 24:32] *= 1.04
    one_tile = compare(ours, theirs)
    assert one_tile.worst_tile > one_tile.worst_tile_limit


# Independence --------------------------------------------------------------------------------------------------------


def _whole(seed: int) -> tuple[NDArray[Any], NDArray[Any]]:
    comparison = SCENES["glass_ball"]()
    request = LightRequest(grid=comparison.grid, responses=(Spectrum.constant(1.0),), max_depth=6, seed=seed)
    request = replace(request, goal=replace(request.goal, noise_ratio=None, samples_per_pixel=20))
    light = render_light(comparison.scene, comparison.camera, request)
    assert light.bands is not None
    return light.replicas, light.bands


def test_same_bytes_however_the_work_is_cut(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = _whole(3)
    monkeypatch.setattr(progressive, "_LANES", 4 * 1000)
    lanes = _whole(3)
    monkeypatch.setattr(progressive, "_SAMPLES_PER_LAUNCH", 4 * 5 * 77)
    samples = _whole(3)
    for cut in (lanes, samples):
        for one, other in zip(whole, cut, strict=True):
            np.testing.assert_array_equal(one, other)
    assert not np.array_equal(_whole(4)[1], whole[1])


def test_same_bytes_for_one_thread_and_for_four() -> None:
    import drjit as dr

    before = dr.thread_count()
    images = []
    try:
        for threads in (1, 4):
            dr.set_thread_count(threads)
            images.append(_whole(3))
    finally:
        dr.set_thread_count(before)
    for one, other in zip(*images, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.slow
def test_scenes_of_one_kind_share_recordings_but_nothing_else() -> None:
    """As in a worker, which renders one job after the other: what other tests have left in this process is no part of it."""
    here = Path(__file__).resolve()
    paths = [str(here.parent), str(here.parents[2]), str(here.parents[2] / "service")]
    code = f"import sys; sys.path[:0] = {paths!r}; import test_against_mitsuba; test_against_mitsuba.check_sharing()"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]


def check_sharing() -> None:
    """Dr.Jit makes two recordings of whatever it sees first."""
    full = replace(SCENES["diffuse_box"](), samples=8)
    bare = replace(full, scene=SceneDescription((*box()[1:4], ceiling_lamp(0.3))))
    first = [our_image(comparison, 0) for comparison in (full, bare, full, bare)]
    before = recordings()
    again = [our_image(comparison, 0) for comparison in (bare, full)]
    assert recordings() == before
    assert not np.array_equal(first[0], first[1])
    for one, other in zip((*first[2:], *again), (*first[:2], first[1], first[0]), strict=True):
        np.testing.assert_array_equal(one, other)


def recordings() -> int:
    from fullwell.render.transport import replay

    return sum(frozen.n_recordings for frozen, _ in replay._recordings.values())
