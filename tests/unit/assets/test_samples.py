"""Real model files made by others (see the samples folder's README); FULLWELL_SAMPLES_DIR says where they are."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from fullwell.assets import LoadedModel, load_model

pytest.importorskip("trimesh")
pytest.importorskip("pxr")

REPOSITORY = Path(__file__).parents[3]
SAMPLES = Path(os.environ.get("FULLWELL_SAMPLES_DIR", REPOSITORY.parent / "shared" / "samples"))


@pytest.fixture(scope="module")
def samples() -> Path:
    if not SAMPLES.is_dir():
        message = f"{SAMPLES} does not exist; set FULLWELL_SAMPLES_DIR"
        if os.environ.get("FULLWELL_REQUIRE_ALL") == "1":
            pytest.fail(message)
        pytest.skip(message)
    return SAMPLES


def check(model: LoadedModel) -> None:
    assert model.parts
    for part in model.parts:
        assert np.all(np.isfinite(part.vertices_m))
        assert part.faces.max() < len(part.vertices_m)
        if part.normals is not None:
            assert np.allclose(np.linalg.norm(part.normals, axis=1), 1)


def test_every_glb_sample_is_read(samples: Path) -> None:
    files = sorted(samples.glob("kenney_*/*.glb"))
    assert len(files) == 18
    for file in files:
        model = load_model(file)
        check(model)
        assert model.bounds_m[0, 2] > -0.1, "toys stand on the ground"
        assert all(part.base_color_texture is not None for part in model.parts)


@pytest.mark.slow
def test_every_usd_sample_with_geometry_is_read(samples: Path) -> None:
    kit = samples / "usd_mini_car_kit"
    files = sorted(file for file in kit.rglob("*.usd*") if file.parent.name != "materials")
    assert len(files) == 25
    for file in files:
        check(load_model(file, root=kit))


def test_the_sedan_has_a_body_and_four_wheels_in_its_materials(samples: Path) -> None:
    file = samples / "usd_mini_car_kit" / "assets" / "vehicles" / "sedan" / "asset" / "sedanFullAsset.usda"
    model = load_model(file, unit_m=0.01)
    wheels = {part.name.split("/")[2] for part in model.parts} - {"Sedan"}
    assert wheels == {"wheel1", "wheel2", "wheel3", "wheel4"}
    red = next(part for part in model.parts if "redMax" in part.name)
    assert red.base_color_srgb[0] > 2 * red.base_color_srgb[1]
    assert np.allclose(model.bounds_m[1] - model.bounds_m[0], [2.26, 4.67, 2.26], atol=0.01)
