"""The light of a scene by its description: one light is found exactly, several by what each gives to the point in focus."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fullwell.isp import scene_illuminant
from fullwell.isp.scene_light import point_of_interest_m
from fullwell.radiometry import (
    Spectrum,
    WavelengthGrid,
    chromaticity,
    clear_sky,
    correlated_colour_temperature_k,
    illuminant,
    scale_to_illuminance,
    scale_to_luminance,
)
from fullwell.scene import (
    Camera,
    ConstantEnvironment,
    Cube,
    Cylinder,
    Diffuse,
    DirectionalLight,
    Disk,
    Emission,
    Film,
    Geometry,
    ImageEnvironment,
    Lens,
    Light,
    Mesh,
    Part,
    PointLight,
    Rectangle,
    SceneDescription,
    SceneObject,
    Sphere,
    SpotLight,
    SunSky,
)
from fullwell.scene.camera import look_at

WARM, COOL = illuminant("blackbody:3000K"), illuminant("D65")
BLACK = Diffuse(Spectrum.constant(0.0))
SAME_LIGHT_XY = 2e-5
"""Sums over 1 nm against exact integrals."""


def camera(focus_distance_m: float = 2.0) -> Camera:
    lens = Lens("thin_lens", 0.004, 2.0, focus_distance_m, Spectrum.constant(1.0))
    return Camera("main", look_at(np.array([0.0, -2.0, 0.0]), np.zeros(3), np.array([0.0, 0.0, 1.0])), lens, Film(10, 10, 1e-6))


def scene(*lights: Light, objects: tuple[SceneObject, ...] = ()) -> SceneDescription:
    return SceneDescription(objects, lights)


def lamp(geometry: Geometry, height_m: float, *, down: bool = True, spd: Spectrum = WARM) -> SceneObject:
    """Return a lamp of 1000 cd/m2 above the origin, its z axis down or up."""
    pose = np.diag([1.0, -1.0, -1.0, 1.0]) if down else np.eye(4)
    pose[2, 3] = height_m
    return SceneObject("lamp", "", (Part(geometry, BLACK, emission=Emission(scale_to_luminance(spd, 1000.0))),), pose)


def kelvin(light: Spectrum | None) -> float:
    assert light is not None
    return correlated_colour_temperature_k(light)


LIGHTS: dict[str, Light] = {
    "point": PointLight((1.0, 0.0, 1.0), WARM),
    "spot": SpotLight((0.0, 0.0, 2.0), (0.0, 0.0, -1.0), WARM, 10.0, 30.0),
    "directional": DirectionalLight((0.0, 0.0, -1.0), WARM),
    "sky": ConstantEnvironment(WARM),
    "white picture": ImageEnvironment(np.ones((4, 8, 3), np.float32), WARM),
}
SHAPES: dict[str, Geometry] = {
    "rectangle": Rectangle((0.2, 0.3)),
    "disk": Disk(0.1),
    "cube": Cube((0.1, 0.2, 0.3)),
    "sphere": Sphere(0.1),
    "cylinder": Cylinder(0.1, 0.2),
    "mesh": Mesh(np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]], np.uint32)),
}


@pytest.mark.parametrize("light", LIGHTS.values(), ids=LIGHTS)
def test_one_light_is_the_light_of_the_scene(light: Light) -> None:
    found = scene_illuminant(scene(light), camera())
    assert found is not None
    np.testing.assert_allclose(chromaticity(found), chromaticity(WARM), atol=SAME_LIGHT_XY)


@pytest.mark.parametrize("down", [True, False])
@pytest.mark.parametrize("shape", SHAPES.values(), ids=SHAPES)
def test_one_lamp_is_too_even_where_it_is_turned_away(shape: Geometry, down: bool) -> None:
    found = scene_illuminant(scene(objects=(lamp(shape, 1.0, down=down),)), camera())
    assert found is not None
    np.testing.assert_allclose(chromaticity(found), chromaticity(WARM), atol=SAME_LIGHT_XY)


def test_darkness_has_no_light() -> None:
    assert scene_illuminant(scene(), camera()) is None
    assert scene_illuminant(scene(PointLight((0.0, 0.0, 1.0), WARM.scaled(0.0))), camera()) is None


def test_equal_illuminances_are_mixed_equally() -> None:
    """A directional light of pi cd/m2 x 1 sr lux and a sky of 1 cd/m2 both give pi lux."""
    sun = DirectionalLight((0.0, 1.0, 0.0), scale_to_illuminance(COOL, math.pi))
    sky = ConstantEnvironment(scale_to_luminance(WARM, 1.0))
    found = scene_illuminant(scene(sun, sky), camera())
    assert found is not None
    wavelength_nm = np.arange(402.0, 700.0, 5.0)  # between the knots of D65, where means over 1 nm are its values
    both = scale_to_illuminance(WARM, 1.0).at(wavelength_nm) + scale_to_illuminance(COOL, 1.0).at(wavelength_nm)
    ratio = found.at(wavelength_nm) / both
    np.testing.assert_allclose(ratio / ratio[0], 1.0, rtol=SAME_LIGHT_XY)


def test_a_small_lamp_counts_with_the_solid_angle_that_the_point_sees() -> None:
    """1000 cd/m2 of 0.01 m2 at 2 m give 2.5 lux; as much daylight beside it must weigh the same."""
    flat = lamp(Rectangle((0.1, 0.1)), 2.0)
    daylight_lux = DirectionalLight((0.0, 0.0, -1.0), scale_to_illuminance(COOL, 2.5))
    found = scene_illuminant(scene(daylight_lux, objects=(flat,)), camera())
    expected = scene_illuminant(scene(daylight_lux, PointLight((0.0, 0.0, 1.0), scale_to_illuminance(WARM, 2.5))), camera())
    assert found is not None
    assert expected is not None
    np.testing.assert_allclose(chromaticity(found), chromaticity(expected), atol=SAME_LIGHT_XY)


def test_a_distant_lamp_and_a_spot_that_points_elsewhere_count_little() -> None:
    near, far = PointLight((0.0, 0.0, 1.0), WARM), PointLight((0.0, 0.0, 100.0), COOL)
    assert kelvin(scene_illuminant(scene(near, far), camera())) < 3010
    elsewhere = SpotLight((0.0, 0.0, 1.0), (0.0, 0.0, 1.0), COOL, 10.0, 30.0)
    assert kelvin(scene_illuminant(scene(near, elsewhere), camera())) == pytest.approx(3000, abs=5)


@pytest.mark.parametrize(
    ("sky", "low_k", "high_k"),
    [
        (SunSky((0.0, 0.5, 0.8)), 5500, 6500),
        (SunSky((0.0, 0.5, 0.8), sun_weight=0.0), 9000, 13000),
        (SunSky((0.0, 0.5, 0.8), sky_weight=0.0), 5000, 5600),
    ],
)
def test_sun_and_sky_are_daylight(sky: SunSky, low_k: float, high_k: float) -> None:
    assert low_k < kelvin(scene_illuminant(scene(sky), camera())) < high_k


def test_sun_and_sky_are_those_of_the_picture_to_the_near_infrared() -> None:
    sun_sky = SunSky((0.0, 0.5, 0.8), turbidity=2.5, ground_albedo=0.1, sun_weight=0.5, sky_weight=2.0)
    found = scene_illuminant(scene(sun_sky), camera())
    assert found is not None
    sky = clear_sky(sun_sky.sun_direction, turbidity=2.5, ground_albedo=0.1, rows=128, cols=256)
    expected = Spectrum(sky.wavelength_nm, 0.5 * sky.sun_irradiance() + 2.0 * sky.sky_irradiance(), outside="zero")
    bands = WavelengthGrid(425.0, 925.0, 50.0)
    ratio = found.band_average(bands) / expected.band_average(bands)
    assert ratio == pytest.approx(np.full(bands.count, ratio.mean()), rel=2e-3)


def test_the_camera_looks_where_it_is_focused_and_else_at_the_objects() -> None:
    np.testing.assert_allclose(point_of_interest_m(scene(), camera(1.5)), [0.0, -0.5, 0.0], atol=1e-12)
    np.testing.assert_allclose(point_of_interest_m(scene(), camera(math.inf)), [0.0, -1.0, 0.0], atol=1e-12)
    at = np.eye(4)
    at[:3, 3] = [1.0, 3.0, 0.0]
    thing = SceneObject("thing", "", (Part(Sphere(), BLACK),), at)
    np.testing.assert_allclose(point_of_interest_m(scene(objects=(thing,)), camera(math.inf)), [0.0, 3.0, 0.0], atol=1e-12)


def test_light_groups_weigh_what_the_picture_shows() -> None:
    """By night weights the sun's light is none of the picture's."""
    apart = SunSky((0.0, 0.5, 0.8), group="sky", sun_group="sun")
    both = scene(apart, PointLight((0.0, 0.0, 3.0), WARM, group="lamps"))

    def seen(**weights: float) -> Spectrum | None:
        return scene_illuminant(both, camera(), weights)

    assert 9000 < kelvin(seen(sun=0.0, lamps=0.0)) < 13000
    assert 5000 < kelvin(seen(sky=0.0, lamps=0.0)) < 5600
    assert kelvin(seen(sun=0.0, sky=0.0)) == pytest.approx(3000, abs=5)
    assert seen(sun=0.0, sky=0.0, lamps=0.0) is None
