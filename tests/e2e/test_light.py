"""Whole frames: other weights and exposures cost no rendering, channels are as good as spectra, the stated noise is true."""

from __future__ import annotations

import copy
import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import fullwell.pipeline.frame as frame_module
from fullwell.dataset import encode
from fullwell.pipeline import LightCache, render_frame
from fullwell.render import choose_variant
from fullwell.schema import RecipeBuilder, load_recipe
from fullwell.storage import LocalStore

pytestmark = pytest.mark.skipif(
    choose_variant().variant != "llvm_ad_spectral", reason="the scalar fallback would need minutes for these errors"
)

LARGEST_SCORE = 5.0
"""Standard errors. The worst of the 1200 blocks of channels compared here lies beyond it once in 1000 runs."""

RMS_SCORE = (0.6, 1.4)
"""Of 192 blocks: their scatter is 5 %, that of the variance from six renderings 4 %, and errors are not quite in proportion to
light, as the variance is spread over the blocks."""

BLOCK = 8

READ_NOISE_E = 3.0


@pytest.fixture
def recipe() -> dict[str, Any]:
    """A ball and a box before a wall under two lamps, 64 x 48 pixels of little noise."""
    wall = {"kind": "diffuse", "reflectance": 0.6}
    panel = {"kind": "rectangle", "size_m": [0.5, 0.5]}
    return {
        "schema": "fullwell/recipe/v1",
        "name": "two lamps",
        "seed": 5,
        "scene": {
            "objects": [
                {"id": "floor", "geometry": {"kind": "rectangle", "size_m": [4, 4]}, "material": wall},
                {
                    "id": "wall",
                    "geometry": {"kind": "rectangle", "size_m": [4, 4]},
                    "material": {"kind": "diffuse", "reflectance": "colorchecker:blue_sky"},
                    "transform": {"rotate_deg": {"axis": "x", "angle_deg": 90}, "translate_m": [0, 1, 1]},
                },
                {
                    "id": "ball",
                    "geometry": {"kind": "sphere", "radius_m": 0.3},
                    "material": {"kind": "diffuse", "reflectance": "colorchecker:red"},
                    "transform": {"translate_m": [-0.3, 0, 0.3]},
                },
                {
                    "id": "box",
                    "geometry": {"kind": "cube", "size_m": [0.4, 0.4, 0.6]},
                    "material": {"kind": "diffuse", "reflectance": "colorchecker:foliage"},
                    "transform": {"translate_m": [0.5, 0.2, 0.3]},
                },
                {
                    "id": "cold",
                    "geometry": panel,
                    "material": {"kind": "emissive", "luminance_cd_m2": 4000, "spd": "D65", "group": "cold"},
                    "transform": {"rotate_deg": {"axis": "x", "angle_deg": 180}, "translate_m": [-1, 0, 2]},
                },
                {
                    "id": "warm",
                    "geometry": panel,
                    "material": {"kind": "emissive", "luminance_cd_m2": 3000, "spd": "A", "group": "warm"},
                    "transform": {"rotate_deg": {"axis": "x", "angle_deg": 180}, "translate_m": [1, 0, 2]},
                },
            ]
        },
        "cameras": [
            {
                "name": "main",
                "pose": {"origin_m": [0, -2.5, 1.0], "target_m": [0, 0, 0.5]},
                "lens": {"kind": "pinhole", "hfov_deg": 45, "f_number": 2},
                "sensors": [
                    {
                        "name": "phone",
                        "model": "imx363",
                        "rows": 48,
                        "cols": 64,
                        "read_noise_e": READ_NOISE_E,
                        "exposure": {"time_s": 0.02},
                    }
                ],
            }
        ],
        "outputs": ["raw.npz"],
        "quality": {"noise_ratio": 0.5, "max_depth": 4},
    }


