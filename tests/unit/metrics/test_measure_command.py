"""`fullwell measure` on a frame folder whose products are written here."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typer
from scipy.special import erf
from typer.testing import CliRunner

from fullwell.cli import measure
from fullwell.core.errors import FieldError, FullwellError, NotFoundError
from fullwell.dataset.encode import encode_depth_exr, encode_json, encode_raw_npz, encode_rgb_png
from fullwell.isp.colour_matrix import adapted_srgb_targets
from fullwell.isp.tone import encode_srgb
from fullwell.radiometry import DEFAULT_GRID, illuminant
from fullwell.scene.images import RawImage
from fullwell.sensor import sensor

ROWS, COLS = 96, 120
SIGMA_PX = 0.8
CORNERS = "0,0,120,0,120,96,0,96"

RECIPE: dict[str, Any] = {
    "schema": "fullwell/recipe/v1",
    "name": "measured",
    "seed": 1,
    "scene": {
        "objects": [
            {
                "id": "card",
                "class": "card",
                "geometry": {"kind": "rectangle", "size_m": [1, 1]},
                "material": {"kind": "diffuse", "reflectance": 0.5},
            }
        ],
        "lights": [{"name": "sky", "kind": "constant_environment", "luminance_cd_m2": 100, "spd": "D65"}],
    },
    "cameras": [
        {
            "name": "main",
            "pose": {"origin_m": [0, -2, 0], "target_m": [0, 0, 0]},
            "lens": {"hfov_deg": 20, "f_number": 2},
            "sensors": [
                {
                    "name": "phone",
                    "model": "imx363",
                    "rows": ROWS,
                    "cols": COLS,
                    "exposure": {"time_s": 0.01},
                    "isp": {"illuminant": "d65"},
                }
            ],
        }
    ],
    "outputs": ["raw.npz", "image.png"],
}


@pytest.fixture
def frame(tmp_path: Path) -> Path:
    """A slanted edge in raw.npz, a perfect chart under D65 at half exposure in image.png, and depths."""
    row, col = np.mgrid[:ROWS, :COLS]
    across = (col - 60.2 - 0.1 * (row - 48)) / np.hypot(1, 0.1)
    clean = 64 + 100 + 500 * 0.5 * (1 + erf(across / SIGMA_PX / np.sqrt(2)))
    model = sensor("imx363")
    raw = RawImage(
        dn=np.rint(clean + np.random.default_rng(0).normal(0, 2, clean.shape)).astype(np.uint16),
        pattern=model.cfa.pattern,
        channels=model.cfa.channels,
        grid=DEFAULT_GRID,
        black_level_dn=64.0,
        white_level_dn=1023.0,
        exposure_time_s=0.01,
        sensor_name="imx363",
        adc_bits=10,
        saturated_fraction=0.0,
        mean_electrons=((clean - 64) * 5).astype(np.float32),
    )
    chart = np.clip(adapted_srgb_targets(illuminant("D65"), adapt_white=True)[1:].reshape(4, 6, 3) * 0.5, 0, 1)
    depth = np.full((ROWS, COLS), 2.0, np.float32)
    depth[0] = np.inf
    products = {
        "raw.npz": encode_raw_npz(raw),
        "image.png": encode_rgb_png(np.kron(encode_srgb(chart), np.ones((24, 20, 1), np.uint8))),
        "depth.exr": encode_depth_exr(depth, depth * np.float32(1.5)),
        "manifest.json": encode_json(
            {
                "recipe": RECIPE,
                "wavelengths_nm": {"first": 400.0, "last": 700.0, "step": 10.0},
                "cameras": [
                    {
                        "name": "main",
                        "sensors": [{"name": "phone", "pixel_pitch_m": 1.4e-6, "lens": {"f_number": 2.0}, "model": "imx363"}],
                    }
                ],
            }
        ),
    }
    for name, content in products.items():
        (tmp_path / name).write_bytes(content)
    return tmp_path


def _run(*words: str | Path) -> Any:
    app = typer.Typer(pretty_exceptions_enable=False)
    measure.register(app)
    result = CliRunner().invoke(app, [str(word) for word in words], catch_exceptions=True)
    if isinstance(result.exception, FullwellError):
        raise result.exception
    assert result.exit_code == 0, result.output
    return result.output


def _report(*words: str | Path) -> dict[str, Any]:
    report: dict[str, Any] = json.loads(_run(*words, "--json"))
    return report


def test_levels_exposure_and_sensor_figures_are_reported(frame: Path) -> None:
    report = _report(frame)
    assert report["notes"] == []
    assert report["exposure"]["exposure_value"] == pytest.approx(np.log2(4 / 0.01))
    assert [channel["channel"] for channel in report["levels"]["channels"]] == ["R", "G", "B"]
    assert report["depth"] == {
        "hit_fraction": pytest.approx(95 / 96),
        "nearest_m": 3.0,
        "median_m": 3.0,
        "farthest_m": 3.0,
    }
    model = sensor("imx363")
    step_e = model.voltage_swing_v / 1023 / model.conversion_gain_v_per_e
    threshold = 0.5 + np.sqrt(0.25 + model.read_noise_e**2 + step_e**2 / 12)
    assert report["sensor_figures"]["absolute_sensitivity_threshold_e"] == pytest.approx(threshold)
    assert {row["channel"] for row in report["sensor_figures"]["at_median_signal"]} == {"R", "G", "B"}


@pytest.mark.parametrize("channel", ["R", "G", "B"])
def test_the_edge_gives_mtf50_per_pixel_and_per_millimetre(frame: Path, channel: str) -> None:
    edge = _report(frame, "--edge", "21,5,101,93", "--channel", channel)["edge"]
    analytic = np.sqrt(np.log(2) / 2) / (np.pi * SIGMA_PX)
    noise = 0.03  # 2 DN on a step of 500, a quarter of the pixels
    assert edge["mtf50_cycles_per_px"] == pytest.approx(analytic, rel=noise)
    assert edge["mtf50_cycles_per_mm"] == pytest.approx(edge["mtf50_cycles_per_px"] / 1.4e-3)
    assert edge["edge_step_dn"] == pytest.approx(500, rel=0.01)


def test_green_is_measured_where_no_channel_is_named(frame: Path) -> None:
    assert _report(frame, "--edge", "20,4,100,92")["edge"]["channel"] == "G"


def test_a_perfect_chart_differs_by_eight_bits_and_what_srgb_cannot_show(frame: Path) -> None:
    patches = _report(frame, "--patches", "colorchecker", "--corners", CORNERS)["patches"]
    assert patches["exposure_factor"] == pytest.approx(2.0, rel=0.01)
    eight_bits = 1.0
    for patch in patches["patches"]:
        limit = 5.0 if patch["name"] == "cyan" else eight_bits  # cyan lies outside sRGB and is clipped
        assert patch["delta_e_2000"] < limit, patch["name"]


def test_another_light_makes_a_difference(frame: Path) -> None:
    words = (frame, "--patches", "colorchecker", "--corners", CORNERS)
    assert (
        _report(*words, "--illuminant", "A")["patches"]["mean_delta_e_2000"]
        > _report(*words)["patches"]["mean_delta_e_2000"] + 1
    )


def test_a_picture_made_for_the_scenes_own_light_is_compared_under_it(frame: Path) -> None:
    """The scene is lit by D65, so that nothing changes; the name says where the light came from."""
    words = (frame, "--patches", "colorchecker", "--corners", CORNERS)
    named = _report(*words)["patches"]
    manifest = json.loads((frame / "manifest.json").read_text())
    manifest["recipe"]["cameras"][0]["sensors"][0]["isp"]["illuminant"] = "scene"
    (frame / "manifest.json").write_text(json.dumps(manifest))
    found = _report(*words)["patches"]
    assert found["illuminant"] != named["illuminant"]
    bands_of_another_grid = 0.1
    assert found["mean_delta_e_2000"] == pytest.approx(named["mean_delta_e_2000"], abs=bands_of_another_grid)


def test_a_flat_field_has_its_falloff_reported(frame: Path) -> None:
    falloff = _report(frame, "--flat")["relative_illumination"]
    assert [row["channel"] for row in falloff] == ["R", "G", "B"]
    assert all(len(row["ratio"]) == 10 for row in falloff)


def test_the_tables_are_readable(frame: Path) -> None:
    words = (frame, "--edge", "20,4,100,92", "--flat", "--patches", "colorchecker", "--corners", CORNERS)
    text = _run(*words)
    for expected in ("MTF50", "dynamic range", "exposure value", "neutral_5", "corner over axis"):
        assert expected in text


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--edge", "0,0,40"], "must be 4 numbers"),
        (["--edge", "0,0,a,40"], "must be 4 numbers"),
        (["--edge", "0,0,40.5,40"], "whole pixels"),
        (["--edge", "0,0,400,40"], "leaves the image"),
        (["--edge", "0,0,30,90"], "no edge crosses"),
        (["--edge", "20,4,100,92", "--channel", "W"], "channel 'W'"),
        (["--edge", "20,4,100,92", "--window", "hann"], "window 'hann'"),
        (["--region", "5,5,5,9"], "empty"),
        (["--camera", "mein"], "did you mean 'main'"),
        (["--sensor", "fone"], "did you mean 'phone'"),
        (["--patches", "colorchecker"], "needs --corners"),
        (["--patches", "colourchecker", "--corners", CORNERS], "did you mean 'colorchecker'"),
        (["--patches", "colorchecker", "--corners", "1,2,3"], "must be 8 numbers"),
        (["--patches", "colorchecker", "--corners", CORNERS, "--illuminant", "D64"], "did you mean"),
    ],
)
def test_nonsense_is_answered_with_what_is_legal(frame: Path, words: list[str], message: str) -> None:
    with pytest.raises(FieldError, match=message):
        _run(frame, *words)


def test_missing_products_are_named(frame: Path) -> None:
    (frame / "raw.npz").unlink()
    assert any("raw.npz" in note for note in _report(frame)["notes"])
    with pytest.raises(NotFoundError, match=r"raw\.npz"):
        _run(frame, "--edge", "20,4,100,92")
    (frame / "image.png").unlink()
    with pytest.raises(NotFoundError, match=r"image\.png"):
        _run(frame, "--patches", "colorchecker", "--corners", CORNERS)


def test_a_recipe_that_can_no_longer_be_read_costs_the_sensor_figures_only(frame: Path) -> None:
    manifest = json.loads((frame / "manifest.json").read_text())
    manifest["recipe"]["cameras"][0]["sensors"][0]["model"] = "imx999"
    (frame / "manifest.json").write_text(json.dumps(manifest))
    report = _report(frame)
    assert report["sensor_figures"] is None
    assert any("imx999" in note for note in report["notes"])
    assert report["levels"]["channels"]


def test_a_saturated_edge_is_noted(frame: Path) -> None:
    from fullwell.dataset.encode import decode_raw_npz

    raw = decode_raw_npz((frame / "raw.npz").read_bytes())
    (frame / "raw.npz").write_bytes(encode_raw_npz(replace(raw, dn=np.minimum(raw.dn, 640), white_level_dn=640.0)))
    assert any("saturated" in note for note in _report(frame, "--edge", "20,4,100,92")["notes"])
