"""What a recipe says about image processing reaches the picture, the raw file and the manifest."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fullwell.dataset import encode
from fullwell.isp import ColourMatrixFit, ToneCurve
from fullwell.schema import build_frame, load_recipe
from fullwell.schema.errors import RecipeError


def recipe(isp: dict[str, Any], outputs: list[str] | None = None, model: str = "imx363") -> dict[str, Any]:
    """Return a grey floor under a warm lamp, 32 x 24 pixels."""
    return {
        "schema": "fullwell/recipe/v1",
        "name": "warm",
        "scene": {
            "objects": [
                {
                    "id": "floor",
                    "geometry": {"kind": "rectangle", "size_m": [20, 20]},
                    "material": {"kind": "diffuse", "reflectance": 0.5},
                }
            ],
            "lights": [
                {"name": "lamp", "kind": "point", "position_m": [0, 0, 9], "luminous_flux_lm": 3e4, "spd": "blackbody:3000K"}
            ],
        },
        "cameras": [
            {
                "pose": {"origin_m": [0, -1, 2], "target_m": [0, 0, 0]},
                "lens": {"kind": "thin_lens", "hfov_deg": 20, "f_number": 2},
                "sensors": [{"model": model, "rows": 24, "cols": 32, "isp": isp}],
            }
        ],
        "outputs": outputs or ["image.png"],
        "quality": {"samples_per_pixel": 4, "max_depth": 2},
    }


def settings(isp: dict[str, Any]) -> Any:
    return build_frame(load_recipe(recipe(isp))).cameras[0].sensors[0].isp


def test_every_field_reaches_the_settings() -> None:
    found = settings(
        {
            "illuminant": "A",
            "white_balance": "white_patch",
            "white_patch_percentile": 97,
            "demosaic": "menon2007",
            "colour_matrix": {"method": "noise_aware", "noise_fraction": 0.1},
            "tone": {"curve": "s_curve", "exposure_ev": 1, "black_point": 0.01, "gamma": 2, "contrast": 3, "pivot": 0.4},
        }
    )
    assert found.illuminant is not None
    assert found.illuminant.source.startswith("CIE illuminant A")
    assert (found.white_balance, found.white_patch_percentile, found.demosaic) == ("white_patch", 97.0, "menon2007")
    assert found.colour_matrix == ColourMatrixFit("noise_aware", 0.1)
    assert found.tone == ToneCurve("s_curve", 1.0, 0.01, 2.0, 3.0, 0.4)


def test_defaults_are_those_of_the_library_and_the_scenes_own_light() -> None:
    found = settings({})
    assert found.illuminant is None
    assert (found.colour_matrix, found.tone, found.white_patch_percentile) == (ColourMatrixFit(), ToneCurve(), 99.0)
    assert settings({"illuminant": "Scene"}).illuminant is None


@pytest.mark.parametrize(
    ("isp", "field"),
    [
        ({"demosaic": "menon"}, r"isp\.demosaic"),
        ({"tone": {"curve": "filmc"}}, r"isp\.tone\.curve"),
        ({"tone": {"gamma": 0}}, r"isp\.tone\.gamma"),
        ({"tone": {"black_point": 1}}, r"isp\.tone\.black_point"),
        ({"colour_matrix": {"noise_fraction": 2}}, r"isp\.colour_matrix\.noise_fraction"),
        ({"white_patch_percentile": 0}, r"isp\.white_patch_percentile"),
        ({"illuminant": "scen"}, r"isp\.illuminant"),
    ],
)
def test_what_cannot_be_is_refused_with_its_field(isp: dict[str, Any], field: str) -> None:
    with pytest.raises(RecipeError, match=field):
        settings(isp)


def test_a_method_that_does_not_suit_the_sensor_is_refused_before_rendering() -> None:
    with pytest.raises(RecipeError, match=r"isp\.demosaic.*bilinear"):
        build_frame(load_recipe(recipe({"demosaic": "menon2007"}, model="ideal-mono")))


def rendered(tmp_path: Path, isp: dict[str, Any], outputs: list[str]) -> tuple[dict[str, Any], dict[str, bytes]]:
    pytest.importorskip("mitsuba")
    from fullwell.pipeline import render_frame
    from fullwell.storage import LocalStore

    store = LocalStore(tmp_path)
    manifest = render_frame(build_frame(load_recipe(recipe(isp, outputs))), store, "frame")
    return manifest, {entry["name"]: store.get(f"frame/{entry['name']}") for entry in manifest["products"]}


def test_a_grey_floor_under_a_warm_lamp_is_grey_and_the_raw_file_says_the_same(tmp_path: Path) -> None:
    rawpy = pytest.importorskip("rawpy")
    manifest, products = rendered(tmp_path, {}, ["image.png", "raw.npz", "raw.dng"])
    means = encode.decode_rgb_png(products["image.png"]).astype(float).mean(axis=(0, 1))
    assert np.ptp(means) < 4, "noise of 768 pixels and codes of 8 bits"
    told = manifest["cameras"][0]["sensors"][0]["isp"]
    assert told["illuminant_xy"] == pytest.approx([0.4369, 0.4041], abs=2e-4)  # of a 3000 K blackbody
    with rawpy.imread(io.BytesIO(products["raw.dng"])) as file:
        np.testing.assert_array_equal(file.raw_image, encode.decode_raw_npz(products["raw.npz"]).dn)
        np.testing.assert_allclose(file.camera_whitebalance[:3], told["channel_gain_ratio"], rtol=1e-5)


def test_daylight_settings_show_a_warm_lamp_as_warm(tmp_path: Path) -> None:
    _, products = rendered(tmp_path, {"illuminant": "d65"}, ["image.png"])
    red, green, blue = encode.decode_rgb_png(products["image.png"]).astype(float).mean(axis=(0, 1))
    assert red > green > blue