@pytest.fixture
def renders(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """One item per rendering."""
    calls: list[int] = []
    original = frame_module.render_light

    def counted(*args: Any, **options: Any) -> Any:
        calls.append(1)
        return original(*args, **options)

    monkeypatch.setattr(frame_module, "render_light", counted)
    return calls


class Made:
    """A frame that was made: its manifest, and the mean electrons of its pixels."""

    def __init__(
        self, recipe: dict[str, Any], folder: Path, index: int = 0, *, cache: LightCache | None = None, **options: Any
    ):
        self._store = LocalStore(folder)
        document = load_recipe(recipe)
        frame = RecipeBuilder(document).frame(index)
        self.manifest = render_frame(frame, self._store, f"{index}", cache=cache, **options)
        self._index = index
        raw = encode.decode_raw_npz(self._store.get(f"{index}/raw.npz"))
        assert raw.mean_electrons is not None
        self.electrons = raw.mean_electrons.astype(np.float64)

    @property
    def radiance(self) -> dict[str, Any]:
        found: dict[str, Any] = self.manifest["cameras"][0]["radiance"]
        return found

    @property
    def sensor(self) -> dict[str, Any]:
        found: dict[str, Any] = self.manifest["cameras"][0]["sensors"][0]
        return found

    def steps(self, what: str) -> list[str]:
        return [step["decision"] for step in self.manifest["plan"] if step["what"] == what]


def blocks(electrons: np.ndarray) -> np.ndarray:
    """Return (blocks, channels) means over blocks of 8 x 8 pixels of an RGGB mosaic: their errors are nearly independent."""
    rows, cols = electrons.shape
    planes = electrons.reshape(rows // BLOCK, BLOCK // 2, 2, cols // BLOCK, BLOCK // 2, 2)
    return planes.mean(axis=(1, 4)).transpose(0, 2, 1, 3).reshape(-1, 4)


def noise_e2(electrons: np.ndarray, electrons_per_dn: float) -> np.ndarray:
    """Return the variance of the sensor's own noise in single pixels [e-^2]."""
    return np.asarray(electrons + READ_NOISE_E**2 + electrons_per_dn**2 / 12)


def scatter(recipe: dict[str, Any], folder: Path, count: int = 6, index: int = 0) -> tuple[np.ndarray, np.ndarray]:
    """Return mean and variance of the blocks over renderings of a frame with `count` seeds."""
    found = [blocks(Made(recipe | {"seed": 100 + n}, folder / str(n), index).electrons) for n in range(count)]
    return np.mean(found, axis=0), np.var(found, axis=0, ddof=1)


def check_equal_within_noise(one: np.ndarray, other: np.ndarray, variance: np.ndarray) -> None:
    """Compare blocks; `variance` is that of their difference, or what it is in proportion to the light, if that is more.

    Penumbras and edges have more than their share; few replicas may find too little by chance.
    """
    light = 0.5 * (one + other)
    per_light = variance.sum() / light.sum()
    scores = (one - other) / np.sqrt(np.maximum(per_light * light, variance))
    assert np.abs(scores).max() < LARGEST_SCORE
    assert RMS_SCORE[0] < np.sqrt(np.mean(scores**2)) < RMS_SCORE[1]


# Weights of light groups ---------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_other_weights_cost_no_rendering_and_equal_a_rendering_of_their_own(
    recipe: dict[str, Any], tmp_path: Path, renders: list[int]
) -> None:
    swept = copy.deepcopy(recipe)
    swept["vary"] = {"grid": {"scene.light_groups": [{"cold": 1.0, "warm": 0.3}, {"cold": 0.1, "warm": 2.0}]}}
    cache = LightCache()
    frames = [Made(swept, tmp_path / "swept", index, cache=cache) for index in range(2)]
    assert len(renders) == 1
    assert [frame.manifest["run"]["cache"][0]["result"] for frame in frames] == ["miss", "hit"]
    assert frames[0].radiance["key"] == frames[1].radiance["key"]
    assert frames[1].radiance["groups"] == ["cold", "warm"]

    fresh = copy.deepcopy(recipe)
    fresh["scene"]["light_groups"] = {"cold": 0.1, "warm": 2.0}
    fresh["quality"] = {"samples_per_pixel": 128, "max_depth": 4}
    # Lamps of both weights are sampled for: the scatter is not that of a rendering for the second alone.
    mean, variance = scatter(fresh, tmp_path / "fresh", 12)
    swept["quality"] = fresh["quality"]
    again, of_again = scatter(swept, tmp_path / "again", 12, index=1)
    check_equal_within_noise(again, mean, (variance + of_again) / 12)
    # The adaptive one has an error of its own: half the sensor's noise in each pixel, over the 16 pixels of a block.
    error = np.sqrt((0.5 / 4) ** 2 * noise_e2(mean, frames[1].sensor["electrons_per_dn"]) + variance.mean() / 6)
    assert np.max(np.abs(blocks(frames[1].electrons) - mean) / error) < LARGEST_SCORE


def test_groups_add_up_to_the_whole(recipe: dict[str, Any], tmp_path: Path) -> None:
    """Within one rendering the images of the groups are parts of the same paths: their sum is exact."""
    recipe["quality"] = {"samples_per_pixel": 16, "max_depth": 4}
    recipe["cameras"][0]["lens"]["diffraction"] = False  # what keeps it from ringing is not linear
    recipe["vary"] = {"grid": {"scene.light_groups": [{"cold": 1, "warm": 0}, {"cold": 0, "warm": 1}, {"cold": 2, "warm": 3}]}}
    cache = LightCache()
    cold, warm, both = (Made(recipe, tmp_path, index, cache=cache).electrons for index in range(3))
    # Single precision of the stored light, and of the electrons in raw.npz.
    np.testing.assert_allclose(2 * cold + 3 * warm, both, rtol=3e-6, atol=1e-6 * float(both.max()))


def test_a_dark_group_lights_nothing(recipe: dict[str, Any], tmp_path: Path) -> None:
    recipe["quality"] = {"samples_per_pixel": 16, "max_depth": 4}
    recipe["scene"]["light_groups"] = {"cold": 0.0, "warm": 0.0}
    dark = Made(recipe, tmp_path)
    assert not np.any(dark.electrons)
    assert dark.steps("main: light groups") == ["skip", "run"]


# Exposures -----------------------------------------------------------------------------------------------------------


def test_exposures_are_rendered_once_and_the_longest_decides_the_samples(
    recipe: dict[str, Any], tmp_path: Path, renders: list[int]
) -> None:
    swept = recipe | {"vary": {"grid": {"cameras[0].sensors[0].exposure.time_s": [0.0005, 0.02]}}}
    cache = LightCache()
    short, long = (Made(swept, tmp_path / "swept", index, cache=cache) for index in range(2))
    assert len(renders) == 1
    np.testing.assert_allclose(40 * short.electrons, long.electrons, rtol=1e-5, atol=1e-4)
    alone = copy.deepcopy(recipe)
    alone["cameras"][0]["sensors"][0]["exposure"]["time_s"] = 0.0005
    needed_alone = Made(alone, tmp_path / "alone").radiance["samples_per_pixel"]
    assert long.radiance["samples_per_pixel"] > needed_alone
    assert long.radiance["noise_target"]["unmet_tiles"] == 0
    assert short.sensor["noise_ratio_rms"] < long.sensor["noise_ratio_rms"] <= 0.5


# Channels and spectra ------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_channels_agree_with_the_spectrum_within_the_error_of_both(recipe: dict[str, Any], tmp_path: Path) -> None:
    recipe["quality"] = {"samples_per_pixel": 128, "max_depth": 4}
    direct = Made(recipe, tmp_path / "direct")
    assert direct.steps("main: spectra") == ["skip"]
    assert not direct.radiance["bands"]
    mean, variance = scatter(recipe, tmp_path / "channels")

    found = []
    for number in range(6):
        made = Made(recipe | {"seed": 200 + number}, tmp_path / f"bands {number}", skip=False)
        found.append(blocks(made.electrons))
        assert made.radiance["bands"]
        assert made.steps("skips") == ["run"]
    spectral, of_bands = np.mean(found, axis=0), np.var(found, axis=0, ddof=1)
    check_equal_within_noise(mean, spectral, (variance + of_bands) / 6)
    # Over the whole picture even their small errors are gone.
    assert spectral.sum() == pytest.approx(mean.sum(), rel=3e-3)


@pytest.mark.slow
def test_channels_are_the_same_with_bands_beside_them(recipe: dict[str, Any], tmp_path: Path) -> None:
    recipe["quality"] = {"samples_per_pixel": 64, "max_depth": 4}
    alone, _ = scatter(recipe, tmp_path / "alone")
    mean, variance = scatter(recipe | {"outputs": ["raw.npz", "irradiance.exr"]}, tmp_path / "beside")
    check_equal_within_noise(alone, mean, 2 * variance / 6)


# What the manifest says ----------------------------------------------------------------------------------------------


@pytest.mark.slow
@pytest.mark.parametrize("ratio", [0.25, 1.0])
def test_stated_noise_is_that_of_repeated_renderings(recipe: dict[str, Any], tmp_path: Path, ratio: float) -> None:
    recipe["quality"] = {"noise_ratio": ratio, "max_depth": 4}
    recipe["cameras"][0]["lens"]["diffraction"] = False  # it would average errors of neighbours
    count = 8
    made = [Made(recipe | {"seed": 300 + n}, tmp_path / str(n)) for n in range(count)]
    target = made[0].radiance["noise_target"]
    assert target["noise_ratio"] == ratio
    assert target["stopped_by"] == "target"
    assert target["unmet_tiles"] == 0
    assert target["predicted_rms"] <= target["predicted_max"] <= ratio
    stated = float(np.sqrt(np.mean([one.sensor["noise_ratio_rms"] ** 2 for one in made])))
    assert stated == pytest.approx(target["predicted_rms"], rel=0.05)
    electrons = np.stack([one.electrons for one in made])
    error = electrons.var(axis=0, ddof=1)
    noise = noise_e2(electrons.mean(axis=0), made[0].sensor["electrons_per_dn"])
    true_rms = float(np.sqrt(error.sum() / noise.sum()))
    # The stated one is of each tile's worst channel, and of where the sampling stopped.
    assert 0.95 * true_rms < stated < 1.8 * true_rms
    assert true_rms < ratio


def test_a_cap_that_stops_too_early_is_told(recipe: dict[str, Any], tmp_path: Path) -> None:
    recipe["quality"] = {"noise_ratio": 0.05, "max_samples_per_pixel": 16, "max_depth": 4}
    made = Made(recipe, tmp_path)
    target = made.radiance["noise_target"]
    assert target["stopped_by"] == "samples"
    assert 0 < target["unmet_tiles"] <= target["tiles"] == 48
    assert target["predicted_max"] > 0.05
    assert any("noise target is not met" in note for note in made.manifest["run"]["notes"])
    assert made.radiance["samples_max"] == 16


def test_cost_is_estimated_before_and_measured_after(recipe: dict[str, Any], tmp_path: Path) -> None:
    made = Made(recipe, tmp_path)
    (render,) = (step for step in made.manifest["plan"] if step["what"] == "main: render")
    assert render["cost"] == "about 0.033 to 8.4 CPU-s"  # 64 x 48 pixels, 16 to 4096 rays, 1.5e6 a second
    run = made.manifest["run"]
    (stage,) = (stage for stage in run["stages"] if stage["stage"] == "main: render")
    assert 0 < stage["cpu_s"] <= run["cpu_s"]


# Nothing skipped -----------------------------------------------------------------------------------------------------


def fullwell(*words: object) -> subprocess.CompletedProcess[str]:
    code = "import sys; from fullwell.cli.main import main; sys.exit(main())"
    return subprocess.run([sys.executable, "-c", code, *map(str, words)], capture_output=True, text=True, check=False)


@pytest.mark.slow
def test_command_line_can_render_and_plan_without_skips(recipe: dict[str, Any], tmp_path: Path) -> None:
    recipe["outputs"] = ["raw.npz", "image.png"]
    recipe["quality"] = {"noise_ratio": 0.3, "max_depth": 4}
    # So coarse that diffraction is left out; the time keeps such pixels from filling up.
    recipe["cameras"][0]["sensors"][0] |= {"pixel_pitch_m": 4e-4, "exposure": {"time_s": 2.5e-7}}
    file = tmp_path / "lamps.json"
    file.write_text(json.dumps(recipe))
    manifests, electrons, pictures = [], [], []
    for folder, words in (("with", ()), ("without", ("--no-skip",))):
        done = fullwell("render", file, "-o", tmp_path / folder, "--no-cache", *words)
        assert done.returncode == 0, done.stderr
        frame = tmp_path / folder / "frames" / "0"
        manifests.append(json.loads((frame / "manifest.json").read_text()))
        raw = encode.decode_raw_npz((frame / "raw.npz").read_bytes())
        assert raw.mean_electrons is not None
        electrons.append(raw.mean_electrons.astype(np.float64))
        pictures.append(encode.decode_rgb_png((frame / "image.png").read_bytes()).astype(np.float64))
    decisions = [{step["what"]: step["decision"] for step in manifest["plan"]} for manifest in manifests]
    assert decisions[0]["main: spectra"] == decisions[0]["main: diffraction"] == "skip"
    assert "skips" not in decisions[0]
    assert decisions[1]["skips"] == decisions[1]["main: spectra"] == decisions[1]["main: diffraction"] == "run"
    assert manifests[0]["frame_digest"] != manifests[1]["frame_digest"]
    # Both err by up to 0.3 of the noise of a pixel, a quarter of that over the 16 pixels of a channel in a block; what is left
    # out may change contrast by 0.005.
    one, other = (blocks(each) for each in electrons)
    electrons_per_dn = manifests[0]["cameras"][0]["sensors"][0]["electrons_per_dn"]
    error = np.sqrt(2 * (0.3 / 4) ** 2 * noise_e2(one, electrons_per_dn)) + 0.005 * one
    print(
        np.percentile(np.abs(one - other) / error, [50, 90, 99, 100]),
        one.mean(),
        other.mean(),
        pictures[0].mean(axis=(0, 1)) - pictures[1].mean(axis=(0, 1)),
    )
    assert np.max(np.abs(one - other) / error) < LARGEST_SCORE
    assert one.mean() == pytest.approx(other.mean(), rel=5e-3)
    assert np.abs(pictures[0].mean(axis=(0, 1)) - pictures[1].mean(axis=(0, 1))).max() < 1.0  # of 255

    again = fullwell("render", file, "-o", tmp_path / "with", "--no-cache", "--no-skip")
    assert again.returncode == 1
    assert "another frame is published" in again.stderr
    planned = fullwell("plan", file, "--no-skip", "--no-cache", "--json")
    assert json.loads(planned.stdout)["plan"] == manifests[1]["plan"]
    table = fullwell("plan", file, "--no-cache")
    assert "expected" in table.stdout
    assert "CPU-s" in table.stdout
