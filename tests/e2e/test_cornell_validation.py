"""The validation on the Cornell box: its script runs, and the relations that its page states hold, here and as published."""

from __future__ import annotations

import json
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from PIL import Image

from fullwell.render import choose_variant

VALIDATION = Path(__file__).resolve().parents[2] / "docs" / "validation"
FIGURES = {"cornell_bleeding.png", "cornell_focus.png", "cornell_falloff.png", "cornell_patches.png", "cornell_noise.png"}
LARGEST_FIGURE_BYTES = 150_000

QUICK_RENDER_PERCENT = 1.0
"""Root mean square over block channels, and over places on the wall: four times the Monte-Carlo error of --quick."""

MTF_TOLERANCE = 0.015
"""Up to Nyquist: the promised 0.01, and the Monte-Carlo error of --quick."""

PEAK_TOLERANCE = 0.01
"""Of the focus distance; the edges measured stand at equal distances in dioptres on both sides of it."""

FALLOFF_TOLERANCE = 5e-4
"""Of the value on the axis; single precision and the Monte-Carlo error of a uniform field."""

BANDS_PERCENT = 0.1
"""Root mean square over patches and channels under smooth lights; lines of FL11 need more than the samples of --quick."""

LARGEST_SCORE = 4.8
"""Standard errors. The worst of 600 comparisons lies beyond it once in 1000 runs."""

RMS_SCORE = (0.7, 1.3)
"""Standard errors, root mean square of 20 rings or more."""


def check_bleeding(found: dict[str, Any], percent: float) -> None:
    assert found["direct_light_against_closed_form"]["rms_percent"] < percent
    assert found["blocks_against_pbrt"]["rms_percent"] < percent
    assert abs(found["blocks_against_pbrt"]["mean_percent"]) < percent / 4
    for line in ("line_A", "line_B"):
        assert found[line]["r_over_g_at_red_wall"] > 1.1
        assert found[line]["r_over_g_at_green_wall"] < 0.99
        share = found[line]["inter_reflected_share"]
        assert 0.5 > share["R"] > share["G"] > share["B"] > 0.1


def check_focus(found: dict[str, Any]) -> None:
    for distance_m in (0.3, 0.5):
        focus = found[f"focus_{distance_m:g}_m"]
        assert focus["sharpest_distance_m"] == pytest.approx(distance_m)
        assert focus["fitted_peak_m"] == pytest.approx(distance_m, rel=PEAK_TOLERANCE)
        assert focus["largest_mtf_difference_up_to_nyquist"] < MTF_TOLERANCE
        for point in focus["points"]:
            # Diffraction and defocus are one effect of the pupil; their product is the more pessimistic.
            assert point["closed_form"] <= point["wave_optics"] * 1.001
            assert point["raw_frames_demosaiced"] < point["raw_frames"] * 1.02


def check_falloff(found: dict[str, Any]) -> None:
    for case in found.values():
        assert case["noise_free_largest_difference"] < FALLOFF_TOLERANCE
        assert case["rings_largest_z"] < LARGEST_SCORE
    assert found["pinhole"]["corner_ratio_expected"] == pytest.approx(found["pinhole"]["cos4_at_corner"], abs=1e-3)
    assert found["thin lens, f/0.95"]["corner_ratio_expected"] > found["thin lens, f/1.73"]["corner_ratio_expected"]


def check_patches(found: dict[str, Any]) -> None:
    for light in ("D65", "A"):
        assert found[light]["against_sum_over_bands"]["rms_percent"] < BANDS_PERCENT
    for light in ("D65", "A", "FL11"):
        assert RMS_SCORE[0] < found[light]["raw_rms_z"] < RMS_SCORE[1]
        assert found[light]["raw_largest_z"] < LARGEST_SCORE


def check_noise(found: dict[str, Any]) -> None:
    for name in ("gain_e_per_dn", "read_noise_dn", "prnu_percent"):
        parameter = found[name]
        assert abs(parameter["found"] - parameter["put_in"]) < LARGEST_SCORE * parameter["standard_error"]
    for name in ("temporal", "total", "chart_temporal"):
        assert RMS_SCORE[0] < found[f"{name}_rms_z"] < RMS_SCORE[1]
        assert found[f"{name}_largest_z"] < LARGEST_SCORE


@pytest.mark.slow
def test_the_validation_runs_and_its_relations_hold(tmp_path: Path) -> None:
    if choose_variant().variant != "llvm_ad_spectral":
        pytest.skip("the scalar fallback would need minutes for these errors")
    script = VALIDATION / "cornell_box.py"
    subprocess.run([sys.executable, str(script), "--quick", str(tmp_path)], check=True, capture_output=True)
    assert {path.name for path in tmp_path.glob("*.png")} == FIGURES
    numbers = json.loads((tmp_path / "cornell_box.json").read_text())
    check_bleeding(numbers["bleeding"], QUICK_RENDER_PERCENT)
    check_focus(numbers["focus"])
    check_falloff(numbers["falloff"])
    check_patches(numbers["patches"])
    check_noise(numbers["noise"])


def test_the_published_numbers_hold_the_same_relations() -> None:
    numbers = json.loads((VALIDATION / "figures" / "cornell_box.json").read_text())
    check_bleeding(numbers["bleeding"], QUICK_RENDER_PERCENT / 2)
    check_focus(numbers["focus"])
    check_falloff(numbers["falloff"])
    check_patches(numbers["patches"])
    check_noise(numbers["noise"])


def test_the_page_shows_every_figure_and_each_is_small() -> None:
    shown = set(re.findall(r"\(figures/(cornell_\w+\.png)\)", (VALIDATION / "cornell_box.md").read_text()))
    assert shown == FIGURES
    for name in FIGURES:
        path = VALIDATION / "figures" / name
        assert path.stat().st_size < LARGEST_FIGURE_BYTES
        with Image.open(path) as picture:
            assert picture.mode == "P"
