"""Every material and every light against what optics says about it."""

from __future__ import annotations

import numpy as np
import pytest
from test_analytic_scenes import ANALYTIC_TOLERANCE, GRID, ONE, camera, pytestmark, radiance_w, thing  # noqa: F401

from fullwell.core.errors import FieldError
from fullwell.radiometry import Spectrum, WavelengthGrid, clear_sky, illuminance_lux, illuminant, metal, scale_to_luminance
from fullwell.radiometry.atmosphere import SUN_RADIUS_RAD
from fullwell.render import activate
from fullwell.render.translate import check_sky_range, translate
from fullwell.scene import (
    Camera,
    Conductor,
    ConstantEnvironment,
    Cube,
    Dielectric,
    Diffuse,
    DirectionalLight,
    Emission,
    Film,
    ImageEnvironment,
    Lens,
    Material,
    Mirror,
    Part,
    Principled,
    Rectangle,
    RoughPlastic,
    SceneDescription,
    SceneObject,
    Sphere,
    SunSky,
    Texture,
    look_at,
)

WHITE = Spectrum.constant(1.0)
DOME = (ConstantEnvironment(ONE),)
VISIBLE = WavelengthGrid(400, 700, 10)
ONE_BAND = WavelengthGrid(550, 550, 10)

SKY_TOLERANCE = 0.01
"""What the product promises of sun and sky; the map's pixels cost 0.3 % of it at most."""

PENUMBRA_TOLERANCE = 0.01
"""Of the lit ground: three standard errors of 8,192 samples a row, which the pixel's own width adds next to nothing to."""


def made_of(geometry, material: Material, *, to_world=None) -> SceneObject:
    return SceneObject("thing", "", (Part(geometry, material),), np.eye(4) if to_world is None else to_world)


@pytest.mark.parametrize(
    "material",
    [Diffuse(WHITE), Mirror(WHITE), Dielectric(), Dielectric(roughness=0.0, interior_index=2.4)],
    ids=["diffuse", "mirror", "glass", "diamond"],
)
def test_lossless_material_vanishes_in_a_white_furnace(material: Material) -> None:
    image = radiance_w(SceneDescription((made_of(Sphere(1.0), material),), DOME), camera(hfov_deg=15), spp=256, depth=128)
    assert image.mean() == pytest.approx(1.0, rel=ANALYTIC_TOLERANCE)


@pytest.mark.parametrize(
    ("material", "spp"),
    [
        (RoughPlastic(WHITE, 0.3), 128),
        (Principled(WHITE, 0.5), 128),
        (Principled(WHITE, 0.2, metallic=1.0), 128),
        (Dielectric(roughness=0.3), 1536),  # where light turns often inside, single paths differ by 40 %
    ],
    ids=["plastic", "principled", "metallic", "frosted"],
)
def test_rough_material_neither_creates_nor_loses_light_in_a_white_furnace(material: Material, spp: int) -> None:
    view = camera(hfov_deg=8)
    image = radiance_w(SceneDescription((made_of(Sphere(1.0), material),), DOME), view, spp=spp, depth=128)
    assert image.mean() == pytest.approx(1.0, rel=ANALYTIC_TOLERANCE)


def test_metal_reflects_as_fresnel_says_at_normal_incidence() -> None:
    eta, k = metal("gold")
    view = camera(rows=8, cols=8, hfov_deg=0.5)
    image = radiance_w(SceneDescription((made_of(Rectangle((10, 10)), Conductor(eta, k)),), DOME), view, spp=256)
    fine_nm = np.linspace(395, 705, 3101)
    n, kappa = eta.at(fine_nm), k.at(fine_nm)
    fresnel = ((n - 1) ** 2 + kappa**2) / ((n + 1) ** 2 + kappa**2)
    expected = Spectrum(fine_nm, fresnel).band_average(GRID)
    assert image.mean(axis=(0, 1)) == pytest.approx(expected, rel=5 * ANALYTIC_TOLERANCE)


def test_glass_pane_transmits_as_two_interfaces_do() -> None:
    lamp = thing(Rectangle((50, 50)), 0.0, emission=Emission(ONE), to_world=shifted(z=-3.0))
    pane = made_of(Cube((20, 20, 0.1)), Dielectric(1.5, 1.0))
    view = camera(rows=16, cols=16, hfov_deg=0.5)
    reflected = ((1.5 - 1) / (1.5 + 1)) ** 2
    image = radiance_w(SceneDescription((lamp, pane)), view, spp=1024, depth=64)
    assert image.mean() == pytest.approx((1 - reflected) / (1 + reflected), rel=3 * ANALYTIC_TOLERANCE)


def shifted(x=0.0, y=0.0, z=0.0) -> np.ndarray:
    to_world = np.eye(4)
    to_world[:3, 3] = [x, y, z]
    return to_world


