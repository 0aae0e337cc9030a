"""Sensors of a recipe: the catalogue's model with what the recipe puts in its place, and the exposure."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from fullwell.core.errors import FieldError
from fullwell.radiometry import Spectrum
from fullwell.schema.conversion.context import Context, fail, located
from fullwell.schema.conversion.spectra import reflectance_of
from fullwell.schema.errors import RecipeError
from fullwell.schema.v1.cameras import SensorDocument
from fullwell.schema.v1.sensors import (
    CfaDocument,
    ExposureDocument,
    MicrolensDocument,
    PhotodiodeDocument,
    ReadoutDocument,
)
from fullwell.schema.v1.spectra import SpectrumTable
from fullwell.sensor.cfa import cfa_pattern
from fullwell.sensor.channel_sets import cfa_of, channel_set
from fullwell.sensor.crosstalk import mix_channels
from fullwell.sensor.dark_current import ArrheniusLaw, DoublingLaw
from fullwell.sensor.exposures import (
    AutoExposure,
    BracketExposure,
    BurstExposure,
    ChannelExposure,
    Exposure,
    FixedExposure,
    SingleExposure,
)
from fullwell.sensor.filters import infrared_cut, with_filters
from fullwell.sensor.microlens import ChiefRayFalloff, PixelFalloff, RadialFalloff
from fullwell.sensor.parameters import ColorFilterArray, SensorModel
from fullwell.sensor.photodiodes import Photodiode, Readout

__all__ = ["exposure_of", "sensor_model"]

_PER_PHOTODIODE = ("fill_factor", "well_capacity_e", "conversion_gain_v_per_e", "read_noise_e", "reset_noise_e")
"""Numbers that photodiodes and their readouts have of their own."""


def sensor_model(document: SensorDocument, path: str, context: Context) -> SensorModel:
    """Return the catalogue's model with the recipe's changes. Raises RecipeError with the path of what is wrong."""
    from fullwell.sensor.catalogue import sensor  # noqa: PLC0415 - the catalogue reads tables

    with located(f"{path}.model"):
        model = sensor(document.model, path=f"{path}.model")
    changes: dict[str, Any] = dict(document.overrides())
    if model.photodiodes and document.photodiodes is None:
        for key in _PER_PHOTODIODE:
            if key in changes:
                fail(
                    f"{path}.{key}",
                    f"has no effect: {model.name} has the photodiodes "
                    f"{', '.join(photodiode.name for photodiode in model.photodiodes)} with numbers of their own; set {path}."
                    "photodiodes.",
                    changes[key],
                )
    if document.photodiodes is not None:
        changes["photodiodes"] = tuple(
            _photodiode(photodiode, f"{path}.photodiodes[{k}]") for k, photodiode in enumerate(document.photodiodes)
        )
    if document.photodetector_offset_m is not None:
        changes["photodetector_offset_m"] = tuple(document.photodetector_offset_m)
    if document.dark_doubling_k is not None:
        changes["dark_current_law"] = DoublingLaw(document.dark_doubling_k)
    if document.dark_activation_energy_ev is not None:
        changes["dark_current_law"] = ArrheniusLaw(document.dark_activation_energy_ev)
    if document.microlens is not None:
        with _within(f"{path}.microlens"):
            changes["microlens"] = _falloff(document.microlens)
    changes["cfa"] = _cfa(document, model.cfa, path, context)
    if document.crosstalk is not None and document.crosstalk.kernel is not None:
        changes["crosstalk_kernel"] = tuple(tuple(row) for row in document.crosstalk.kernel)
    with _within(path, crosstalk_kernel="crosstalk.kernel"):
        return dataclasses.replace(model, **changes)


def exposure_of(document: ExposureDocument, model: SensorModel, path: str) -> Exposure:
    """Return the exposure. Raises RecipeError where the sensor cannot be exposed that way."""
    base = _single(document, path)
    if document.bracket is not None:
        return BracketExposure(base, tuple(document.bracket.ratios), document.bracket.combination)
    if document.burst is not None:
        return BurstExposure(base, document.burst.count, document.burst.combination)
    if document.channel_ratios is None:
        return base
    if model.photodiodes:
        fail(
            f"{path}.channel_ratios",
            f"need a sensor with one readout; {model.name} has several. Give a bracket, or take another model.",
            model.name,
        )
    if document.channel_ratios == "auto":
        with located(f"{path}.channel_ratios"):
            return ChannelExposure(base)
    names = model.cfa.channel_names
    for name in document.channel_ratios:
        if name not in names:
            fail(f"{path}.channel_ratios.{name}", f"is no channel of {model.name}; it has {', '.join(names)}.", name)
    return ChannelExposure(base, tuple(document.channel_ratios.items()))


def _single(document: ExposureDocument, path: str) -> SingleExposure:
    if document.auto is None:
        return FixedExposure(float(document.time_s or 0.0))
    auto = document.auto
    area = {} if auto.area is None else {"area": (auto.area[0], auto.area[1], auto.area[2], auto.area[3])}
    with _within(f"{path}.auto"):
        return AutoExposure(auto.method, auto.level, auto.percentile, auto.min_time_s, auto.max_time_s, **area)


@contextmanager
def _within(path: str, **names: str) -> Iterator[None]:
    """Give errors of the sensor's own checks the path of the recipe's field; `names` where the recipe calls it otherwise."""
    try:
        yield
    except RecipeError:
        raise
    except FieldError as error:
        field = names.get(error.path, error.path)
        raise RecipeError(f"{path}.{field}: {error.message}", f"{path}.{field}", error.value) from error


def _cfa(document: SensorDocument, own: ColorFilterArray, path: str, context: Context) -> ColorFilterArray:
    array = own
    if document.cfa is not None:
        array = _filtered(document.cfa, own, f"{path}.cfa", context)
    if document.crosstalk is not None and document.crosstalk.channels is not None:
        rows = document.crosstalk.channels
        where = f"{path}.crosstalk.channels"
        names = array.channel_names
        if len(rows) != len(names) or any(len(row) != len(names) for row in rows):
            fail(where, f"must be {len(names)} rows of {len(names)} numbers, for the channels {', '.join(names)}.")
        with located(where):
            array = mix_channels(array, np.array(rows))
    return array


def _filtered(document: CfaDocument, own: ColorFilterArray, path: str, context: Context) -> ColorFilterArray:
    pattern = own.pattern
    if isinstance(document.pattern, str):
        with located(f"{path}.pattern"):
            pattern = cfa_pattern(document.pattern, path=f"{path}.pattern")
    elif document.pattern is not None:
        pattern = tuple(tuple(row) for row in document.pattern)
        if len({len(row) for row in pattern}) != 1:
            fail(f"{path}.pattern", "has rows of different lengths; must be a rectangle of channel names.")
    with located(f"{path}.pattern"):
        array = cfa_of(pattern, _channels(document, own, path, context), path=f"{path}.pattern")
    filters = [
        reflectance_of(transmittance, f"{path}.filters[{k}]", context) for k, transmittance in enumerate(document.filters)
    ]
    if document.ir_cut_nm is not None:
        filters.append(infrared_cut(document.ir_cut_nm))
    return with_filters(array, *filters) if filters else array


def _channels(document: CfaDocument, own: ColorFilterArray, path: str, context: Context) -> dict[str, Spectrum]:
    if document.channels is None:
        return dict(own.channels)
    if isinstance(document.channels, str):
        with located(f"{path}.channels"):
            return channel_set(document.channels, path=f"{path}.channels")
    return {name: _efficiency(given, f"{path}.channels.{name}", context) for name, given in document.channels.items()}


def _efficiency(given: Any, path: str, context: Context) -> Spectrum:
    curve = reflectance_of(given, path, context)
    # A table of a quantum efficiency ends where the sensor was measured, not where it goes on as before.
    outside = "zero" if isinstance(given, SpectrumTable) else curve.outside
    return Spectrum(curve.wavelength_nm, curve.values, outside, "e- photon^-1", curve.source)


def _falloff(document: MicrolensDocument) -> PixelFalloff:
    if document.radius_m is not None:
        return RadialFalloff(tuple(document.radius_m), tuple(document.ratio or ()))
    design_m = math.inf if document.design_distance_m is None else document.design_distance_m
    return ChiefRayFalloff(document.exponent or 0.0, document.exit_pupil_distance_m or 0.0, design_m)


def _photodiode(document: PhotodiodeDocument, path: str) -> Photodiode:
    offset_m = None if document.offset_m is None else (document.offset_m[0], document.offset_m[1])
    with _within(path):
        return Photodiode(
            name=document.name,
            fill_factor=document.fill_factor,
            well_capacity_e=document.well_capacity_e,
            readouts=tuple(_readout(readout, f"{path}.readouts[{k}]") for k, readout in enumerate(document.readouts)),
            qe_ratio=document.qe_ratio,
            dark_current_e_per_s=document.dark_current_e_per_s,
            offset_m=offset_m,
        )


def _readout(document: ReadoutDocument, path: str) -> Readout:
    with _within(path):
        return Readout(
            name=document.name,
            conversion_gain_v_per_e=document.conversion_gain_v_per_e,
            read_noise_e=document.read_noise_e,
            reset_noise_e=document.reset_noise_e,
            well_capacity_e=math.inf if document.well_capacity_e is None else document.well_capacity_e,
            analog_gain_ratio=document.analog_gain_ratio,
        )
