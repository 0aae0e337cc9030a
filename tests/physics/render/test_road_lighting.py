"""A lit street of the traffic generator, measured as a road is: EN 13201-3's observer, field and figures."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from test_analytic_scenes import pytestmark  # noqa: F401

from assets_in_memory import MemoryAssets
from fullwell.assets.starter.library import prepare_starter, starter_entry
from fullwell.core.errors import FullwellError
from fullwell.scene import Mesh
from fullwell.traffic.luminaires import luminaire_pattern

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT))  # benchmarks/ is no part of the distribution

from benchmarks.road_lighting import measure, recipe, street  # noqa: E402

CLASSES_CD_M2 = (0.3, 2.0)
"""Mean luminances of classes M6 and M1 of EN 13201-2."""

LEAST_OVERALL, LEAST_LENGTHWISE = 0.4, 0.4
"""Uniformities of classes M1 to M5; M3 asks for 0.6 along the lane, M4 for 0.6, M5 and M6 for 0.4."""


@pytest.fixture(scope="module")
def assets(tmp_path_factory: pytest.TempPathFactory) -> MemoryAssets:
    try:
        light = prepare_starter(starter_entry("street-light-led-8"))
    except FullwellError as error:
        pytest.skip(f"the starter library's lights cannot be made here: {error}")
    return MemoryAssets(light, folder=tmp_path_factory.mktemp("lights"))


@pytest.mark.parametrize("style", ["city", "suburb"])
def test_a_street_with_led_lights_is_lit_as_a_class_of_roads_asks(assets: MemoryAssets, style: str) -> None:
    light = measure(street(recipe(style), assets), samples=64)
    assert CLASSES_CD_M2[0] < light.luminance_cd_m2 < CLASSES_CD_M2[1]
    assert light.overall > LEAST_OVERALL
    assert light.lengthwise > LEAST_LENGTHWISE
    # What asphalt returns: mean luminance coefficients of 0.03 to 0.1 cd m^-2 per lx.
    assert 0.03 < light.luminance_cd_m2 / light.illuminance_lux < 0.1
    assert light.flux_lm == pytest.approx(6500, rel=1e-3)


def test_a_luminaires_pattern_keeps_its_flux_and_looks_where_the_road_is(assets: MemoryAssets) -> None:
    scene = street(recipe("city"), assets)
    (lamp,) = {id(part): part for item in scene.objects for part in item.parts if part.emission is not None}.values()
    assert isinstance(lamp.geometry, Mesh)
    corners = lamp.geometry.vertices_m[lamp.geometry.faces.astype(np.int64)]
    pattern = luminaire_pattern(corners)
    assert pattern is not None
    areas = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) / 2
    shown = np.maximum(np.einsum("rcx,nx->rcn", pattern.directions(), areas), 0.0).sum(axis=2)
    intensity = pattern.shares * shown
    cells = np.cos(pattern.elevations_rad())[:, None] * np.ones(intensity.shape[1])
    rows, cols = pattern.steps_rad()
    ends = np.ones(intensity.shape[1])
    ends[[0, -1]] = 0.5  # both columns at 180 degrees are one direction
    flux = float((intensity * cells * ends).sum() * rows * cols)
    assert flux == pytest.approx(np.pi * float(np.linalg.norm(areas, axis=1).sum()), rel=0.02)
    brightest = np.unravel_index(np.argmax(intensity), intensity.shape)
    azimuth, elevation = np.degrees(pattern.azimuths_rad()[brightest[1]]), np.degrees(pattern.elevations_rad()[brightest[0]])
    assert 45 < abs(azimuth) < 100  # along the road
    assert -40 < elevation < -20  # 50 to 70 degrees from straight down


def test_a_wet_road_mirrors_the_lamps_and_is_darker_between(assets: MemoryAssets) -> None:
    dry, wet = (measure(street(recipe("city", wet=value), assets), samples=64) for value in (False, True))
    assert wet.illuminance_lux == pytest.approx(dry.illuminance_lux, rel=1e-6)
    assert wet.overall < 0.7 * dry.overall