def test_texture_has_its_top_row_at_the_top_and_white_is_white() -> None:
    pixels = np.zeros((2, 2, 3), dtype=np.uint8)
    pixels[0] = 255
    scene = SceneDescription((made_of(Rectangle((2, 2)), Diffuse(Texture(pixels))),), DOME)
    image = radiance_w(scene, camera(hfov_deg=5), spp=64).mean(axis=2)
    # The bilinear filter mixes the rows in the middle half; the view shows the centre, brighter towards the top.
    assert image[:8].mean() > image[-8:].mean()
    white = made_of(Rectangle((20, 20)), Diffuse(Texture(np.full((2, 2, 3), 255, dtype=np.uint8))))
    level = radiance_w(SceneDescription((white,), DOME), camera(), spp=64).mean(axis=(0, 1))
    assert level == pytest.approx(np.ones(GRID.count), abs=0.01)


def test_environment_image_is_upright_absolute_and_turns_with_its_azimuth() -> None:
    pixels = np.full((32, 64, 3), 0.01, dtype=np.float32)
    pixels[:8] = 1.0  # towards the zenith
    pixels[14:18, 30:34] = 4.0  # on the horizon, in the middle of the picture: towards +x
    white = scale_to_luminance(illuminant("D65"), 1000.0)

    def seen(direction, azimuth_deg=0.0) -> np.ndarray:
        scene = SceneDescription((), (ImageEnvironment(pixels, white, azimuth_deg),))
        up = np.array([0.0, 1.0, 0.0]) if abs(direction[2]) > 0.9 else np.array([0.0, 0.0, 1.0])
        lens = Lens("pinhole", 5e-3, 4.0, np.inf, Spectrum.constant(1.0))
        view = Camera("m", look_at(np.zeros(3), np.array(direction, float), up), lens, Film(8, 8, 1e-5))
        return radiance_w(scene, view, spp=64).mean(axis=(0, 1))

    assert seen((0, 0, 1)) == pytest.approx(white.band_average(GRID), rel=0.01)
    assert seen((0, 0, -1)) == pytest.approx(0.01 * white.band_average(GRID), rel=0.03)
    assert seen((1, 0, 0.0)).mean() > 100 * seen((0, 1, 0.0)).mean()
    assert seen((0, 1, 0.0), azimuth_deg=90.0).mean() > 100 * seen((1, 0, 0.0), azimuth_deg=90.0).mean()


def test_environment_image_has_the_spectrum_of_its_light() -> None:
    pixels = np.full((4, 8, 3), 0.5, dtype=np.float32)
    tungsten = scale_to_luminance(illuminant("A"), 1000.0)
    view = camera(origin=(0, 0, 0), target=(1, 0, 0.2))
    image = radiance_w(SceneDescription((), (ImageEnvironment(pixels, tungsten),)), view, spp=64)
    assert image.mean(axis=(0, 1)) == pytest.approx(0.5 * tungsten.band_average(GRID), rel=ANALYTIC_TOLERANCE)


def test_without_llvm_environment_images_are_lit_by_daylight_only() -> None:
    tungsten = ImageEnvironment(np.ones((4, 8, 3), dtype=np.float32), scale_to_luminance(illuminant("A"), 1000.0))
    with pytest.raises(FieldError, match="D65"):
        translate(activate(), SceneDescription((), (tungsten,)), np.zeros(3))


def test_without_llvm_the_sky_ends_at_720_nm() -> None:
    scene = SceneDescription((), (SunSky((0.0, 0.6, 0.8)),))
    check_sky_range(scene, VISIBLE)
    with pytest.raises(FieldError, match="720 nm"):
        check_sky_range(scene, WavelengthGrid(400, 850, 10))


@pytest.mark.parametrize(("elevation_deg", "turbidity"), [(10.0, 2.0), (45.0, 3.0), (80.0, 6.0)])
def test_level_ground_gets_the_irradiance_of_sun_and_sky(elevation_deg: float, turbidity: float) -> None:
    """Also at 850 nm."""
    grid = WavelengthGrid(450, 850, 100)
    elevation = np.radians(elevation_deg)
    towards = (0.6 * np.cos(elevation), 0.8 * np.cos(elevation), np.sin(elevation))
    sky = clear_sky(towards, turbidity=turbidity, ground_albedo=0.2, rows=128, cols=256)
    expected = sky.sky_irradiance() + sky.sun_irradiance() * np.sin(elevation)
    photons = Spectrum(sky.wavelength_nm, expected * sky.wavelength_nm, outside="zero").band_average(grid)
    plane = made_of(Rectangle((100, 100)), Diffuse(WHITE))
    image = radiance_w(SceneDescription((plane,), (SunSky(towards, turbidity),)), camera(), spp=256, grid=grid)
    assert np.pi * image.mean(axis=(0, 1)) == pytest.approx(photons / grid.centres_nm, rel=SKY_TOLERANCE)


def test_sun_and_sky_light_a_plane_with_a_plausible_illuminance() -> None:
    """A clear day with the sun at 45 degrees: 60 to 100 klx in the literature (IES Lighting Handbook, daylight chapter)."""
    direction = (0.0, np.sqrt(0.5), np.sqrt(0.5))
    plane = made_of(Rectangle((100, 100)), Diffuse(WHITE))
    image = radiance_w(SceneDescription((plane,), (SunSky(direction),)), camera(), spp=64, grid=VISIBLE)
    irradiance = np.pi * image.mean(axis=(0, 1))
    lux = illuminance_lux(Spectrum(VISIBLE.centres_nm, irradiance, outside="zero"))
    assert 60e3 < lux < 110e3


