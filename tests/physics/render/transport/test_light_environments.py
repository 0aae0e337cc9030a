"""Environments and the sun, sampled, against integrals over the sphere."""

from __future__ import annotations

import numpy as np
import pytest
from light_scenes import CELL, NO_NORMAL, UP, Lit, lamps, rectangle

from fullwell.radiometry.illuminants import illuminant
from fullwell.radiometry.photometry import chromaticity, tristimulus
from fullwell.radiometry.sky import clear_sky
from fullwell.radiometry.spectrum import Spectrum
from fullwell.render import choose_variant
from fullwell.render.transport.environment import DomeMap, cell_weights, image_map
from fullwell.render.transport.wavelengths import FIRST_EDGE_NM, PACKET, SpectraTable, cell_centres_nm
from fullwell.render.variant import activate
from fullwell.scene import ConstantEnvironment, ImageEnvironment, SunSky

CLOSED_FORM = 1e-3
MAP_NOISE = 3e-3
"""Three standard errors of 262,144 even samples of a map with cells of very different brightness."""

WHITE_ERROR = 2e-5
"""Single precision of the spectra, and of their sum."""

COLOUR_ERROR = 2e-3
"""In x and y under D65: the published curves are made for sums over 5 nm."""

pytestmark = pytest.mark.skipif(
    choose_variant().variant != "llvm_ad_spectral",
    reason="the path loop needs a usable LLVM; the fallback has no lights of its own",
)

ONE = Spectrum.constant(1.0)


@pytest.fixture(scope="module")
def mi():
    return activate()


def sphere_of_directions(count: int) -> np.ndarray:
    """(count, 3) even directions."""
    z = 1 - 2 * (np.arange(count) + 0.5) / count
    turn = np.pi * (1 + np.sqrt(5)) * np.arange(count)
    return np.stack([np.sqrt(1 - z * z) * np.cos(turn), np.sqrt(1 - z * z) * np.sin(turn), z], axis=1)


def met(lit: Lit, directions: np.ndarray, cell: int = CELL, normal=NO_NORMAL) -> list[tuple[np.ndarray, np.ndarray, int]]:
    """(radiance, density, group) of each light that rays meet outside the scene."""
    lanes = len(directions)
    cells = [lit.mi.UInt32(np.full(lanes, cell, np.uint32))]
    towards, everywhere = lit.vector(directions, lanes), lit.all_lanes(lanes)
    parts = []
    if "environment" in lit.lights.features:
        radiance = lit.lights.environment_radiance(lit.spectra, towards, cells, everywhere)
        there = lit.lights.environment_density(lit.vector(normal, lanes), towards, everywhere)
        parts.append((radiance, there, lit.lights.environment_group))
    if "sun" in lit.lights.features:
        there = lit.lights.sun_density(towards)
        inside = lit.mi.Float(there > 0)
        parts.append((lit.lights.sun_radiance(lit.spectra, cells) * inside, there, lit.lights.sun_group))
    return [
        (np.asarray(radiance[0].numpy(), dtype=float), np.asarray(density.numpy(), dtype=float), int(group.numpy()[0]))
        for radiance, density, group in parts
    ]


def escaped(lit: Lit, directions: np.ndarray, cell: int = CELL) -> np.ndarray:
    """Radiance of what rays meet outside the scene."""
    return sum(radiance for radiance, _, _ in met(lit, directions, cell))


def density(lit: Lit, directions: np.ndarray, normal=NO_NORMAL) -> np.ndarray:
    return sum(part for _, part, _ in met(lit, directions, normal=normal))


def hilly(rows: int = 24, cols: int = 50) -> np.ndarray:
    return np.random.default_rng(0).exponential(1.0, (rows, cols, 3)).astype(np.float32) ** 2


# Constant ------------------------------------------------------------------------------------------------------------


def test_constant_environment_gives_pi_times_its_radiance_without_noise(mi) -> None:
    lit = Lit.of(mi, lamps(), [ConstantEnvironment(Spectrum.constant(3.0))])
    for normal in (UP, (0.6, 0.0, -0.8)):
        values = lit.contributions((0, 0, 0), normal)
        assert values == pytest.approx(np.full(len(values), 3.0 * np.pi), rel=1e-4)
    assert lit.irradiance((0, 0, 0), NO_NORMAL) == pytest.approx(12.0 * np.pi, rel=1e-5)


# Images --------------------------------------------------------------------------------------------------------------


def test_white_image_has_exactly_the_radiance_of_its_light(mi) -> None:
    light = illuminant("FL2")
    table = SpectraTable()
    dome = image_map(ImageEnvironment(np.ones((4, 8, 3), np.float32), light), table)
    total = np.sum([table.row(PACKET * dome.packet + k).astype(float) for k in range(3)], axis=0)
    assert total == pytest.approx(table.row(table.add(light)), rel=WHITE_ERROR, abs=1e-6)


