"""Two renderers' images of one scene, and whether they differ by more than their noise."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from typing import Any
from unittest import mock

import numpy as np
from agreement_scenes import Comparison
from numpy.typing import NDArray
from scipy import stats

from fullwell.core.constants import PLANCK_J_S, SPEED_OF_LIGHT_M_PER_S
from fullwell.radiometry import Spectrum, WavelengthGrid
from fullwell.render import activate, scalar
from fullwell.render.translate import translate
from fullwell.render.transport import progressive
from fullwell.render.transport.materials import MaterialTable

Array = NDArray[np.float64]

TILE = 8
SIGNIFICANCE = 1e-3
"""Chance that a test of a scene fails by noise alone; seeds are fixed, so a test that passes goes on passing."""

WATTS_NM = PLANCK_J_S * SPEED_OF_LIGHT_M_PER_S * 1e9


def our_image(comparison: Comparison, seed: int) -> Array:
    """(rows, cols, bands) [W m^-2 sr^-1 nm^-1] by the path loop; without what it adds for multiple scattering at microfacets
    where the comparison asks for that."""
    image = _progressive(comparison, seed, responses=(), keep_bands=True)
    bands = image.bands()
    assert bands is not None
    return np.asarray(bands[0], dtype=np.float64) * WATTS_NM / comparison.grid.centres_nm


def our_channels(comparison: Comparison, seed: int) -> Array:
    """(replicas, rows, cols, bands): the same by channels, whose wavelengths are drawn by chance."""
    responses = tuple(_box_response(comparison.grid, band) for band in range(comparison.grid.count))
    image = _progressive(comparison, seed, responses=responses, keep_bands=False)
    channels = np.moveaxis(image.replicas()[:, 0].astype(np.float64), 1, -1)
    return channels / comparison.grid.step_nm * WATTS_NM / comparison.grid.centres_nm


def _progressive(
    comparison: Comparison, seed: int, *, responses: tuple[Spectrum, ...], keep_bands: bool
) -> progressive.ProgressiveImage:
    work = progressive.Work(
        scene=comparison.scene,
        camera=comparison.camera,
        grid=comparison.grid,
        responses=responses,
        keep_bands=keep_bands,
        keep_groups=False,
        max_depth=comparison.depth,
        seed=seed,
    )
    table = functools.partial(MaterialTable, compensate=comparison.compensate)
    with mock.patch.object(progressive, "MaterialTable", table):
        image = progressive.ProgressiveImage(activate(), work)
    pixels = np.arange(image.pixels)
    image.add(pixels, np.full(image.pixels, comparison.samples // progressive.REPLICAS), lambda _: None)
    image.check()
    return image


def _box_response(grid: WavelengthGrid, band: int) -> Spectrum:
    low, high = float(grid.edges_nm[band]), float(grid.edges_nm[band + 1])
    return Spectrum([low - 1e-6, low, high, high + 1e-6], [0.0, 1.0, 1.0, 0.0], outside="zero")


def mitsuba_image(comparison: Comparison, seed: int) -> Array:
    """(rows, cols, bands) [W m^-2 sr^-1 nm^-1] by Mitsuba's own path integrator and spectral film."""
    mi: Any = activate()
    camera, grid = comparison.camera, comparison.grid
    translated = translate(mi, comparison.reference or comparison.scene, camera.camera_to_world[:3, 3])
    sensor = mi.load_dict(scalar._sensor(mi, camera, grid, comparison.samples))
    integrator = mi.load_dict({"type": "path", "max_depth": comparison.depth})
    photons = np.array(mi.render(translated.scene, sensor=sensor, integrator=integrator, seed=seed), dtype=np.float64)
    return photons.reshape(camera.film.rows, camera.film.cols, grid.count) * WATTS_NM / grid.centres_nm


@dataclass(frozen=True)
class Agreement:
    """Differences of two renderers' images in standard errors.

    Attributes
    ----------
    tiles
        (tiles, bands) scores of the means of 8 x 8 pixels; 0 where both are black.
    means
        (bands,) scores of the image's mean.
    difference, error
        (bands,) of the image's mean, relative to it: the difference, and its standard error.
    tile_error
        Typical standard error of a tile and band, relative to the band's mean.
    """

    tiles: Array
    means: Array
    difference: Array
    error: Array
    tile_error: float

    @property
    def bands(self) -> int:
        return len(self.means)

    @property
    def worst_tile(self) -> float:
        """Largest absolute score of a tile and band."""
        return float(np.abs(self.tiles).max())

    @property
    def worst_tile_limit(self) -> float:
        """Score that the worst of all tiles and bands exceeds by chance with probability SIGNIFICANCE [Sidak 1967]."""
        alone = 1.0 - (1.0 - SIGNIFICANCE) ** (1.0 / np.count_nonzero(self.tiles))
        return float(stats.norm.isf(alone / 2.0))

    @property
    def squares(self) -> Array:
        """(bands,) mean squares of the tiles' scores: 1 for noise alone."""
        return np.asarray((self.tiles**2).sum(axis=0) / np.count_nonzero(self.tiles, axis=0))

    @property
    def square_limits(self) -> tuple[float, float]:
        """What the mean squares of a band stay between by chance, all bands together with probability 1 - SIGNIFICANCE.

        Bands share their paths, so they are tested one by one. Errors are estimates from `_FREEDOM` values a tile and more:
        the mean square of such a score is that much larger than 1, at most.
        """
        tiles = int(np.count_nonzero(self.tiles, axis=0).min())
        alone = SIGNIFICANCE / (2 * self.bands)
        low, high = stats.chi2.ppf(alone, tiles) / tiles, stats.chi2.isf(alone, tiles) / tiles
        return float(low), float(high)


def compare(ours: Array, theirs: Array) -> Agreement:
    """Compare independent images, (images, rows, cols, bands) each.

    Pixels are independent of each other in both renderers, so the variance of a tile's mean is the mean of its pixels'
    variances over their number: an estimate from 64 times as many values as there are images less one.
    """
    difference, variance = ours.mean(axis=0) - theirs.mean(axis=0), _variance(ours) + _variance(theirs)
    tile, tile_variance = _tiled(difference), _tiled(variance) / TILE**2
    pixels = difference.shape[0] * difference.shape[1]
    mean, error = difference.mean(axis=(0, 1)), np.sqrt(variance.mean(axis=(0, 1)) / pixels)
    level = np.maximum(theirs.mean(axis=(0, 1, 2)), 1e-300)
    scores = np.divide(tile, np.sqrt(tile_variance), out=np.zeros_like(tile), where=tile_variance > 0)
    assert np.all(tile[tile_variance == 0] == 0)
    typical = float(np.median(np.sqrt(tile_variance) / level))
    return Agreement(scores, np.divide(mean, error), mean / level, error / level, typical)


def _variance(images: Array) -> Array:
    return np.asarray(images.var(axis=0, ddof=1) / len(images))


def _tiled(values: Array) -> Array:
    rows, cols, bands = values.shape
    means = values.reshape(rows // TILE, TILE, cols // TILE, TILE, bands).mean(axis=(1, 3))
    return np.asarray(means.reshape(-1, bands))
