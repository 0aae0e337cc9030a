"""Thin sheets: what they send on of light from behind, in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from test_analytic_scenes import ANALYTIC_TOLERANCE, ONE, camera, pytestmark, radiance_w  # noqa: F401

from fullwell.radiometry import Spectrum
from fullwell.scene import (
    ConstantEnvironment,
    Diffuse,
    DirectionalLight,
    Disk,
    Emission,
    Light,
    Part,
    Rectangle,
    SceneDescription,
    SceneObject,
    Translucent,
)

REFLECTANCE, TRANSMITTANCE = 0.3, 0.45
SHEET = Translucent(Spectrum.constant(REFLECTANCE), Spectrum.constant(TRANSMITTANCE))


def scene(*lights: Light, lamp_radius_m: float = 0.0) -> SceneDescription:
    """Return a sheet in the xy plane, seen from +z, with a disk that emits towards it 1 m behind it."""
    objects = [SceneObject("sheet", "", (Part(Rectangle((100, 100)), SHEET),))]
    if lamp_radius_m > 0:
        behind = np.eye(4)
        behind[2, 3] = -1.0
        part = Part(Disk(lamp_radius_m), Diffuse(Spectrum.constant(0.0)), emission=Emission(ONE))
        objects.append(SceneObject("lamp", "", (part,), behind))
    return SceneDescription(tuple(objects), lights)


@pytest.mark.parametrize(("towards_z", "share"), [(-1.0, REFLECTANCE), (1.0, TRANSMITTANCE)])
def test_light_is_split_between_the_sides(towards_z: float, share: float) -> None:
    light = DirectionalLight((0.0, np.sqrt(0.75), 0.5 * towards_z), Spectrum.constant(2.0))
    assert radiance_w(scene(light), camera()).mean() == pytest.approx(share / np.pi, rel=ANALYTIC_TOLERANCE)


def test_a_dome_shines_through_from_behind() -> None:
    image = radiance_w(scene(ConstantEnvironment(ONE)), camera(), spp=256)
    assert image.mean() == pytest.approx(REFLECTANCE + TRANSMITTANCE, rel=ANALYTIC_TOLERANCE)


@pytest.mark.parametrize("radius_m", [0.1, 1.0, 10.0])
def test_a_lamp_behind_is_seen_through_the_sheet(radius_m: float) -> None:
    """Small lamps are found by light sampling, wide ones as much by scattering; the irradiance is pi a^2 / (a^2 + 1)."""
    view = camera(rows=1, cols=1, hfov_deg=0.05)
    expected = TRANSMITTANCE * radius_m**2 / (radius_m**2 + 1.0)
    found = radiance_w(scene(lamp_radius_m=radius_m), view, spp=65536, depth=2).mean()
    assert found == pytest.approx(expected, rel=3 * ANALYTIC_TOLERANCE)
