"""Pixels with several photodiodes or several readouts of one: split pixels, dual conversion gain, lateral overflow."""

from __future__ import annotations

import math
from dataclasses import dataclass

from fullwell.sensor.checks import check_fraction, check_not_negative, check_positive, refusal

__all__ = ["Photodiode", "Readout"]


@dataclass(frozen=True, slots=True)
class Readout:
    """One reading of a photodiode's electrons; all readings of one photodiode see the same electrons.

    Attributes
    ----------
    name
        For the manifest, for example "high" and "low".
    conversion_gain_v_per_e
        [V/e-].
    read_noise_e, reset_noise_e
        Standard deviations of this reading's noise, and of reset noise that it does not cancel [e-].
    well_capacity_e
        Electrons that this reading can see [e-]: what the sense node holds at a high gain, or the photodiode's own well where
        the rest has flowed over into a capacitor. Infinite: as many as the photodiode holds.
    analog_gain_ratio
        Amplification behind the pixel, times the sensor's.
    """

    name: str
    conversion_gain_v_per_e: float
    read_noise_e: float
    reset_noise_e: float = 0.0
    well_capacity_e: float = math.inf
    analog_gain_ratio: float = 1.0

    def __post_init__(self) -> None:
        for path in ("conversion_gain_v_per_e", "analog_gain_ratio"):
            check_positive(path, getattr(self, path), of=f"readout {self.name!r}")
        for path in ("read_noise_e", "reset_noise_e"):
            check_not_negative(path, getattr(self, path), of=f"readout {self.name!r}")
        if not self.well_capacity_e > 0:
            raise refusal("well_capacity_e", self.well_capacity_e, "> 0", of=f"readout {self.name!r}")


@dataclass(frozen=True, slots=True)
class Photodiode:
    """One of a pixel's photodiodes.

    Attributes
    ----------
    name
        For the manifest, for example "large" and "small".
    fill_factor
        Share of the pixel's area, in (0, 1].
    well_capacity_e
        Electrons held [e-], a lateral overflow capacitor included.
    readouts
        One or more.
    qe_ratio
        Multiplies every channel's quantum efficiency, in (0, 1]: what a grey filter over a small photodiode leaves.
    dark_current_e_per_s
        At the reference temperature [e-/s]; None: the sensor's.
    offset_m
        (down, right) of the photodiode's centre from the pixel's [m]; None: the sensor's.
    """

    name: str
    fill_factor: float
    well_capacity_e: float
    readouts: tuple[Readout, ...]
    qe_ratio: float = 1.0
    dark_current_e_per_s: float | None = None
    offset_m: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        of = f"photodiode {self.name!r}"
        for path in ("fill_factor", "qe_ratio"):
            check_positive(path, getattr(self, path), of=of)
            check_fraction(path, getattr(self, path), of=of)
        check_positive("well_capacity_e", self.well_capacity_e, of=of)
        if self.dark_current_e_per_s is not None:
            check_not_negative("dark_current_e_per_s", self.dark_current_e_per_s, of=of)
        names = [readout.name for readout in self.readouts]
        if not names or len(set(names)) != len(names):
            raise refusal("readouts", names, "one or more, named differently from one another", of=of)
