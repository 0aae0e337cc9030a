"""Signal to noise and dynamic range in the terms of EMVA 1288."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fullwell.core.errors import FieldError

__all__ = ["SensorFigures", "decibels", "sensor_figures", "snr_ratio", "stops"]


def snr_ratio(
    signal_e: ArrayLike,
    *,
    read_noise_e: float = 0.0,
    dark_e: float = 0.0,
    quantisation_step_e: float = 0.0,
    dsnu_e: float = 0.0,
    prnu_fraction: float = 0.0,
) -> NDArray[np.float64]:
    """Return signal over noise (a ratio of electrons), same shape as the signal; 0 where there is no signal.

    With `dsnu_e` and `prnu_fraction` it is EMVA's total SNR, without them the temporal one. No saturation: see `SensorFigures`.

    Parameters
    ----------
    signal_e
        Mean photo-electrons, >= 0.
    read_noise_e
        Standard deviation of the temporal dark noise [e-].
    dark_e
        Mean dark electrons; their shot noise counts, they are no signal [e-].
    quantisation_step_e
        Electrons per digital number [e-]; its variance is step^2 / 12.
    dsnu_e, prnu_fraction
        Spatial standard deviations of the offset [e-] and of the relative responsivity.

    Raises
    ------
    FieldError
        A negative value, NaN or Inf.

    References
    ----------
    emva1288, the chapters on sensitivity, linearity and noise (temporal terms) and on nonuniformity (total SNR).
    """
    terms = {
        "read_noise_e": read_noise_e,
        "dark_e": dark_e,
        "quantisation_step_e": quantisation_step_e,
        "dsnu_e": dsnu_e,
        "prnu_fraction": prnu_fraction,
    }
    for name, value in terms.items():
        _check_not_negative(name, value)
    signal = np.asarray(signal_e, dtype=np.float64)
    if not (np.all(signal >= 0) and np.all(np.isfinite(signal))):
        raise FieldError("signal_e holds NaN, Inf or negative values; must be >= 0 and finite.", path="signal_e")
    variance = signal + dark_e + read_noise_e**2 + quantisation_step_e**2 / 12.0 + dsnu_e**2 + (prnu_fraction * signal) ** 2
    return np.divide(signal, np.sqrt(variance), out=np.zeros_like(signal), where=signal > 0)


@dataclass(frozen=True, slots=True)
class SensorFigures:
    """What a data sheet of EMVA 1288 says about one channel.

    Attributes
    ----------
    absolute_sensitivity_threshold_e, absolute_sensitivity_threshold_photons
        Signal at which the temporal SNR is 1, in electrons and photons.
    saturation_capacity_e, saturation_capacity_photons
        The largest signal.
    snr_max_ratio
        Temporal SNR at saturation, shot noise only: the square root of the capacity.
    dynamic_range_ratio
        Capacity over threshold.
    """

    absolute_sensitivity_threshold_e: float
    absolute_sensitivity_threshold_photons: float
    saturation_capacity_e: float
    saturation_capacity_photons: float
    snr_max_ratio: float
    dynamic_range_ratio: float

    @property
    def snr_max_db(self) -> float:
        """Largest SNR [dB]."""
        return decibels(self.snr_max_ratio)

    @property
    def dynamic_range_db(self) -> float:
        """Dynamic range [dB]."""
        return decibels(self.dynamic_range_ratio)

    @property
    def dynamic_range_stops(self) -> float:
        """Dynamic range in factors of two."""
        return stops(self.dynamic_range_ratio)


def sensor_figures(
    *,
    saturation_capacity_e: float,
    read_noise_e: float,
    dark_e: float = 0.0,
    quantisation_step_e: float = 0.0,
    quantum_efficiency: float = 1.0,
) -> SensorFigures:
    """Return threshold, capacity, best SNR and dynamic range of a sensor.

    The threshold is the exact root of signal = noise, 1/2 + sqrt(1/4 + dark variance); EMVA prints the approximation
    1/2 + sqrt(dark variance), lower by at most 1/2 electron, where there is no dark noise.

    Parameters
    ----------
    saturation_capacity_e
        Full well, or what the ADC's full scale leaves of it [e-], > 0. Dark electrons use some of it.
    read_noise_e, dark_e, quantisation_step_e
        As for `snr_ratio`.
    quantum_efficiency
        Electrons per photon, in (0, 1].

    Raises
    ------
    FieldError
        A value outside its range, or dark electrons that fill the capacity.

    References
    ----------
    emva1288, absolute sensitivity threshold, saturation capacity, dynamic range.
    """
    for name, value in (("read_noise_e", read_noise_e), ("dark_e", dark_e), ("quantisation_step_e", quantisation_step_e)):
        _check_not_negative(name, value)
    if not 0 < quantum_efficiency <= 1:
        message = f"quantum_efficiency is {quantum_efficiency}; must be > 0 and at most 1."
        raise FieldError(message, path="quantum_efficiency", value=quantum_efficiency)
    capacity_e = saturation_capacity_e - dark_e
    if not 0 < capacity_e < math.inf:
        raise FieldError(
            f"saturation_capacity_e is {saturation_capacity_e}; must be finite and above the {dark_e:g} e- of dark signal. "
            "Shorten the exposure.",
            path="saturation_capacity_e",
            value=saturation_capacity_e,
        )
    dark_variance = read_noise_e**2 + dark_e + quantisation_step_e**2 / 12.0
    threshold_e = 0.5 + math.sqrt(0.25 + dark_variance)
    return SensorFigures(
        absolute_sensitivity_threshold_e=threshold_e,
        absolute_sensitivity_threshold_photons=threshold_e / quantum_efficiency,
        saturation_capacity_e=capacity_e,
        saturation_capacity_photons=capacity_e / quantum_efficiency,
        snr_max_ratio=math.sqrt(capacity_e),
        dynamic_range_ratio=capacity_e / threshold_e,
    )


def decibels(ratio: float) -> float:
    """Return 20 log10 of a ratio of amplitudes (electrons, volts) [dB]; -inf for 0."""
    return 20.0 * math.log10(ratio) if ratio > 0 else -math.inf


def stops(ratio: float) -> float:
    """Return log2 of a ratio; -inf for 0."""
    return math.log2(ratio) if ratio > 0 else -math.inf


def _check_not_negative(name: str, value: float) -> None:
    if not 0 <= value < math.inf:
        raise FieldError(f"{name} is {value}; must be >= 0 and finite.", path=name, value=value)
