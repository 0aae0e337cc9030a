"""Lights, in physical units and named groups."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from fullwell.schema.v1.common import (
    Class,
    Direction,
    Document,
    Fraction,
    Group,
    Id,
    NonNegative,
    Number,
    Point,
    Range,
    Text,
    exactly_one,
    refuse,
)
from fullwell.schema.v1.geometry import AreaGeometry, Transform
from fullwell.schema.v1.materials import check_spd
from fullwell.schema.v1.spectra import Quantity, Spd

__all__ = [
    "AreaLight",
    "ConstantEnvironmentLight",
    "DirectionalLightDocument",
    "ImageEnvironmentLight",
    "LightDocument",
    "OvercastSkyLight",
    "PointLightDocument",
    "SpotLightDocument",
    "SunSkyLight",
]


class _Light(Document):
    name: Id
    group: Group = "default"


class AreaLight(_Light):
    """A black surface that emits on the side of its normal; it is an object of the scene with the light's name as id."""

    kind: Literal["area"]
    geometry: AreaGeometry
    transform: Transform | None = None
    semantic_class: Class = Field(default="", alias="class")
    radiance_w_sr_m2_nm: Quantity | None = None
    luminance_cd_m2: NonNegative | None = None
    luminous_flux_lm: NonNegative | None = None
    spd: Spd | None = None

    @model_validator(mode="after")
    def _one_quantity(self) -> AreaLight:
        check_spd(self, exactly_one(self, "radiance_w_sr_m2_nm", "luminance_cd_m2", "luminous_flux_lm"))
        return self


class PointLightDocument(_Light):
    """Equal intensity in all directions."""

    kind: Literal["point"]
    position_m: Point
    intensity_w_sr_nm: Quantity | None = None
    luminous_intensity_cd: NonNegative | None = None
    luminous_flux_lm: NonNegative | None = None
    spd: Spd | None = None

    @model_validator(mode="after")
    def _one_quantity(self) -> PointLightDocument:
        check_spd(self, exactly_one(self, "intensity_w_sr_nm", "luminous_intensity_cd", "luminous_flux_lm"))
        return self


class SpotLightDocument(_Light):
    """Full intensity within `beam_deg` of the axis, falling linearly in angle to 0 at `cutoff_deg` (half angles).

    Give `direction` or `target_m`. The intensity is that on the axis.
    """

    kind: Literal["spot"]
    position_m: Point
    direction: Direction | None = None
    target_m: Point | None = None
    beam_deg: Annotated[float, Range(gt=0, lt=90)]
    cutoff_deg: Annotated[float, Range(gt=0, lt=90)]
    intensity_w_sr_nm: Quantity | None = None
    luminous_intensity_cd: NonNegative | None = None
    luminous_flux_lm: NonNegative | None = None
    spd: Spd | None = None

    @model_validator(mode="after")
    def _consistent(self) -> SpotLightDocument:
        check_spd(self, exactly_one(self, "intensity_w_sr_nm", "luminous_intensity_cd", "luminous_flux_lm"))
        exactly_one(self, "direction", "target_m")
        if self.target_m == self.position_m:
            refuse("is also position_m; they must differ.", "target_m")
        if not self.beam_deg < self.cutoff_deg:
            refuse(f"is {self.beam_deg:g}; must be < cutoff_deg, {self.cutoff_deg:g}.", "beam_deg", value=self.beam_deg)
        return self


class DirectionalLightDocument(_Light):
    """Parallel light that travels along `direction`; the quantity is that on a surface facing it."""

    kind: Literal["directional"]
    direction: Direction
    irradiance_w_m2_nm: Quantity | None = None
    illuminance_lux: NonNegative | None = None
    spd: Spd | None = None

    @model_validator(mode="after")
    def _one_quantity(self) -> DirectionalLightDocument:
        check_spd(self, exactly_one(self, "irradiance_w_m2_nm", "illuminance_lux"))
        return self


class ConstantEnvironmentLight(_Light):
    """The same radiance from every direction. `illuminance_lux` is that of an unshaded horizontal plane."""

    kind: Literal["constant_environment"]
    radiance_w_sr_m2_nm: Quantity | None = None
    luminance_cd_m2: NonNegative | None = None
    illuminance_lux: NonNegative | None = None
    spd: Spd | None = None

    @model_validator(mode="after")
    def _one_quantity(self) -> ConstantEnvironmentLight:
        check_spd(self, exactly_one(self, "radiance_w_sr_m2_nm", "luminance_cd_m2", "illuminance_lux"))
        return self


