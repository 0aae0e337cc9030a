"""The image processor in compatibility mode beyond the reference's cases, and the whole chain through its front doors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fullwell.core import FieldError, ShapeError, stream
from fullwell.isp.isetcam import correction_gains, demosaic, mcc_matrix, monochrome_picture, process, process_mosaic
from fullwell.optics.isetcam import compute_optical_image
from fullwell.radiometry import RadianceImage, Spectrum, WavelengthGrid
from fullwell.radiometry.isetcam import DEFAULT_WAVELENGTH_NM, sensor_curves
from fullwell.scene import Lens
from fullwell.sensor import sensor
from fullwell.sensor.isetcam import BAYER_ORDERS, capture

WAVE = np.array(DEFAULT_WAVELENGTH_NM, dtype=np.float64)


@pytest.mark.parametrize("size", [(5, 5), (6, 9), (11, 8), (16, 16)])
@pytest.mark.parametrize("method", ["bilinear", "nearest", "laplacian", "adaptive_laplacian"])
@pytest.mark.parametrize("order", ["rggb", "grbg", "bggr"])
def test_a_grey_mosaic_of_any_size_stays_grey(order: str, method: str, size: tuple[int, int]) -> None:
    found = demosaic(np.full(size, 0.25), BAYER_ORDERS[order], method=method)  # type: ignore[arg-type]
    np.testing.assert_allclose(found, np.full((*size, 3), 0.25), rtol=1e-12)


def test_laplacian_pictures_of_other_orders_are_shifted() -> None:
    """ISETCam demosaics in GRBG order and does not shift back: an RGGB picture comes out one column to the left."""
    mosaic = np.random.default_rng(5).random((8, 8))
    found = demosaic(mosaic, BAYER_ORDERS["rggb"], method="laplacian")
    np.testing.assert_array_equal(found[0, 0:6:2, 1], mosaic[0, 1:7:2])


def test_what_cannot_be_demosaicked_is_refused() -> None:
    with pytest.raises(FieldError, match="GBRG"):
        demosaic(np.ones((8, 8)), BAYER_ORDERS["gbrg"], method="adaptive_laplacian")
    with pytest.raises(FieldError, match="pattern"):
        demosaic(np.ones((8, 8)), ((0, 1), (2, 1)))
    with pytest.raises(FieldError, match="bilinear"):
        demosaic(np.ones((8, 8)), BAYER_ORDERS["rggb"], method="bilinar")  # type: ignore[arg-type]
    with pytest.raises(ShapeError):
        demosaic(np.ones((4, 8)), BAYER_ORDERS["rggb"], method="laplacian")


def test_a_black_picture_is_refused_where_isetcam_gives_nan() -> None:
    _, curves = sensor_curves("default")
    with pytest.raises(FieldError, match="NaN"):
        process_mosaic(np.zeros((8, 8)), BAYER_ORDERS["rggb"], wavelength_nm=WAVE, quantum_efficiency=curves)


def test_gray_world_gives_the_mean_the_ratios_of_d65() -> None:
    xyz = np.random.default_rng(6).random((8, 8, 3))
    gains = correction_gains(xyz, "gray_world")
    corrected = (xyz * gains).mean(axis=(0, 1))
    neutral = np.ones((2, 2, 3)) * corrected
    np.testing.assert_allclose(correction_gains(neutral, "gray_world"), np.ones(3), rtol=1e-12)
    np.testing.assert_array_equal(correction_gains(xyz, "none"), np.ones(3))


def test_the_colour_matrix_needs_three_bands_within_the_chart() -> None:
    with pytest.raises(FieldError, match="independent"):
        mcc_matrix([500.0, 600.0], np.ones((2, 3)))
    with pytest.raises(FieldError, match="table"):
        mcc_matrix(np.arange(380.0, 731.0, 10.0), np.ones((36, 3)))


def test_an_analog_sensor_keeps_its_level_and_a_digital_one_does_not() -> None:
    _, curves = sensor_curves("default")
    mosaic = np.full((8, 8), 0.2)
    for largest in (0.2, 1.0):
        picture = process_mosaic(mosaic, BAYER_ORDERS["rggb"], wavelength_nm=WAVE, quantum_efficiency=curves, largest=largest)
        assert picture.rgb.max() == pytest.approx(largest)


def test_one_channel_gives_three_equal_planes() -> None:
    picture = monochrome_picture(np.array([[0.1, 0.2]]))
    np.testing.assert_array_equal(picture.rgb[:, :, 0], picture.rgb[:, :, 2])
    with pytest.raises(ShapeError):
        monochrome_picture(np.ones(3))


@pytest.mark.parametrize("name", ["imx363", "ideal-rgb", "ideal-mono"])
def test_a_rendered_radiance_goes_through_the_whole_chain(name: str) -> None:
    photons = np.full((24, 32, 31), 2e15, dtype=np.float32)
    photons[:, 16:] *= 0.25
    radiance = RadianceImage(photons, WavelengthGrid(), tangent_pitch=2e-3)
    lens = Lens("thin_lens", 0.004, 4.0, 1.2, Spectrum.constant(1.0))
    optical = compute_optical_image(radiance, lens, scene_distance_m=1.2)
    raw = capture(optical, replace(sensor(name), rows=20, cols=24), 0.02, rng=stream(1, "chain"), noise_flag=1)
    picture = process(raw, illuminant_correction="none" if name == "ideal-mono" else "gray_world")
    assert picture.rgb.shape == (20, 24, 3)
    assert np.all((picture.rgb >= 0) & (picture.rgb <= 1))
    assert picture.rgb[:, :8].mean() > picture.rgb[:, -8:].mean()
