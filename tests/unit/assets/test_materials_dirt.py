"""Dirt on materials: area-weighted reflectances, less and wider gloss, no energy made."""

from __future__ import annotations

import numpy as np
import pytest

from fullwell.assets.materials.catalogue import asset_material, asset_material_names
from fullwell.assets.materials.curves import WAVELENGTH_NM
from fullwell.assets.materials.dirt import MOST_COAT, dirty_coat, dirty_reflectance, dust, grime
from fullwell.assets.materials.surface import body_seen_through_coat
from fullwell.radiometry import Spectrum

PAINTS = [name for name in asset_material_names() if name.startswith("paint/")]
SHARES = (0.1, 0.4, 0.7, MOST_COAT)


def seen(body: Spectrum, index: float) -> np.ndarray:
    return body_seen_through_coat(body.at(WAVELENGTH_NM), index)


def gloss(index: float) -> float:
    return ((index - 1) / (index + 1)) ** 2


def paint(name: str) -> tuple[Spectrum, float, float]:
    entry = asset_material(name)
    assert entry.reflectance is not None
    return entry.reflectance, entry.roughness, entry.interior_index


@pytest.mark.parametrize("coverage", SHARES)
@pytest.mark.parametrize("name", PAINTS)
def test_a_dirty_coat_looks_like_its_area_weighted_parts(name: str, coverage: float) -> None:
    body, roughness, index = paint(name)
    dirty = dirty_coat(body, roughness, index, dust(), coverage)
    expected = (1 - coverage) * seen(body, index) + coverage * dust().at(WAVELENGTH_NM)
    assert seen(dirty.body, dirty.interior_index) == pytest.approx(expected, abs=1e-9)
    assert gloss(dirty.interior_index) == pytest.approx((1 - coverage) * gloss(index), rel=1e-9)


@pytest.mark.parametrize("name", PAINTS)
def test_clean_is_the_limit_of_little_dirt(name: str) -> None:
    body, roughness, index = paint(name)
    clean = dirty_coat(body, roughness, index, dust(), 0.0)
    assert clean.body.at(WAVELENGTH_NM) == pytest.approx(body.at(WAVELENGTH_NM), abs=1e-12)
    assert (clean.roughness, clean.interior_index) == pytest.approx((roughness, index))


def test_a_surface_under_dirt_is_dirt() -> None:
    white, _, _ = paint("paint/white")
    assert dirty_reflectance(white, dust(), 1.0).at(WAVELENGTH_NM) == pytest.approx(dust().at(WAVELENGTH_NM))
    half = dirty_reflectance(white, dust(), 0.5).at(WAVELENGTH_NM)
    assert half == pytest.approx((white.at(WAVELENGTH_NM) + dust().at(WAVELENGTH_NM)) / 2)


def test_more_dirt_is_nearer_to_dirt_and_duller() -> None:
    for name in PAINTS:
        body, roughness, index = paint(name)
        steps = [dirty_coat(body, roughness, index, dust(), share) for share in SHARES]
        distances = [np.abs(seen(step.body, step.interior_index) - dust().at(WAVELENGTH_NM)).max() for step in steps]
        assert distances == sorted(distances, reverse=True)
        assert [step.roughness for step in steps] == sorted(step.roughness for step in steps)
        assert [step.interior_index for step in steps] == sorted((step.interior_index for step in steps), reverse=True)


def test_no_dirt_reflects_more_than_it_gets() -> None:
    for name in asset_material_names():
        entry = asset_material(name)
        if entry.reflectance is None:
            continue
        for share in (0.0, *SHARES):
            assert dirty_reflectance(entry.reflectance, grime(), share).values.min() >= 0
            assert dirty_reflectance(entry.reflectance, grime(), share).values.max() <= 1
            body = dirty_coat(entry.reflectance, entry.roughness, entry.interior_index, dust(), share).body.values
            assert body.min() >= 0
            assert body.max() <= 1


def test_dust_is_brown_and_brighter_in_the_near_infrared_and_grime_is_darker() -> None:
    values = dust().at([450.0, 550.0, 650.0, 850.0])
    assert (np.diff(values) > 0).all()
    assert (grime().at(WAVELENGTH_NM) < dust().at(WAVELENGTH_NM)).all()
