"""Combination: several captures of one scene become one linear image."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fullwell.sensor.exposures import Combination

__all__ = ["SWITCH_LEVEL", "Capture", "Combined", "combine_captures"]

SWITCH_LEVEL: Final = 0.95
"""Share of the saturation signal above which a capture is left to a less sensitive one: noise must not reach the clip."""

MOST_BITS: Final = 24
"""Of a combined image; more would only digitise the noise."""


@dataclass(frozen=True, slots=True, eq=False)
class Capture:
    """One digitised capture.

    Attributes
    ----------
    group
        Captures of one group hold the same electrons (several readouts of one photodiode).
    dn, saturated
        (rows, cols) [DN], and where the well was full or the ADC at its full scale.
    black_level_dn, white_level_dn
        Of this capture, not rounded.
    electrons_per_dn
        [e-/DN].
    sensitivity_ratio
        Photo-electrons of this capture per photo-electron of the reference capture.
    dark_e, noise_e
        Mean dark electrons, which are subtracted as optically black pixels would tell them, and standard deviation of the
        noise without light, quantisation included [e-].
    """

    group: int
    dn: NDArray[np.uint16]
    saturated: NDArray[np.bool_]
    black_level_dn: float
    white_level_dn: float
    electrons_per_dn: float
    sensitivity_ratio: float
    dark_e: float
    noise_e: float

    @property
    def largest_signal(self) -> float:
        """Signal at saturation in photo-electrons of the reference capture [e-]."""
        span_e = (self.white_level_dn - self.black_level_dn) * self.electrons_per_dn
        return (span_e - self.dark_e) / self.sensitivity_ratio

    def signal(self) -> NDArray[np.float64]:
        """Return the photo-electrons of the reference capture that this one stands for, (rows, cols) [e-]."""
        electrons = (self.dn.astype(np.float64) - self.black_level_dn) * self.electrons_per_dn - self.dark_e
        return electrons / self.sensitivity_ratio

    def usable(self) -> NDArray[np.bool_]:
        """Return where the capture is far enough below saturation to be linear, (rows, cols)."""
        return self.dn < self.black_level_dn + SWITCH_LEVEL * (self.white_level_dn - self.black_level_dn)

    def variance(self, signal_e: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the variance of `signal` where the true one is `signal_e` [e-^2]."""
        electrons = self.sensitivity_ratio * np.maximum(signal_e, 0.0) + self.dark_e
        return np.asarray((electrons + self.noise_e**2) / self.sensitivity_ratio**2)


@dataclass(frozen=True, slots=True, eq=False)
class Combined:
    """A linear image of more range than its captures.

    `dn` (rows, cols) is uint16 or, above 16 bits, uint32; the other fields are those of RawImage, in the order of the captures
    for `used_fractions`.
    """

    dn: NDArray[np.uint16] | NDArray[np.uint32]
    black_level_dn: float
    white_level_dn: float
    electrons_per_dn: float
    bits: int
    saturated_fraction: float
    used_fractions: tuple[float, ...]


def combine_captures(captures: tuple[Capture, ...], combination: Combination) -> Combined:
    """Return one linear image of all captures, in steps of the finest one.

    Of each group the reading with the highest gain that is not near saturation counts; it holds the same electrons as the
    others with less noise. "select" takes the most sensitive usable group: at each change the signal-to-noise ratio dips.
    "weighted" takes the mean of all usable groups with inverse variances, whose signal comes from that selection. Where
    nothing is usable the least sensitive capture counts.

    References
    ----------
    debevec1997 (captures to one linear image); granados2010, sec. 3 (inverse variances of a camera's noise model);
    derived in docs/physics/hdr.md.
    """
    order = sorted(range(len(captures)), key=lambda k: captures[k].largest_signal)
    signals = [capture.signal() for capture in captures]
    last = order[-1]
    chosen = np.full(captures[0].dn.shape, last, dtype=np.intp)
    usable = [capture.usable() for capture in captures]
    for k in reversed(order[:-1]):
        chosen[usable[k]] = k
    selected = np.choose(chosen, signals) if len(captures) <= _MOST_CHOICES else _chosen(chosen, signals)
    used = [chosen == k for k in range(len(captures))]
    signal = selected
    if combination == "weighted":
        signal, used = _weighted(captures, order, signals, usable, selected)
        saturated_everywhere = ~np.any(usable, axis=0)
        signal = np.where(saturated_everywhere, selected, signal)
        used[last] |= saturated_everywhere
    return _digitised(captures, order, signal, used)


_MOST_CHOICES: Final = 32
"""numpy's limit on the choices of np.choose."""


def _chosen(chosen: NDArray[np.intp], signals: list[NDArray[np.float64]]) -> NDArray[np.float64]:
    return np.asarray(np.take_along_axis(np.stack(signals), chosen[None], axis=0)[0])


def _weighted(
    captures: tuple[Capture, ...],
    order: list[int],
    signals: list[NDArray[np.float64]],
    usable: list[NDArray[np.bool_]],
    selected: NDArray[np.float64],
) -> tuple[NDArray[np.float64], list[NDArray[np.bool_]]]:
    total, weights = np.zeros_like(selected), np.zeros_like(selected)
    used = [np.zeros(selected.shape, dtype=np.bool_) for _ in captures]
    for group in sorted({capture.group for capture in captures}):
        free = np.ones(selected.shape, dtype=np.bool_)
        for k in (k for k in order if captures[k].group == group):
            used[k] = usable[k] & free
            free &= ~usable[k]
            weight = np.where(used[k], 1.0 / captures[k].variance(selected), 0.0)
            total += weight * signals[k]
            weights += weight
    return np.divide(total, weights, out=np.zeros_like(total), where=weights > 0), used


def _digitised(
    captures: tuple[Capture, ...], order: list[int], signal_e: NDArray[np.float64], used: list[NDArray[np.bool_]]
) -> Combined:
    finest, last = captures[order[0]], captures[order[-1]]
    step_e = min(capture.electrons_per_dn / capture.sensitivity_ratio for capture in captures)
    black_dn = finest.black_level_dn
    white_dn = black_dn + last.largest_signal / step_e
    most_levels = 2.0**MOST_BITS - 1.0
    if white_dn > most_levels:
        step_e = last.largest_signal / (most_levels - black_dn)
        white_dn = most_levels
    bits = max(1, math.ceil(math.log2(white_dn + 1.0)))
    dn = np.rint(np.clip(signal_e / step_e + black_dn, 0.0, white_dn))
    return Combined(
        dn=dn.astype(np.uint16) if bits <= 16 else dn.astype(np.uint32),
        black_level_dn=black_dn,
        white_level_dn=white_dn,
        electrons_per_dn=step_e,
        bits=bits,
        saturated_fraction=float(np.mean(last.saturated)),
        used_fractions=tuple(float(np.mean(part)) for part in used),
    )
