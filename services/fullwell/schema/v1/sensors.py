"""Parts of a sensor in a recipe: filters, micro-lenses, crosstalk, photodiodes, and how it is exposed."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag, model_validator

from fullwell.schema.v1.common import (
    Document,
    Fraction,
    Name,
    NonNegative,
    Positive,
    PositiveOrInf,
    Range,
    Text,
    exactly_one,
    refuse,
)
from fullwell.schema.v1.spectra import Reflectance

__all__ = [
    "AutoExposureDocument",
    "BracketDocument",
    "BurstDocument",
    "CfaDocument",
    "CrosstalkDocument",
    "ExposureDocument",
    "MicrolensDocument",
    "PhotodiodeDocument",
    "ReadoutDocument",
]

_MOST_PIXELS = 64
_Kernel = Annotated[list[Annotated[list[Fraction], Field(min_length=3, max_length=3)]], Field(min_length=3, max_length=3)]
_Ratio = Annotated[float, Range(gt=0, le=1e6)]
_Offset = Annotated[list[Annotated[float, Range(ge=-1e-2, le=1e-2)]], Field(min_length=2, max_length=2)]


class AutoExposureDocument(Document):
    """Exposure time found from the noise-free image; `level` is a fraction of the saturation signal."""

    method: Literal["full", "mean", "percentile", "luminance", "centre_weighted", "highlight", "area"] = "percentile"
    level: Annotated[float, Range(gt=0, le=1)] = 0.7
    percentile: Annotated[float, Range(gt=0, le=100)] = 99.0
    area: Annotated[list[Fraction], Field(min_length=4, max_length=4)] | None = None
    min_time_s: Positive = 1e-6
    max_time_s: Positive = 1.0

    @model_validator(mode="after")
    def _ordered(self) -> AutoExposureDocument:
        if self.min_time_s > self.max_time_s:
            refuse(f"is {self.min_time_s:g}; must be <= max_time_s, {self.max_time_s:g}.", "min_time_s", value=self.min_time_s)
        if self.area is not None and self.method != "area":
            refuse(f"belongs to method: area; the method is {self.method}.", "area")
        return self


class BracketDocument(Document):
    """Exposures one after the other, `ratios` times the time, combined into one linear image."""

    ratios: list[_Ratio] = Field(min_length=2, max_length=16)
    combination: Literal["weighted", "select"] = "weighted"


class BurstDocument(Document):
    """`count` equal exposures one after the other, their "mean" or "sum"."""

    count: Annotated[int, Range(ge=2, le=256, whole=True)]
    combination: Literal["mean", "sum"] = "mean"


def _auto_or_ratios(value: Any) -> str | None:
    return "auto" if value == "auto" else "ratios" if isinstance(value, dict) else None


_ChannelRatios = Annotated[
    Annotated[Literal["auto"], Tag("auto")] | Annotated[dict[Name, _Ratio], Field(min_length=1), Tag("ratios")],
    Discriminator(
        _auto_or_ratios,
        custom_error_type="wrong_form",
        custom_error_message="must be a number by channel name, or auto: each channel by itself",
    ),
]


class ExposureDocument(Document):
    """A fixed `time_s`, or `auto`; and at most one of `bracket`, `burst` and `channel_ratios`."""

    time_s: Annotated[float, Range(gt=0, le=86400)] | None = None
    auto: AutoExposureDocument | None = None
    bracket: BracketDocument | None = None
    burst: BurstDocument | None = None
    channel_ratios: _ChannelRatios | None = None

    @model_validator(mode="after")
    def _one(self) -> ExposureDocument:
        exactly_one(self, "time_s", "auto")
        given = [key for key in ("bracket", "burst", "channel_ratios") if getattr(self, key) is not None]
        if len(given) > 1:
            refuse(f"is given beside {given[0]}; give at most one of bracket, burst and channel_ratios.", given[1])
        return self


def _name_or_rows(value: Any) -> str | None:
    return "name" if isinstance(value, str) else "rows" if isinstance(value, list) else None


def _name_or_spectra(value: Any) -> str | None:
    return "name" if isinstance(value, str) else "spectra" if isinstance(value, dict) else None


_Row = Annotated[list[Name], Field(min_length=1, max_length=_MOST_PIXELS)]
_Pattern = Annotated[
    Annotated[Text, Tag("name")] | Annotated[list[_Row], Field(min_length=1, max_length=_MOST_PIXELS), Tag("rows")],
    Discriminator(
        _name_or_rows,
        custom_error_type="wrong_form",
        custom_error_message="must be the name of a pattern or rows of channel names such as [[R, G], [G, B]]",
    ),
]
_Channels = Annotated[
    Annotated[Text, Tag("name")] | Annotated[dict[Name, Reflectance], Field(min_length=1, max_length=64), Tag("spectra")],
    Discriminator(
        _name_or_spectra,
        custom_error_type="wrong_form",
        custom_error_message="must be the name of a channel set or a spectrum by channel name",
    ),
]


class CfaDocument(Document):
    """The colour filter array: `pattern` (name or rows of channel names), `channels` (name of a set, or spectra by name).

    What is left out stays as the model has it. `filters` are transmittances that multiply every channel, `ir_cut_nm` adds an
    infrared cut filter.
    """

    pattern: _Pattern | None = None
    channels: _Channels | None = None
    filters: list[Reflectance] = Field(default_factory=list, max_length=16)
    ir_cut_nm: Annotated[float, Range(ge=400, le=1100)] | None = None


class MicrolensDocument(Document):
    """Relative illumination of the pixels: cos^exponent of the missed chief ray angle, or a table by radius."""

    exponent: Annotated[float, Range(ge=0, le=1000)] | None = None
    exit_pupil_distance_m: Positive | None = None
    design_distance_m: PositiveOrInf | None = None
    radius_m: Annotated[list[NonNegative], Field(min_length=1, max_length=1000)] | None = None
    ratio: Annotated[list[Fraction], Field(min_length=1, max_length=1000)] | None = None

    @model_validator(mode="after")
    def _one_way(self) -> MicrolensDocument:
        law = (self.exponent, self.exit_pupil_distance_m)
        table = (self.radius_m, self.ratio)
        ways = "give exponent and exit_pupil_distance_m (and design_distance_m), or radius_m and ratio."
        if any(part is not None for part in (*law, self.design_distance_m)) and any(part is not None for part in table):
            refuse(f"gives the falloff twice; {ways}")
        if None in law and None in table:
            refuse(f"is incomplete; {ways}")
        return self


class CrosstalkDocument(Document):
    """`kernel`: 3 x 3 shares of a pixel's electrons; `channels`: matrix that mixes the channels' quantum efficiencies."""

    kernel: _Kernel | None = None
    channels: list[list[Annotated[float, Range(ge=0, le=1e3)]]] | None = Field(default=None, min_length=1, max_length=64)

    @model_validator(mode="after")
    def _something(self) -> CrosstalkDocument:
        if self.kernel is None and self.channels is None:
            refuse("has none of kernel and channels; give one or both of them.")
        return self


class ReadoutDocument(Document):
    """One reading of a photodiode; `well_capacity_e` is what this reading can see, .inf by default."""

    name: Name
    conversion_gain_v_per_e: Positive
    read_noise_e: NonNegative
    reset_noise_e: NonNegative = 0.0
    well_capacity_e: PositiveOrInf | None = None
    analog_gain_ratio: Positive = 1.0


class PhotodiodeDocument(Document):
    """One of several photodiodes of a pixel, or the only one with several readouts."""

    name: Name
    fill_factor: Annotated[float, Range(gt=0, le=1)]
    well_capacity_e: Annotated[float, Range(gt=0, le=1e9)]
    readouts: list[ReadoutDocument] = Field(min_length=1, max_length=8)
    qe_ratio: Annotated[float, Range(gt=0, le=1)] = 1.0
    dark_current_e_per_s: NonNegative | None = None
    offset_m: _Offset | None = None
