"""Fixed pattern: differences between pixels that stay the same in every picture of one sensor."""

from __future__ import annotations

import threading
from collections import OrderedDict
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fullwell.core.rng import stream
from fullwell.sensor.parameters import SensorModel
from fullwell.sensor.substreams import split_keys

__all__ = [
    "ArrayWindow",
    "FixedPattern",
    "array_window",
    "dsnu_pattern_v",
    "fixed_pattern_stream",
    "fixed_patterns",
    "hot_pixels",
    "line_normals",
    "pixel_normals",
    "prnu_pattern",
]

_EFFECTS: Final = ("prnu", "dsnu", "dcnu", "hot_pixels", "columns", "rows", "column_gain")
"""Their order decides the streams: append only."""


@dataclass(frozen=True, slots=True)
class ArrayWindow:
    """The pixels that are read, as a part of the whole chip."""

    top: int
    left: int
    rows: int
    cols: int
    array_rows: int
    array_cols: int


@dataclass(frozen=True, slots=True)
class FixedPattern:
    """Keys of a sensor's fixed patterns; the patterns themselves are made from them, always the same.

    Attributes
    ----------
    keys
        One 128-bit key (two halves) for each effect.
    window
        The pixels that are read.
    """

    keys: tuple[tuple[int, int], ...]
    window: ArrayWindow

    def of_rows(self, first: int, count: int) -> FixedPattern:
        """Return the pattern of `count` of the window's rows from `first` on."""
        return FixedPattern(self.keys, replace(self.window, top=self.window.top + first, rows=count))

    def key(self, effect: str) -> tuple[int, int]:
        """Return the key of one effect."""
        return self.keys[_EFFECTS.index(effect)]


def fixed_pattern_stream(sensor: SensorModel) -> np.random.Generator:
    """Return the random stream of a sensor's fixed pattern: a fresh one at its start, the same for the same serial."""
    return stream(sensor.serial, "sensor", "fixed_pattern", sensor.name)


def fixed_patterns(sensor: SensorModel, rng: np.random.Generator, count: int) -> tuple[FixedPattern, ...]:
    """Return the fixed patterns of a sensor's `count` photodiodes, drawn from its stream, which advances.

    The first is that of a sensor with one photodiode.
    """
    keys, effects, window = split_keys(rng, len(_EFFECTS) * count), len(_EFFECTS), array_window(sensor)
    return tuple(FixedPattern(keys[k * effects : (k + 1) * effects], window) for k in range(count))


def array_window(sensor: SensorModel) -> ArrayWindow:
    """Return which pixels of the chip are read: its middle, moved up and left to a whole period of the colour filters.

    A sensor with more rows or columns than its chip is its own chip in that direction.
    """
    sides = []
    periods = (len(sensor.cfa.pattern), len(sensor.cfa.pattern[0]))
    for read, whole, period in zip((sensor.rows, sensor.cols), (sensor.array_rows, sensor.array_cols), periods, strict=True):
        full = max(read, whole)
        sides.append(((full - read) // 2 // period * period, full))
    (top, array_rows), (left, array_cols) = sides
    return ArrayWindow(top, left, sensor.rows, sensor.cols, array_rows, array_cols)


def prnu_pattern(pattern: FixedPattern, *, prnu_fraction: float) -> NDArray[np.float32] | None:
    """Return the relative responsivity of each pixel, (rows, cols), mean 1, standard deviation `prnu_fraction`, >= 0.

    None where it is 1 everywhere. It multiplies the photo-electrons only: dark current and offsets do not pass the filters
    and lenses it comes from.

    References
    ----------
    emva1288, photo response non-uniformity.
    """
    if prnu_fraction == 0:
        return None
    return np.asarray(np.maximum(1.0 + np.float32(prnu_fraction) * pixel_normals(pattern, "prnu"), np.float32(0.0)))


def dsnu_pattern_v(pattern: FixedPattern, *, dsnu_v: float) -> NDArray[np.float32] | None:
    """Return the dark offset of each pixel before the analog gain, (rows, cols) [V], mean 0, standard deviation `dsnu_v`.

    None where it is 0 everywhere. Independent of the exposure time.

    References
    ----------
    emva1288, dark signal non-uniformity.
    """
    if dsnu_v == 0:
        return None
    return np.asarray(np.float32(dsnu_v) * pixel_normals(pattern, "dsnu"))


def pixel_normals(pattern: FixedPattern, effect: str) -> NDArray[np.float32]:
    """Return standard normal numbers, one for each pixel of the window, (rows, cols), not writeable.

    Each row of the chip has a counter range of its own, so a window is a cut-out of the chip's pattern and costs only its own
    rows up to its right edge. Recent ones are kept.
    """
    window, key = pattern.window, pattern.key(effect)
    identity = (key, window.top, window.left, window.rows, window.cols)
    kept = _kept.get(identity)
    if kept is not None:
        return kept
    normals = np.empty((window.rows, window.cols), np.float32)
    line = np.empty(window.left + window.cols, np.float32)
    for row in range(window.rows):
        generator = _at(key, window.top + row)
        generator.standard_normal(out=line, dtype=np.float32)
        normals[row] = line[window.left :]
    normals.setflags(write=False)
    _kept.put(identity, normals)
    return normals


def line_normals(pattern: FixedPattern, effect: str) -> NDArray[np.float64]:
    """Return standard normal numbers, one for each column ("columns", "column_gain") or row ("rows") of the window."""
    window = pattern.window
    if effect == "rows":
        return _at(pattern.key(effect), 0).standard_normal(window.array_rows)[window.top : window.top + window.rows]
    return _at(pattern.key(effect), 0).standard_normal(window.array_cols)[window.left : window.left + window.cols]


def hot_pixels(pattern: FixedPattern, *, fraction: float) -> tuple[NDArray[np.intp], NDArray[np.intp], NDArray[np.float64]]:
    """Return rows, columns and relative strengths (exponentially distributed, mean 1) of the window's hot pixels, (n,) each.

    Their number on the chip is binomial; two may share a pixel and then add.
    """
    window, generator = pattern.window, _at(pattern.key("hot_pixels"), 0)
    count = int(generator.binomial(window.array_rows * window.array_cols, fraction))
    place = generator.integers(0, window.array_rows * window.array_cols, size=count)
    strength = generator.standard_exponential(count)
    rows, cols = place // window.array_cols - window.top, place % window.array_cols - window.left
    inside = (rows >= 0) & (rows < window.rows) & (cols >= 0) & (cols < window.cols)
    return rows[inside], cols[inside], strength[inside]


def _at(key: tuple[int, int], row: int) -> np.random.Generator:
    # The counter has 256 bits and a row uses far fewer than 2^64 steps of it.
    return np.random.Generator(np.random.Philox(key=np.array(key, dtype=np.uint64), counter=row << 64))


class _RecentPatterns:
    """The patterns used last, within a bound on their bytes; safe for threads."""

    def __init__(self, most_bytes: int) -> None:
        self._most_bytes = most_bytes
        self._patterns: OrderedDict[object, NDArray[np.float32]] = OrderedDict()
        self._lock = threading.Lock()

    def get(self, identity: object) -> NDArray[np.float32] | None:
        with self._lock:
            if identity in self._patterns:
                self._patterns.move_to_end(identity)
                return self._patterns[identity]
        return None

    def put(self, identity: object, pattern: NDArray[np.float32]) -> None:
        with self._lock:
            self._patterns[identity] = pattern
            while self._patterns and sum(kept.nbytes for kept in self._patterns.values()) > self._most_bytes:
                self._patterns.popitem(last=False)


_kept = _RecentPatterns(64 * 2**20)
