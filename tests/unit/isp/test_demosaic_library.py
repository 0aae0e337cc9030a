"""The demosaicing methods of the library: exact where they must be, better than bilinear where it matters."""

from __future__ import annotations

import numpy as np
import pytest

from fullwell.core import FieldError
from fullwell.isp.demosaic import check_demosaic, demosaic
from fullwell.isp.parameters import Demosaic

ROUNDING = 1e-12
"""Relative; weighted sums in double precision."""

BAYER_FORMS = {
    "RGGB": (("R", "G"), ("G", "B")),
    "BGGR": (("B", "G"), ("G", "R")),
    "GRBG": (("G", "R"), ("B", "G")),
    "GBRG": (("G", "B"), ("R", "G")),
    "RYYCy": (("R", "Y"), ("Y", "Cy")),
    "RCCB": (("R", "C"), ("C", "B")),
}
OTHER_FORMS = {
    "RCCC": (("R", "C"), ("C", "C")),
    "RGBW": (("R", "G"), ("B", "W")),
    "mono": (("W",),),
    "quad": (tuple("RRGG"), tuple("RRGG"), tuple("GGBB"), tuple("GGBB")),
}
METHODS: tuple[Demosaic, ...] = ("malvar2004", "menon2007")


def sampled(planes: np.ndarray, names: tuple[str, ...], pattern: tuple[tuple[str, ...], ...]) -> np.ndarray:
    """Return the mosaic (rows, cols) of planes (rows, cols, channels)."""
    rows, cols = planes.shape[:2]
    index = np.array([[names.index(name) for name in row] for row in pattern])
    chosen = np.tile(index, (rows // len(pattern) + 1, cols // len(pattern[0]) + 1))[:rows, :cols]
    return np.asarray(np.take_along_axis(planes, chosen[:, :, None], axis=2)[:, :, 0])


def zone_plate(size: int = 128) -> np.ndarray:
    """Return a coloured zone plate, (size, size, 3): all frequencies to 0.8 of Nyquist, in colours that vary slowly."""
    y, x = np.mgrid[0:size, 0:size] / size
    wave = 0.5 + 0.4 * np.cos(np.pi * 0.8 * size * (x**2 + y**2) / 2)
    return np.stack([wave * (0.6 + 0.3 * x), wave * 0.8, wave * (0.5 + 0.3 * y)], axis=2)


def psnr_db(found: np.ndarray, wanted: np.ndarray) -> float:
    inner = (slice(4, -4), slice(4, -4))
    return float(-10 * np.log10(np.mean((found[inner] - wanted[inner]) ** 2)))


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("pattern", BAYER_FORMS.values(), ids=BAYER_FORMS)
@pytest.mark.parametrize("shape", [(12, 16), (9, 11), (2, 2), (1, 5), (1, 1)])
def test_an_even_grey_stays_even_to_the_border(
    method: Demosaic, pattern: tuple[tuple[str, ...], ...], shape: tuple[int, int]
) -> None:
    wanted = tuple(sorted({name for row in pattern for name in row}))
    found = demosaic(np.full(shape, 0.3), pattern, wanted, method=method)
    measured = [k for k, name in enumerate(wanted) if name in {n for row in pattern[: shape[0]] for n in row[: shape[1]]}]
    np.testing.assert_allclose(found[:, :, measured], 0.3, rtol=ROUNDING)


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("pattern", BAYER_FORMS.values(), ids=BAYER_FORMS)
def test_channels_keep_their_names_and_measured_values_stay(method: Demosaic, pattern: tuple[tuple[str, ...], ...]) -> None:
    names = tuple(sorted({name for row in pattern for name in row}))
    mosaic = np.random.default_rng(1).random((12, 14))
    found = demosaic(mosaic, pattern, names, method=method)
    if method == "menon2007":
        found, mosaic = found[4:-4, 4:-4], mosaic[4:-4, 4:-4]  # its last step refines measured red and blue too
        measured = [n for n in names if sum(row.count(n) for row in pattern) == 2]
    else:
        measured = list(names)
    for r, c in np.ndindex(mosaic.shape):
        name = pattern[r % 2][c % 2]
        if name in measured:
            assert found[r, c, names.index(name)] == pytest.approx(mosaic[r, c], rel=ROUNDING)


@pytest.mark.parametrize("order", ["RGGB", "BGGR", "GRBG", "GBRG"])
def test_the_better_methods_are_better_on_a_zone_plate(order: str) -> None:
    planes, pattern = zone_plate(), BAYER_FORMS[order]
    mosaic = sampled(planes, ("R", "G", "B"), pattern)
    quality = {
        method: psnr_db(demosaic(mosaic, pattern, ("R", "G", "B"), method=method), planes)
        for method in ("bilinear", "malvar2004", "menon2007")
    }
    assert quality["malvar2004"] > quality["bilinear"] + 4
    assert quality["menon2007"] > quality["malvar2004"] + 2


def test_menon_leaves_less_zipper_along_a_neutral_edge() -> None:
    """Zipper is the change of a channel from pixel to pixel along an edge that is straight."""
    planes = np.repeat(np.where(np.arange(32) < 15, 0.2, 0.8)[None, :, None], 32, axis=0).repeat(3, axis=2)
    pattern = BAYER_FORMS["RGGB"]
    mosaic = sampled(planes, ("R", "G", "B"), pattern)

    def zipper(method: Demosaic) -> float:
        found = demosaic(mosaic, pattern, ("R", "G", "B"), method=method)[6:-6]
        return float(np.max(np.abs(np.diff(found, axis=0))))

    assert zipper("bilinear") == pytest.approx(0.6 / 4, rel=ROUNDING)  # one of four neighbours is across the edge
    assert zipper("menon2007") < 1e-9


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("pattern", OTHER_FORMS.values(), ids=OTHER_FORMS)
def test_other_patterns_are_refused_with_the_way_out(method: Demosaic, pattern: tuple[tuple[str, ...], ...]) -> None:
    with pytest.raises(FieldError, match="Set demosaic: bilinear"):
        demosaic(np.ones((8, 8)), pattern, ("R",), method=method)
    check_demosaic("bilinear", pattern)