class ImageEnvironmentLight(_Light):
    """A latitude-longitude picture (EXR, HDR, NPY linear; PNG, JPEG, TIFF as sRGB), zenith in row 0.

    A pixel of linear (1, 1, 1) has the given radiance or luminance. `azimuth_deg` turns the picture about +z.
    """

    kind: Literal["image_environment"]
    file: Text
    azimuth_deg: Number = 0.0
    radiance_w_sr_m2_nm: Quantity | None = None
    luminance_cd_m2: NonNegative | None = None
    spd: Spd | None = None

    @model_validator(mode="after")
    def _one_quantity(self) -> ImageEnvironmentLight:
        check_spd(self, exactly_one(self, "radiance_w_sr_m2_nm", "luminance_cd_m2"))
        return self


class _PlacedSun(_Light):
    """Where the sun is: by angles, or by time and place."""

    sun_elevation_deg: Annotated[float, Range(ge=-18, le=90)] | None = None
    time_utc: Text | None = None
    latitude_deg: Annotated[float, Range(ge=-90, le=90)] | None = None
    longitude_deg: Annotated[float, Range(ge=-180, le=180)] | None = None


class OvercastSkyLight(_PlacedSun):
    """The CIE's overcast sky: luminance (1 + 2 sin elevation) / 3 of that of the zenith, all around alike, no sun.

    As bright as `illuminance_lux` (of unshaded level ground) or `luminance_cd_m2` (of the zenith) says; or as overcast skies
    are on average with the sun at `sun_elevation_deg`, or where it is at `time_utc`, `latitude_deg` and `longitude_deg`.
    """

    kind: Literal["overcast_sky"]
    sun_elevation_deg: Annotated[float, Range(ge=0, le=90)] | None = None
    illuminance_lux: NonNegative | None = None
    luminance_cd_m2: NonNegative | None = None
    spd: Spd = "D65"

    @model_validator(mode="after")
    def _one_brightness(self) -> OvercastSkyLight:
        place = [self.time_utc, self.latitude_deg, self.longitude_deg]
        if any(value is not None for value in place):
            if None in place:
                refuse("gives a part of time_utc, latitude_deg and longitude_deg; give all three.")
            given = [self.illuminance_lux, self.luminance_cd_m2, self.sun_elevation_deg]
            if any(value is not None for value in given):
                refuse("says how bright it is twice; give a time and place, or one quantity.")
            return self
        exactly_one(self, "illuminance_lux", "luminance_cd_m2", "sun_elevation_deg")
        return self


class SunSkyLight(_PlacedSun):
    """Sun and clear sky in absolute units (x = east, y = north, z = up).

    The sun's place is either given by elevation and azimuth (clockwise from north) or computed from `time_utc`
    ("2024-06-21T10:30:00Z"), `latitude_deg` and `longitude_deg` (east positive). From the horizon down to -18 degrees the sky
    is that of twilight, without a sun. `sun_group` is the light group of the sun's
    disk, where it is not that of the sky.
    """

    kind: Literal["sun_sky"]
    sun_azimuth_deg: Number | None = None
    turbidity: Annotated[float, Range(ge=1, le=10)] = 3.0
    ground_albedo: Fraction = 0.2
    sun_group: Group | None = None
    sun_weight: NonNegative = 1.0
    sky_weight: NonNegative = 1.0

    @model_validator(mode="after")
    def _one_sun(self) -> SunSkyLight:
        angles = [self.sun_elevation_deg, self.sun_azimuth_deg]
        place = [self.time_utc, self.latitude_deg, self.longitude_deg]
        ways = "give sun_elevation_deg and sun_azimuth_deg, or time_utc, latitude_deg and longitude_deg."
        if any(v is not None for v in angles) and any(v is not None for v in place):
            refuse(f"gives the sun twice; {ways}")
        if None in angles and None in place:
            refuse(f"does not say where the sun is; {ways}")
        return self


LightDocument = Annotated[
    AreaLight
    | PointLightDocument
    | SpotLightDocument
    | DirectionalLightDocument
    | ConstantEnvironmentLight
    | ImageEnvironmentLight
    | OvercastSkyLight
    | SunSkyLight,
    Field(discriminator="kind"),
]
