"""Textures of the path loop: Mitsuba's spectra of sRGB colours, and its bilinear pictures."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from fullwell.radiometry import Spectrum
from fullwell.radiometry.upsample import srgb_to_linear
from fullwell.render.variant import VECTORISED, activate
from fullwell.scene import Diffuse, Texture

WAVELENGTH_CELLS = (200, 400, 600, 800)
SIGMOID_TOLERANCE = 1e-5
"""Coefficients of thousands are rounded to single precision; the curve moves by this."""


@pytest.fixture(scope="module")
def mi() -> Any:
    mitsuba = activate()
    if mitsuba.variant() != VECTORISED:
        pytest.skip("the path loop needs the vectorised renderer")
    return mitsuba


def picture(rows: int, cols: int, seed: int) -> Texture:
    return Texture(np.random.default_rng(seed).integers(0, 256, (rows, cols, 3), dtype=np.uint8))


def colours_at(mi: Any, materials: list[Diffuse], number: NDArray[Any], uv: NDArray[Any], u: NDArray[Any]) -> NDArray[Any]:
    """Return (W, lanes) reflectances of the materials with the `number`s at `uv` (lanes, 2)."""
    from fullwell.render.transport.materials import MaterialTable
    from fullwell.render.transport.wavelengths import SpectraTable

    spectra = SpectraTable()
    table = MaterialTable(mi, spectra, materials)
    assert "texture" in table.features
    cells = [mi.UInt32(cell) for cell in WAVELENGTH_CELLS]
    surface = table.at(
        spectra.finish(mi),
        mi.UInt32(number),
        mi.Point2f(np.ascontiguousarray(uv.T, dtype=np.float32)),
        cells,
        [mi.Float(300.25 + 0.5 * cell) for cell in WAVELENGTH_CELLS],
        mi.Float(u),
        mi.Bool(True),
    )
    return np.array(surface.colour)


def mitsubas_bitmap(mi: Any, texture: Texture, uv: NDArray[Any]) -> NDArray[Any]:
    import drjit as dr

    flipped = np.ascontiguousarray(texture.pixels[::-1])
    plugin = mi.load_dict({"type": "bitmap", "bitmap": mi.Bitmap(flipped), "raw": False, "wrap_mode": "repeat"})
    interaction = dr.zeros(mi.SurfaceInteraction3f, len(uv))
    interaction.uv = mi.Point2f(np.ascontiguousarray(uv.T, dtype=np.float32))
    interaction.wavelengths = type(interaction.wavelengths)([mi.Float(300.25 + 0.5 * cell) for cell in WAVELENGTH_CELLS])
    return np.array(plugin.eval(interaction))


def test_coefficients_are_those_of_the_renderer(mi: Any) -> None:
    from fullwell.render.transport.textures import coefficients_of_srgb

    rng = np.random.default_rng(1)
    colours = rng.integers(0, 256, (500, 3), dtype=np.uint8)
    colours[:50, 1] = colours[:50, 0]
    colours[:25, 2] = colours[:25, 0]
    colours[25:30] = [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 0], [1, 0, 0]]
    ours = coefficients_of_srgb(colours)
    nm = np.linspace(360.0, 830.0, 48)
    theirs = np.array(
        [np.array(mi.srgb_model_fetch(mi.ScalarColor3f(*srgb_to_linear(colour / 255)))).ravel() for colour in colours]
    )
    curves = [_sigmoid(c.astype(np.float64), nm) for c in (ours, theirs)]
    np.testing.assert_allclose(curves[0], curves[1], atol=10 * SIGMOID_TOLERANCE)


def _sigmoid(coefficients: NDArray[np.float64], nm: NDArray[np.float64]) -> NDArray[np.float64]:
    a, b, c = np.clip(coefficients, -1e9, 1e9).T[:, :, None]
    x = (a * nm + b) * nm + c
    return np.asarray(0.5 + 0.5 * x / np.sqrt(1 + x * x))


def test_black_and_white_texels_are_exact(mi: Any) -> None:
    texture = Texture(np.array([[[0, 0, 0], [255, 255, 255]]], dtype=np.uint8))
    uv = np.array([[0.25, 0.5], [0.75, 0.5]])
    colours = colours_at(mi, [Diffuse(texture)], np.zeros(2), uv, np.full(2, 0.5))
    np.testing.assert_allclose(colours, [[0, 1]] * 4, atol=1e-7)


@pytest.mark.parametrize(("rows", "cols"), [(3, 5), (1, 1), (64, 2)])
def test_the_mean_of_the_chosen_texels_is_the_bilinear_picture(mi: Any, rows: int, cols: int) -> None:
    texture = picture(rows, cols, rows)
    uv = np.random.default_rng(3).uniform(-2.0, 3.0, (40, 2)).astype(np.float32)
    choices = 2048
    u = np.tile((np.arange(choices) + 0.5) / choices, len(uv))
    drawn = colours_at(mi, [Diffuse(texture)], np.zeros(u.size), np.repeat(uv, choices, axis=0), u)
    means = drawn.reshape(4, len(uv), choices).mean(axis=2)
    np.testing.assert_allclose(means, mitsubas_bitmap(mi, texture, uv), atol=2 / choices + SIGMOID_TOLERANCE)


def test_row_0_is_at_the_top(mi: Any) -> None:
    pixels = np.zeros((4, 1, 3), dtype=np.uint8)
    pixels[0] = 255
    colours = colours_at(mi, [Diffuse(Texture(pixels))], np.zeros(2), np.array([[0.5, 0.875], [0.5, 0.125]]), np.full(2, 0.5))
    np.testing.assert_allclose(colours[0], [1.0, 0.0], atol=1e-7)


def test_textures_and_spectra_live_side_by_side(mi: Any) -> None:
    one, other = picture(2, 2, 5), picture(7, 3, 6)
    materials = [Diffuse(one), Diffuse(Spectrum.constant(0.3)), Diffuse(other), Diffuse(one)]
    uv = np.array([[0.25, 0.75]] * 4)
    colours = colours_at(mi, materials, np.arange(4), uv, np.full(4, 0.5))
    np.testing.assert_allclose(colours[:, 1], 0.3, rtol=1e-6)
    np.testing.assert_array_equal(colours[:, 0], colours[:, 3])
    assert np.abs(colours[:, 0] - colours[:, 2]).max() > 0.01


def test_a_texture_is_stored_once(mi: Any) -> None:
    from fullwell.render.transport.textures import TextureAtlas

    atlas = TextureAtlas()
    texture = picture(5, 5, 1)
    assert atlas.add(texture) == atlas.add(texture)
    assert atlas.add(picture(5, 5, 2)).offset == 25
    texels, palette = atlas.finish(mi)
    assert np.array(texels).size == 50
    assert np.array(palette).size <= 3 * 50
