"""Frames of sensors with several captures, and of every filter pattern: products and what the manifest says of them."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fullwell.dataset import encode
from fullwell.pipeline.frame import render_frame
from fullwell.schema import build_frame, load_recipe
from fullwell.storage import LocalStore

SIZE = {"rows": 16, "cols": 24}


def rendered(
    recipe: dict[str, Any], tmp_path: Path, outputs: tuple[str, ...], sensors: list[dict[str, Any]]
) -> tuple[Any, Any]:
    recipe["outputs"] = list(outputs)
    recipe["cameras"][0]["sensors"] = sensors
    store = LocalStore(tmp_path)
    return render_frame(build_frame(load_recipe(recipe)), store, "f"), store


def test_the_manifest_tells_captures_and_row_times(recipe: dict[str, Any], tmp_path: Path) -> None:
    bracket = {"auto": {"method": "luminance"}, "bracket": {"ratios": [1, 0.1]}}
    sensors = [
        {"name": "split", "model": "imx490", **SIZE, "exposure": {"time_s": 0.002}, "line_time_s": 2e-5, "serial": 4},
        {"name": "rccc", "model": "ar0132at-rccc", **SIZE, "exposure": bracket},
        {"name": "ratios", "model": "imx363", **SIZE, "exposure": {"time_s": 0.004, "channel_ratios": {"R": 1.5, "B": 2}}},
    ]
    manifest, store = rendered(recipe, tmp_path, ("raw.npz", "raw.tiff", "image.png"), sensors)
    split, rccc, ratios = manifest["cameras"][0]["sensors"]
    assert [(c["photodiode"], c["readout"]) for c in split["captures"]] == [
        ("large", "high"),
        ("large", "low"),
        ("small", "high"),
        ("small", "low"),
    ]
    assert split["shutter"]["kind"] == "rolling"
    assert split["shutter"]["last_row_middle_s"] == pytest.approx(15 * 2e-5 + 0.001)
    assert (split["serial"], split["adc_bits"]) == (4, 17)
    assert [c["exposure_time_s"] for c in rccc["captures"]] == pytest.approx(
        [rccc["exposure_time_s"], rccc["exposure_time_s"] / 10]
    )
    assert ratios["channel_exposure_time_s"] == pytest.approx({"R": 0.006, "G": 0.004, "B": 0.008})
    raw = encode.decode_raw_npz(store.get("f/split/raw.npz"))
    signal_e = (raw.dn.astype(float) - raw.black_level_dn) * split["electrons_per_dn"]
    assert raw.mean_electrons is not None
    assert np.mean(signal_e) == pytest.approx(float(np.mean(raw.mean_electrons)), rel=0.02)
    tiff, _ = encode.decode_raw_tiff(store.get("f/split/raw.tiff"))
    np.testing.assert_array_equal(tiff, raw.dn)


@pytest.mark.parametrize("pattern", ["mono", "rccc", "rccb", "ryycy", "rgbw", "rgb-nir", "quad-rggb", "quad-ryycy", "gbrg"])
def test_every_filter_pattern_gives_a_picture(recipe: dict[str, Any], tmp_path: Path, pattern: str) -> None:
    cfa = {"pattern": pattern, "channels": "representative", "ir_cut_nm": 690}
    sensors = [{"model": "mt9v024-rgb", **SIZE, "cfa": cfa, "exposure": {"auto": {}}}]
    manifest, store = rendered(recipe, tmp_path, ("image.png", "raw.npz"), sensors)
    assert encode.decode_rgb_png(store.get("f/image.png")).shape == (16, 24, 3)
    assert manifest["cameras"][0]["sensors"][0]["shutter"]["kind"] == "global"