def test_shadow_of_a_pole_is_as_soft_as_the_sun_is_wide() -> None:
    """At the side of a long shadow, 20 m behind the pole: the light is the share of the sun's disk beside the pole's edge."""
    distance_m, half_m, elevation = 20.0, 1.0, np.radians(45.0)
    pole = made_of(Cube((0.01, 2 * half_m, 100.0)), Diffuse(Spectrum.constant(0.0)))
    ground = SceneObject("ground", "", (Part(Rectangle((100, 100)), Diffuse(WHITE)),))
    sun = SunSky((np.cos(elevation), 0.0, np.sin(elevation)), sky_weight=0.0)
    rows, pixel_m, height_m = 60, 0.01, 20.0
    hfov_deg = 2 * np.degrees(np.arctan(4 * pixel_m / height_m))
    view = camera((-distance_m, half_m, height_m), (-distance_m, half_m, 0.0), rows=rows, cols=8, hfov_deg=hfov_deg)
    image = radiance_w(SceneDescription((pole, ground), (sun,)), view, spp=1024, depth=2, grid=ONE_BAND)
    beside_m = (rows / 2 - 0.5 - np.arange(rows)) * pixel_m
    t = np.clip(beside_m * np.cos(elevation) / (distance_m * np.tan(SUN_RADIUS_RAD)), -1.0, 1.0)
    uncovered = 0.5 + (t * np.sqrt(1 - t**2) + np.arcsin(t)) / np.pi
    assert image.mean(axis=(1, 2)) / image[:8].mean() == pytest.approx(uncovered, abs=PENUMBRA_TOLERANCE)


def test_shadow_points_away_from_the_sun() -> None:
    post = made_of(Cube((0.2, 0.2, 2.0)), Diffuse(WHITE), to_world=shifted(z=1.0))
    ground = SceneObject("ground", "", (Part(Rectangle((100, 100)), Diffuse(WHITE)),))
    view = camera(origin=(0, 0, 12), rows=49, cols=49, hfov_deg=40)
    image = radiance_w(
        SceneDescription((post, ground), (SunSky((0.6, 0.0, 0.8), sky_weight=0.0),)), view, spp=16, grid=VISIBLE
    ).sum(axis=2)
    assert (
        image[24, 19] < 0.1 * image[24, 30]
    )  # the sun stands over +x; lit only by the white post, the shadow falls to -x, left in this view


def test_thin_lens_blurs_by_the_circle_of_confusion() -> None:
    focal_m, f_number, focus_m, distance_m = 50e-3, 2.0, 2.0, 4.0
    lens = Lens("thin_lens", focal_m, f_number, focus_m, Spectrum.constant(1.0))
    view = Camera("m", look_at(np.zeros(3), np.array([0, 0, -1.0]), np.array([0, 1.0, 0])), lens, Film(65, 65, 20e-6))
    small = made_of(Rectangle((1e-3, 1e-3)), Diffuse(Spectrum.constant(0.0)), to_world=shifted(z=-distance_m))
    lamp = SceneObject(
        "lamp", "", (Part(Rectangle((2e-3, 2e-3)), small.parts[0].material, emission=Emission(ONE)),), shifted(z=-distance_m)
    )
    image = radiance_w(SceneDescription((lamp,)), view, spp=1024).sum(axis=2)
    circle_m = focal_m / f_number * abs(distance_m - focus_m) / distance_m * lens.image_distance_m / focus_m
    area_px = np.count_nonzero(image > 0.25 * image.max())
    assert np.sqrt(area_px * 4 / np.pi) * 20e-6 == pytest.approx(circle_m, rel=0.06)


def test_thin_lens_in_focus_is_as_sharp_and_as_bright_as_the_pinhole() -> None:
    def through(kind) -> np.ndarray:
        lens = Lens(kind, 50e-3, 2.0, 2.0, Spectrum.constant(1.0))
        view = Camera("m", look_at(np.zeros(3), np.array([0, 0, -1.0]), np.array([0, 1.0, 0])), lens, Film(33, 33, 100e-6))
        lamp = thing(Rectangle((0.05, 0.05)), 0.0, emission=Emission(ONE), to_world=shifted(z=-2.0))
        return radiance_w(SceneDescription((lamp,)), view, spp=256).mean(axis=2)

    assert through("thin_lens") == pytest.approx(through("pinhole"), abs=0.06)


def test_light_from_a_direction_needs_no_objects_but_reaches_them_all() -> None:
    near = thing(Rectangle((1, 1)), 1.0, name="near")
    far = thing(Rectangle((1, 1)), 1.0, name="far", to_world=shifted(x=1.5, z=-100.0))
    light = DirectionalLight((0.0, 0.0, -1.0), Spectrum.constant(np.pi))
    image = radiance_w(SceneDescription((near, far), (light,)), camera(hfov_deg=5), spp=16)
    assert image.max() == pytest.approx(1.0, rel=0.05)
