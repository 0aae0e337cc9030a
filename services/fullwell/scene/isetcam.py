"""Scenes and optical images as ISETCam holds them: photons in double precision on a field of view in degrees."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fullwell.core.errors import FieldError, ShapeError
from fullwell.radiometry.grid import WavelengthGrid
from fullwell.radiometry.images import RadianceImage
from fullwell.radiometry.isetcam import bin_width_nm, check_wavelengths, observer_xyz, photometric_sum, photons_to_energy
from fullwell.scene.images import OpticalImage

__all__ = [
    "DEFAULT_DISTANCE_M",
    "IsetcamOpticalImage",
    "IsetcamScene",
    "from_optical_image",
    "scene_from_radiance",
    "with_illuminant",
    "with_mean_luminance",
]

DEFAULT_DISTANCE_M: Final = 1.2


def _checked_photons(photons: ArrayLike, bands: int, name: str) -> NDArray[np.float64]:
    cube = np.asarray(photons, dtype=np.float64)
    if cube.ndim == 2 and bands == 1:
        cube = cube[:, :, None]
    if cube.ndim != 3 or cube.shape[2] != bands or 0 in cube.shape:
        raise ShapeError(f"{name} has shape {cube.shape}; must be (rows, cols, {bands}), rows, cols >= 1.")
    low, high = float(np.min(cube)), float(np.max(cube))
    if not (low >= 0 and high < math.inf):
        raise FieldError(f"{name} ranges from {low} to {high}; must be finite and >= 0 everywhere.", path=name, value=low)
    return cube


def _check_range(name: str, value: float, low: float, high: float) -> None:
    if not low < value < high:
        raise FieldError(f"{name} is {value}; must be within ({low:g}, {high:g}). Set {name}.", path=name, value=value)


@dataclass(frozen=True, slots=True, eq=False)
class IsetcamScene:
    """Spectral radiance of a flat scene.

    Attributes
    ----------
    photons
        (rows, cols, bands) [photons s^-1 m^-2 sr^-1 nm^-1] sampled at `wavelength_nm`; row 0 is the top.
    wavelength_nm
        (bands,) [nm]; every bin has the width of the first spacing, a single one 1 nm.
    hfov_deg, distance_m
        Horizontal field of view [deg] and distance from the lens [m]. Samples are square.
    illuminant_photons
        (bands,) radiance of a perfect white under the scene's light, same unit as `photons`.

    Raises
    ------
    ShapeError, FieldError
        On making it with arrays that do not fit, NaN, Inf or negative photons, or a geometry out of range.
    """

    photons: NDArray[np.float64]
    wavelength_nm: NDArray[np.float64]
    hfov_deg: float
    distance_m: float
    illuminant_photons: NDArray[np.float64]

    def __post_init__(self) -> None:
        wave = check_wavelengths(self.wavelength_nm)
        object.__setattr__(self, "wavelength_nm", wave)
        object.__setattr__(self, "photons", _checked_photons(self.photons, wave.size, "photons"))
        light = np.asarray(self.illuminant_photons, dtype=np.float64)
        if light.shape != wave.shape:
            raise ShapeError(f"illuminant_photons has shape {light.shape}; must be {wave.shape}.")
        object.__setattr__(self, "illuminant_photons", light)
        _check_range("hfov_deg", self.hfov_deg, 0, 180)
        _check_range("distance_m", self.distance_m, 0, math.inf)

    @property
    def rows(self) -> int:
        """Number of rows."""
        return int(self.photons.shape[0])

    @property
    def cols(self) -> int:
        """Number of columns."""
        return int(self.photons.shape[1])

    @property
    def width_m(self) -> float:
        """Width in the scene [m]."""
        return 2.0 * self.distance_m * math.tan(math.radians(self.hfov_deg / 2))

    @property
    def height_m(self) -> float:
        """Height in the scene [m]."""
        return self.width_m / self.cols * self.rows

    @property
    def vfov_deg(self) -> float:
        """Vertical field of view [deg]."""
        return 2.0 * math.degrees(math.atan(self.height_m / 2 / self.distance_m))

    @property
    def luminance_cd_m2(self) -> NDArray[np.float64]:
        """(rows, cols) luminance [cd m^-2]."""
        return photometric_sum(self.photons, self.wavelength_nm)

    @property
    def mean_luminance_cd_m2(self) -> float:
        """Mean over the samples [cd m^-2]."""
        return float(np.mean(self.luminance_cd_m2))

    @property
    def xyz(self) -> NDArray[np.float64]:
        """(rows, cols, 3) CIE 1931 tristimulus values, Y in cd m^-2."""
        energy = photons_to_energy(self.photons, self.wavelength_nm)
        return np.asarray(683.0 * bin_width_nm(self.wavelength_nm) * (energy @ observer_xyz(self.wavelength_nm)))


@dataclass(frozen=True, slots=True, eq=False)
class IsetcamOpticalImage:
    """Spectral irradiance behind the lens, with ISETCam's dark border of an eighth on each side.

    Attributes
    ----------
    photons
        (rows, cols, bands) [photons s^-1 m^-2 nm^-1] sampled at `wavelength_nm`.
    wavelength_nm
        (bands,) [nm].
    sample_pitch_m
        Spacing of the samples on the sensor plane [m].
    image_distance_m
        From the lens to the image plane of the scene [m].
    focal_length_m
        Of the lens [m]; None takes the image distance, as for a scene at infinity. Automatic exposure of a crop mixes the
        two up.
    """

    photons: NDArray[np.float64]
    wavelength_nm: NDArray[np.float64]
    sample_pitch_m: float
    image_distance_m: float
    focal_length_m: float | None = None

    def __post_init__(self) -> None:
        wave = check_wavelengths(self.wavelength_nm)
        object.__setattr__(self, "wavelength_nm", wave)
        object.__setattr__(self, "photons", _checked_photons(self.photons, wave.size, "irradiance"))
        _check_range("sample_pitch_m", self.sample_pitch_m, 0, math.inf)
        _check_range("image_distance_m", self.image_distance_m, 0, math.inf)

    @property
    def rows(self) -> int:
        """Number of rows."""
        return int(self.photons.shape[0])

    @property
    def cols(self) -> int:
        """Number of columns."""
        return int(self.photons.shape[1])

    @property
    def width_m(self) -> float:
        """Width on the sensor plane [m]."""
        return self.sample_pitch_m * self.cols

    @property
    def hfov_deg(self) -> float:
        """Horizontal field of view with the border [deg]."""
        return 2.0 * math.degrees(math.atan(self.width_m / 2 / self.image_distance_m))

    @property
    def height_m(self) -> float:
        """Height on the sensor plane [m]."""
        return self.sample_pitch_m * self.rows

    @property
    def illuminance_lux(self) -> NDArray[np.float64]:
        """(rows, cols) illuminance [lx]."""
        return photometric_sum(self.photons, self.wavelength_nm)

    def on_grid(self, grid: WavelengthGrid, *, notes: tuple[str, ...] = ()) -> OpticalImage:
        """Return the image as the pipeline carries it. Raises ShapeError where `grid` has other band centres.

        The samples stay in double precision.
        """
        if grid.count != self.wavelength_nm.size or not np.allclose(grid.centres_nm, self.wavelength_nm, rtol=0, atol=1e-6):
            raise ShapeError(f"the image has {self.wavelength_nm.size} bands that are not those of the grid {grid}.")
        photons: NDArray[np.float32] = self.photons  # type: ignore[assignment]  # 1e-9 needs double precision
        return OpticalImage(photons=photons, grid=grid, sample_pitch_m=self.sample_pitch_m, notes=notes)


def from_optical_image(optical: OpticalImage, *, image_distance_m: float = 1.0) -> IsetcamOpticalImage:
    """Return the pipeline's optical image with its band means as samples at the band centres.

    The distance of the image plane matters only to ISETCam's automatic exposure by luminance, which works in angles.
    """
    return IsetcamOpticalImage(optical.photons, optical.grid.centres_nm, optical.sample_pitch_m, image_distance_m)  # type: ignore[arg-type]


def with_mean_luminance(scene: IsetcamScene, cd_m2: float) -> IsetcamScene:
    """Return the scene and its illuminant scaled so that the mean luminance is `cd_m2`.

    Raises
    ------
    FieldError
        The scene is black (ISETCam then gives NaN), or `cd_m2` is negative or not finite.
    """
    if not 0 <= cd_m2 < math.inf:
        raise FieldError(f"luminance_cd_m2 is {cd_m2}; must be >= 0 and finite.", path="luminance_cd_m2", value=cd_m2)
    present = scene.mean_luminance_cd_m2
    if not present > 0:
        raise FieldError(
            "the scene has no luminance, so it cannot be scaled (ISETCam gives NaN). Give it light between 360 and 830 nm.",
            path="luminance_cd_m2",
            value=cd_m2,
        )
    ratio = cd_m2 / present
    return replace(scene, photons=scene.photons * ratio, illuminant_photons=scene.illuminant_photons * ratio)


def with_illuminant(scene: IsetcamScene, illuminant_photons: ArrayLike) -> IsetcamScene:
    """Return the scene under another light, its mean luminance kept: photons x (new / old illuminant).

    `illuminant_photons` is (bands,), relative. Raises FieldError where the old light has none in a band.
    """
    new = np.asarray(illuminant_photons, dtype=np.float64)
    if new.shape != scene.illuminant_photons.shape:
        raise ShapeError(f"illuminant_photons has shape {new.shape}; must be {scene.illuminant_photons.shape}.")
    if not np.all(scene.illuminant_photons > 0):
        raise FieldError("the scene's light is 0 in some band, so its reflectances are not known.", path="illuminant_photons")
    changed = replace(scene, photons=scene.photons * (new / scene.illuminant_photons), illuminant_photons=new)
    return with_mean_luminance(changed, scene.mean_luminance_cd_m2)


def scene_from_radiance(radiance: RadianceImage, *, distance_m: float = DEFAULT_DISTANCE_M) -> IsetcamScene:
    """Return a rendered radiance image as a flat scene at `distance_m`; band means become samples at the band centres."""
    half_width = radiance.cols * radiance.tangent_pitch / 2
    return IsetcamScene(
        photons=np.asarray(radiance.photons, dtype=np.float64),
        wavelength_nm=radiance.grid.centres_nm,
        hfov_deg=2.0 * math.degrees(math.atan(half_width)),
        distance_m=distance_m,
        illuminant_photons=np.ones(radiance.grid.count),
    )
