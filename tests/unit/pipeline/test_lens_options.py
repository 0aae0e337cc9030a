"""Lenses other than ideal ones, asked for in a recipe."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from fullwell.dataset import encode
from fullwell.optics import gaussian_psf, write_psf
from fullwell.pipeline import LightCache, plan_frame, render_frame
from fullwell.schema import RecipeError, build_frame, load_recipe
from fullwell.storage import LocalStore


def irradiance(
    recipe: dict[str, Any], folder: Path, *, base_dir: Path | None = None, cache: LightCache | None = None, **lens: Any
) -> np.ndarray:
    changed = copy.deepcopy(recipe) | {"outputs": ["irradiance.exr"]}
    changed["cameras"][0]["lens"] |= lens
    store = LocalStore(folder / str(abs(hash(str(lens)))))
    render_frame(build_frame(load_recipe(changed), base_dir=base_dir), store, "f", cache=cache)
    return encode.decode_irradiance_exr(store.get("f/irradiance.exr")).photons.sum(axis=2)


def contrast(image: np.ndarray) -> float:
    return float(np.std(np.diff(image, axis=1)) / image.mean())


BLURS: list[dict[str, Any]] = [
    {"wavefront": {"zernike": [{"index": 4, "rms_m": 3e-6}]}},
    {"wavefront": {"defocus_dioptre": 2000.0}},
    {"psf": {"gaussian_sigma_m": 4e-6}},
    {"psf": {"disc_diameter_m": 1e-5}},
]


@pytest.mark.slow
@pytest.mark.parametrize("blur", BLURS, ids=["zernike", "dioptre", "gaussian", "disc"])
def test_blur_of_the_lens_lowers_contrast_and_keeps_the_light(
    recipe: dict[str, Any], tmp_path: Path, blur: dict[str, Any]
) -> None:
    cache = LightCache()
    sharp = irradiance(recipe, tmp_path, cache=cache)
    blurred = irradiance(recipe, tmp_path, cache=cache, **blur)
    assert contrast(blurred) < 0.9 * contrast(sharp)
    assert blurred.mean() == pytest.approx(sharp.mean(), rel=0.02)


@pytest.mark.slow
def test_aperture_blades_and_dust_spread_light(recipe: dict[str, Any], tmp_path: Path) -> None:
    cache = LightCache()
    clean = irradiance(recipe, tmp_path, cache=cache)
    flared = irradiance(recipe, tmp_path, cache=cache, aperture={"blades": 6, "scratches": 50, "dust_grains": 20})
    assert not np.array_equal(clean, flared)
    assert flared.mean() == pytest.approx(clean.mean(), rel=0.02)


def test_point_image_from_a_file_is_the_same_as_the_built_in_one(recipe: dict[str, Any], tmp_path: Path) -> None:
    write_psf(tmp_path / "lens.npz", gaussian_psf(4e-6))
    cache = LightCache()
    built_in = irradiance(recipe, tmp_path, cache=cache, psf={"gaussian_sigma_m": 4e-6})
    from_file = irradiance(recipe, tmp_path, cache=cache, base_dir=tmp_path, psf={"file": "lens.npz"})
    assert from_file == pytest.approx(built_in, rel=1e-6)


def test_depth_of_field_by_layers_agrees_with_the_rendered_one(recipe: dict[str, Any], tmp_path: Path) -> None:
    recipe["cameras"][0]["sensors"][0] |= {"pixel_pitch_m": 4e-3, "rows": 32, "cols": 48}  # a pupil of 0.36 m: 5 px of blur
    recipe["quality"]["samples_per_pixel"] = 256
    lens = {"f_number": 1.0, "focus_distance_m": 3.0}
    rendered = irradiance(recipe, tmp_path, **lens)
    layered = irradiance(recipe, tmp_path, **lens, depth_of_field="layers")
    sharp = irradiance(recipe, tmp_path, **lens, kind="pinhole")
    blur = float(np.abs(rendered - sharp).mean() / rendered.mean())
    left = float(np.abs(rendered - layered).mean() / rendered.mean())
    assert blur > 0.05
    assert left < 0.35 * blur


def test_layers_of_many_focus_distances_share_one_rendering(recipe: dict[str, Any]) -> None:
    recipe["cameras"][0]["lens"] |= {"depth_of_field": "layers", "focus_distance_m": 2.0}
    frame = build_frame(load_recipe(recipe))
    assert frame.cameras[0].camera.lens.kind == "pinhole"
    assert frame.cameras[0].depth_layers
    assert any(step.what == "main: depth of field" and "layers" in step.why for step in plan_frame(frame).steps)


@pytest.mark.parametrize(
    ("lens", "expected"),
    [
        ({"kind": "pinhole", "depth_of_field": "layers"}, r"depth_of_field.*pinhole has no depth of field"),
        ({"psf": {"gaussian_sigma_m": 1e-6}, "aperture": {"blades": 6}}, r"lens\.psf.*remove it"),
        ({"psf": {}}, r"lens\.psf"),
        ({"psf": {"gaussian_sigma_m": -1.0}}, r"gaussian_sigma_m is -1"),
        ({"psf": {"file": "no.npz"}}, r"psf\.file"),
        ({"aperture": {"blades": 2}}, r"blades is 2; must be 0"),
        ({"aperture": {"blads": 6}}, r"did you mean blades"),
        ({"wavefront": {"zernike": [{"index": 4, "rms_m": 1e-7}, {"index": 4, "rms_m": 1e-7}]}}, r"given twice"),
        ({"wavefront": {"zernike": [{"index": 4, "rms_m": float("nan")}]}}, r"rms_m is nan"),
        ({"diffraction": False, "aperture": {"blades": 6}}, r"diffraction is false"),
    ],
)
def test_nonsense_of_the_lens_is_refused_by_name(
    recipe: dict[str, Any], tmp_path: Path, lens: dict[str, Any], expected: str
) -> None:
    recipe["cameras"][0]["lens"] |= lens
    with pytest.raises(RecipeError, match=expected):
        build_frame(load_recipe(recipe), base_dir=tmp_path)


def test_the_cameras_model_can_be_isetcams(recipe: dict[str, Any], tmp_path: Path) -> None:
    recipe["cameras"][0] |= {"model": "isetcam"}
    recipe["cameras"][0]["lens"] = {"kind": "pinhole", "hfov_deg": 30, "f_number": 2, "focus_distance_m": 5.8}
    recipe["cameras"][0]["sensors"][0]["model"] = "imx363-isetcam"
    store = LocalStore(tmp_path)
    manifest = render_frame(build_frame(load_recipe(recipe)), store, "f")
    assert manifest["cameras"][0]["model"] == "isetcam"
    assert manifest["cameras"][0]["sensors"][0]["white_level_dn"] == 1024
    optical = encode.decode_irradiance_exr(store.get("f/irradiance.exr"))
    assert (optical.rows, optical.cols) == (20, 30)  # a dark border of an eighth on each side
    raw = encode.decode_raw_npz(store.get("f/raw.npz"))
    assert raw.dn.shape == (16, 24)
    assert raw.dn.max() > raw.black_level_dn


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ({}, r"cameras\[0\]\.lens\.kind is 'thin_lens'"),
        ({"kind": "pinhole"}, r"focus_distance_m is missing"),
        (
            {"kind": "pinhole", "focus_distance_m": 5.0, "aperture": {"blades": 6}},
            r"lens\.aperture is not part of model isetcam",
        ),
    ],
)
def test_what_isetcam_does_not_know_is_refused(recipe: dict[str, Any], changes: dict[str, Any], expected: str) -> None:
    recipe["cameras"][0]["model"] = "isetcam"
    recipe["cameras"][0]["lens"] |= changes
    with pytest.raises(RecipeError, match=expected):
        load_recipe(recipe)