def test_colours_of_an_image_are_those_of_its_pixels_under_d65() -> None:
    table = SpectraTable()
    dome = image_map(ImageEnvironment(np.ones((1, 1, 3), np.float32), illuminant("D65")), table)
    curves = [Spectrum(cell_centres_nm(), table.row(PACKET * dome.packet + k), outside="zero") for k in range(3)]
    for curve, xy in zip(curves, [(0.64, 0.33), (0.30, 0.60), (0.15, 0.06)], strict=True):
        assert chromaticity(curve) == pytest.approx(xy, abs=COLOUR_ERROR)
    mixed = sum(weight * tristimulus(curve) for weight, curve in zip((0.2, 0.5, 0.8), curves, strict=True))
    white = tristimulus(illuminant("D65"))
    assert mixed[1] / white[1] == pytest.approx(0.2126 * 0.2 + 0.7152 * 0.5 + 0.0722 * 0.8, rel=COLOUR_ERROR)


@pytest.mark.parametrize("azimuth_deg", [0.0, 90.0, -37.0])
def test_image_is_seen_upright_from_inside(mi, azimuth_deg: float) -> None:
    """Row 0 is the zenith, the middle column lies towards the azimuth, columns go clockwise seen from above."""
    rows, cols = 9, 16
    for row, col in ((1, 8), (4, 0), (7, 5)):
        pixels = np.zeros((rows, cols, 3), np.float32)
        pixels[row, col] = 1.0
        lit = Lit.of(mi, lamps(), [ImageEnvironment(pixels, ONE, azimuth_deg)])
        down = (row + 0.5) / rows * np.pi
        around = np.radians(azimuth_deg) + np.pi - (col + 0.5) / cols * 2 * np.pi
        middle = np.array([np.sin(down) * np.cos(around), np.sin(down) * np.sin(around), np.cos(down)])
        assert escaped(lit, middle[None])[0] == pytest.approx(1.0, rel=1e-3)
        mirrored = middle * [1, 1, -1] if row != rows // 2 else -middle
        assert escaped(lit, mirrored[None])[0] == pytest.approx(0.0, abs=1e-6)
        directions = lit.sample((0, 0, 0), NO_NORMAL, 4096).direction.numpy().T
        assert np.min(directions @ middle) > np.cos(1.5 * np.pi / rows + 1.5 * 2 * np.pi / cols)


def test_radiance_of_sample_and_of_escaped_rays_agree(mi) -> None:
    lit = Lit.of(mi, lamps(), [ImageEnvironment(hilly(), ONE)])
    sample = lit.sample((0, 0, 0), NO_NORMAL, 4096)
    directions = sample.direction.numpy().T.astype(float)
    assert lit.radiance(sample) == pytest.approx(escaped(lit, directions), rel=1e-5)
    assert density(lit, directions) == pytest.approx(sample.pdf.numpy(), rel=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("shape", [(1, 1), (2, 3), (24, 50), (300, 600)])
def test_density_integrates_to_one_and_estimates_to_the_integral(mi, shape) -> None:
    lit = Lit.of(mi, lamps(), [ImageEnvironment(hilly(*shape), ONE)])
    directions = sphere_of_directions(2**21)
    assert density(lit, directions).mean() * 4 * np.pi == pytest.approx(1.0, rel=CLOSED_FORM)
    radiance = escaped(lit, directions)
    assert np.all(density(lit, directions)[radiance > 1e-6] > 0)
    assert lit.irradiance((0, 0, 0), NO_NORMAL, lanes=2**18) == pytest.approx(radiance.mean() * 4 * np.pi, rel=MAP_NOISE)
    for normal in (UP, (0.0, 0.8, -0.6)):
        expected = (radiance * np.maximum(directions @ normal, 0)).mean() * 4 * np.pi
        assert lit.irradiance((0, 0, 0), normal, lanes=2**18) == pytest.approx(expected, rel=MAP_NOISE)


def test_one_bright_pixel_is_found_by_all_samples(mi) -> None:
    pixels = np.zeros((128, 256, 3), np.float32)
    pixels[30, 40] = 1e6
    lit = Lit.of(mi, lamps(), [ImageEnvironment(pixels, ONE)])
    values = lit.contributions((0, 0, 0), UP)
    down = 30.5 / 128 * np.pi
    expected = 1e6 * np.sin(down) * np.cos(down) * (np.pi / 128) * (2 * np.pi / 256)
    assert values.mean() == pytest.approx(expected, rel=2e-3)  # bilinear: the sine bends within the pixel's neighbours
    assert values.std() / values.mean() < 1.5


def test_sampling_cells_are_bright_wherever_the_mixed_map_is() -> None:
    coefficients = np.zeros((6, 10, 1), np.float32)
    coefficients[2, 3] = 1.0
    weights = cell_weights(DomeMap(coefficients, np.array([1], np.uint32)), np.ones(1))
    rows, cols = np.nonzero(weights)
    assert (rows.min(), rows.max()) == (int(1 / 6 * 256), int(np.ceil(4 / 6 * 256)) - 1)
    assert (cols.min(), cols.max()) == (int(2 / 10 * 512), int(np.ceil(5 / 10 * 512)) - 1)
    split = cell_weights(DomeMap(coefficients, np.array([1], np.uint32), split=True), np.ones(1))
    assert np.all(split[128:] == 0)


def test_a_black_image_is_no_light(mi) -> None:
    lit = Lit.of(mi, lamps(), [ImageEnvironment(np.zeros((4, 8, 3), np.float32), ONE)])
    assert lit.lights.features == frozenset()


# Sun and sky ---------------------------------------------------------------------------------------------------------

SUN = (0.5, 0.3, 0.7)


def clear_sky_of_the_tests():
    return clear_sky(SUN, turbidity=3.0, ground_albedo=0.2, rows=128, cols=256)


def at_cell(sky, values: np.ndarray) -> float:
    return float(np.interp(FIRST_EDGE_NM + 0.5 * (CELL + 0.5), sky.wavelength_nm, values))


def test_sun_gives_its_radiance_times_its_solid_angle(mi) -> None:
    lit = Lit.of(mi, lamps(), [SunSky(SUN, sky_weight=0.0)])
    assert lit.lights.features == {"sun"}
    sky = clear_sky_of_the_tests()
    solid_angle = 2 * np.pi * (1 - np.cos(sky.sun_radius_rad))
    expected = at_cell(sky, sky.sun_radiance) * solid_angle * sky.sun_direction[2]
    values = lit.contributions((0, 0, 0), UP)
    assert values.mean() == pytest.approx(expected, rel=CLOSED_FORM)
    assert values.std() < 0.01 * values.mean()


def test_sky_gives_the_irradiance_of_its_map(mi) -> None:
    sky = clear_sky_of_the_tests()
    lit = Lit.of(mi, lamps(), [SunSky(SUN, sun_weight=0.0)])
    expected = at_cell(sky, sky.sky_irradiance())
    assert lit.irradiance((0, 0, 0), UP, lanes=2**18) == pytest.approx(expected, rel=MAP_NOISE)
    assert np.all(escaped(lit, sphere_of_directions(4096) * [1, 1, -1])[:2048] == 0)


@pytest.mark.parametrize("sun_group", ["", "sun"])
def test_sun_and_sky_are_two_lights_each_with_its_density(mi, sun_group: str) -> None:
    light = SunSky(SUN, sun_weight=2.0, sky_weight=0.5, sun_group=sun_group)
    lit = Lit.of(mi, lamps(rectangle(0.5, 2.0), groups=("default", "sun")), [light])
    assert lit.lights.features == {"tree", "environment", "sun"}
    sample = lit.sample((0, 0, 0), UP, 2**14)
    chosen = sample.dome.numpy()
    assert np.array_equal(chosen, np.isinf(sample.distance.numpy()))
    directions = sample.direction.numpy().T.astype(float)
    sky, sun = met(lit, directions, normal=UP)
    assert np.count_nonzero(chosen) > 500
    assert sky[1][chosen] == pytest.approx(sample.pdf.numpy()[chosen], rel=1e-3)
    assert sky[0][chosen] == pytest.approx(lit.radiance(sample)[chosen], rel=1e-4)
    assert np.all(sample.group.numpy()[chosen] == sky[2])
    assert (sky[2] != sun[2]) == bool(sun_group)
    drawn, density_of_drawn = lit.lights.sample_sun(mi.Point2f(*np.random.default_rng(1).random((2, 4096), dtype=np.float32)))
    _, sun = met(lit, drawn.numpy().T.astype(float), normal=UP)
    assert np.mean(density_of_drawn.numpy() > 0) > 0.99
    assert sun[1] == pytest.approx(density_of_drawn.numpy(), rel=1e-3)
    towards = np.array(SUN) / np.linalg.norm(SUN)
    beside = towards + 0.02 * np.cross(towards, [0.0, 0.0, 1.0])
    assert escaped(lit, towards[None])[0] > 1000 * escaped(lit, beside[None] / np.linalg.norm(beside))[0]
    parts = [
        Lit.of(mi, lamps(), [SunSky(SUN, sun_weight=2.0, sky_weight=0.0)]).irradiance((0, 0, 0)),
        Lit.of(mi, lamps(), [SunSky(SUN, sun_weight=0.0, sky_weight=0.5)]).irradiance((0, 0, 0), lanes=2**18),
        Lit.of(mi, lamps(rectangle(0.5, 2.0))).irradiance((0, 0, 0)),
    ]
    assert lit.irradiance((0, 0, 0), lanes=2**19) == pytest.approx(sum(parts), rel=MAP_NOISE)


def test_sun_on_the_horizon_still_shines(mi) -> None:
    lit = Lit.of(mi, lamps(), [SunSky((1.0, 0.0, 0.0))])
    values = lit.contributions((0, 0, 0), (1.0, 0.0, 0.0))
    assert np.all(np.isfinite(values))
    assert values.mean() > 0
