"""Edge-based spatial frequency response (e-SFR, ISO 12233): the MTF from the picture of a slanted edge.

Every pixel is one sample of the edge's profile at its distance from the edge; a slanted edge gives many distances within one
pixel, so the profile is known more finely than the pixels. Derived in docs/physics/metrics_edge_sfr.md.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fullwell.core.errors import FieldError, ShapeError, unknown_name_message

__all__ = ["EdgeResponse", "Window", "edge_sfr", "mosaic_edge_sfr"]

Window = Literal["tukey", "hamming", "none"]
"""Weight of the line spread function against the noise of its far ends: flat over the inner half with cosine ends (Tukey),
the Hamming window of ISO 12233's editions up to 2017, or equal weight."""

MIN_SIDE_PX: Final = 10
"""Fewer rows or columns hold no profile and both its plateaus."""

MIN_MARGIN_PX: Final = 4.0
"""The edge must stay this far inside the region's sides, so that both plateaus are seen in every row used."""

MIN_ROWS_SHARE: Final = 0.5
"""At least this share of the region's rows must be crossed by the edge."""

MIN_EXPLAINED: Final = 0.5
"""Least share of the pixels' variance that the distance from one straight line must explain; noise and texture give less."""

MAX_RISE_SHARE: Final = 0.7
"""The rise from 10 to 90 % may take this share of the profile's length; a shading never reaches its plateaus."""

MIN_STEP_SNR: Final = 1.0
"""Least step over the noise of a pixel: below it the line through the rows is not found reliably."""

BINS_PER_SAMPLE: Final = 4
"""Bins of the profile per sample pitch, as in ISO 12233."""

FREQUENCY_STEP_CYCLES_PER_PX: Final = 0.0025
_LOCATING_PASSES: Final = 5


@dataclass(frozen=True, slots=True, eq=False)
class EdgeResponse:
    """The response of a camera across one edge.

    Attributes
    ----------
    frequency_cycles_per_px
        (n,) frequency along the edge's normal, per pixel pitch, from 0 in equal steps; 0.5 is the sampling limit of the rows.
    mtf
        (n,) 1 at 0. Pixel aperture included, binning and differentiation divided out. Above the sampling limit it is valid too
        (the slant resolves it) but lies in noise sooner.
    edge_angle_deg
        Angle between the edge and the nearest of the pixel grid's axes, 0 to 45.
    orientation
        Which axis that is.
    edge_step
        Difference of the two plateaus, in the image's unit, > 0.
    residual
        Standard deviation of the pixels about the profile, same unit: the pixels' noise where the edge is straight.
    profile_distance_px, profile
        (m,) distance from the edge along its normal [px] and mean value there (the edge spread function).
    """

    frequency_cycles_per_px: NDArray[np.float64]
    mtf: NDArray[np.float64]
    edge_angle_deg: float
    orientation: Literal["vertical", "horizontal"]
    edge_step: float
    residual: float
    profile_distance_px: NDArray[np.float64]
    profile: NDArray[np.float64]

    def frequency_at(self, level: float) -> float | None:
        """Return where the MTF first falls to `level` [cycles/px], interpolated between the steps; None where it does not.

        Raises FieldError for a level outside 0 to 1.
        """
        if not 0 < level < 1:
            raise FieldError(f"level is {level}; must be between 0 and 1, for example 0.5.", path="level", value=level)
        below = np.flatnonzero(self.mtf <= level)
        if below.size == 0:
            return None
        k = int(below[0])
        share = (self.mtf[k - 1] - level) / (self.mtf[k - 1] - self.mtf[k])
        return float(self.frequency_cycles_per_px[k - 1] + share * FREQUENCY_STEP_CYCLES_PER_PX)

    @property
    def mtf50_cycles_per_px(self) -> float | None:
        """Where the MTF falls to 0.5 [cycles/px]; None where it stays above."""
        return self.frequency_at(0.5)

    @property
    def mtf10_cycles_per_px(self) -> float | None:
        """Where the MTF falls to 0.1 [cycles/px]; None where it stays above."""
        return self.frequency_at(0.1)

    def mtf_at(self, frequency_cycles_per_px: ArrayLike) -> NDArray[np.float64]:
        """Return the MTF at frequencies [cycles/px] within the range measured, same shape; beyond it NaN."""
        wanted = np.asarray(frequency_cycles_per_px, dtype=np.float64)
        return np.asarray(np.interp(wanted, self.frequency_cycles_per_px, self.mtf, left=np.nan, right=np.nan))


def edge_sfr(region: ArrayLike, *, window: Window = "tukey") -> EdgeResponse:
    """Return the e-SFR of one straight edge in a linear image.

    Parameters
    ----------
    region
        (rows, cols) linear values (volts, DN above black, linear luminance; not sRGB), any unit. One edge crosses it from side
        to side, near vertical or near horizontal, either side bright; 2 to 10 degrees off the grid is best.
    window
        Weight of the line spread function.

    Raises
    ------
    ShapeError
        Not two-dimensional, or fewer than 10 rows or columns.
    FieldError
        NaN or Inf; no edge (flat, noise, texture, shading); the edge leaves the region, or lies along the pixel grid.

    References
    ----------
    iso12233; burns2000 for the method's steps.
    """
    values = _checked_region(region)
    y, x = np.mgrid[: values.shape[0], : values.shape[1]].astype(np.float64)
    return _measure(x.ravel(), y.ravel(), values.ravel(), values.shape, pitch_px=1.0, window=_checked_window(window))


def mosaic_edge_sfr(
    region: ArrayLike, *, pattern: tuple[tuple[str, ...], ...], channel: str, window: Window = "tukey"
) -> EdgeResponse:
    """Return the e-SFR of one channel of a colour filter mosaic, from its own pixels, without demosaicing.

    `region` is (rows, cols) of the mosaic; ``pattern[0][0]`` is the region's own top-left pixel, so roll the sensor's pattern
    where the region starts at an odd pixel. Frequencies stay in cycles per pixel pitch of the sensor. Otherwise as `edge_sfr`.

    Raises
    ------
    FieldError
        As `edge_sfr`, and where the pattern has no such channel.
    """
    values = _checked_region(region)
    names = np.array(pattern)
    if channel not in names:
        message = unknown_name_message("channel", channel, {str(name) for name in names.ravel()})
        raise FieldError(message, path="channel", value=channel)
    rows, cols = values.shape
    tiled = np.tile(names == channel, (-(-rows // names.shape[0]), -(-cols // names.shape[1])))[:rows, :cols]
    y, x = np.nonzero(tiled)
    pitch_px = math.sqrt(names.size / np.count_nonzero(names == channel))
    where = (x.astype(np.float64), y.astype(np.float64))
    return _measure(*where, values[tiled], values.shape, pitch_px=pitch_px, window=_checked_window(window))


@dataclass(frozen=True, slots=True)
class _Line:
    """The edge x = offset + slope * y in coordinates where it is near vertical and dark on the left."""

    offset: float
    slope: float

    def distance(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return signed distances along the normal."""
        return (x - self.offset - self.slope * y) / math.hypot(1.0, self.slope)


def _measure(
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    values: NDArray[np.float64],
    shape: tuple[int, int],
    *,
    pitch_px: float,
    window: Window,
) -> EdgeResponse:
    """Return the response from scattered samples of a region of `shape`; `pitch_px` is the samples' mean spacing."""
    right, down = _gradient(x, y, values)
    across = abs(down) > abs(right)
    if across:
        x, y, shape = y, x, (shape[1], shape[0])
    if (down if across else right) < 0:
        values = -values  # only differences count from here on
    line = _locate(x, y, values, shape)
    distance = line.distance(x, y)
    half_px = _half_length(line, shape)
    near = np.abs(distance) < half_px
    bin_px = pitch_px / BINS_PER_SAMPLE
    centres, profile, residual = _profile(distance[near], values[near], half_px, bin_px)
    _check_profile(centres, profile, residual, values[near])
    frequency = np.arange(0.0, 1.0 / pitch_px + 0.5 * FREQUENCY_STEP_CYCLES_PER_PX, FREQUENCY_STEP_CYCLES_PER_PX)
    end = max(3, profile.size // 8)
    sign = -1.0 if (down if across else right) < 0 else 1.0
    return EdgeResponse(
        frequency_cycles_per_px=frequency,
        mtf=_transform(centres, profile, frequency, bin_px=bin_px, window=window),
        edge_angle_deg=math.degrees(math.atan(abs(line.slope))),
        orientation="horizontal" if across else "vertical",
        edge_step=float(np.mean(profile[-end:]) - np.mean(profile[:end])),
        residual=residual,
        profile_distance_px=centres,
        profile=sign * profile,
    )


def _gradient(x: NDArray[np.float64], y: NDArray[np.float64], values: NDArray[np.float64]) -> tuple[float, float]:
    """Return the slopes of the plane that fits best: across an edge it points from dark to bright."""
    if not np.ptp(values) > 0:
        raise _no_edge("every pixel has the same value")
    plane = np.stack([x - x.mean(), y - y.mean(), np.ones_like(x)], axis=1)
    right, down, _ = np.linalg.lstsq(plane, values, rcond=None)[0]
    return float(right), float(down)


def _locate(x: NDArray[np.float64], y: NDArray[np.float64], values: NDArray[np.float64], shape: tuple[int, int]) -> _Line:
    """Return the line through the rows' edge positions: centroids of each row's derivative, in a window that closes in."""
    rows = [np.flatnonzero(y == row) for row in np.unique(y)]
    low, high = np.percentile(values, [15.0, 85.0])
    width = float(shape[1])
    line, reach = _first_line(x, y, values, rows, middle=0.5 * (low + high)), 0.5 * width
    for _ in range(_LOCATING_PASSES):
        height, position = [], []
        for row in rows:
            centre = line.offset + line.slope * y[row[0]]
            if not MIN_MARGIN_PX <= centre <= width - 1 - MIN_MARGIN_PX:
                continue
            found = _row_centroid(x[row], values[row], centre, min(reach, centre + 1, width - centre))
            if found is not None:
                height.append(y[row[0]])
                position.append(found)
        if len(height) < max(5.0, MIN_ROWS_SHARE * len(rows)):
            raise FieldError(
                f"no edge crosses the region from side to side: one is found in {len(height)} of {len(rows)} rows (or columns) "
                f"at least {MIN_MARGIN_PX:g} px from the ends. Choose a region with the edge in its middle.",
                path="region",
                value=len(height),
            )
        line = _robust_line(np.array(height), np.array(position))
        reach = max(0.6 * reach, 8.0, 0.15 * width)
    return line


def _first_line(
    x: NDArray[np.float64], y: NDArray[np.float64], values: NDArray[np.float64], rows: list[NDArray[np.intp]], *, middle: float
) -> _Line:
    """Return a first line: in each row the place that has as many dark samples on its left as the row has in all."""
    bright = values > middle
    height, position = [], []
    for row in rows:
        dark = int(np.count_nonzero(~bright[row]))
        if 0 < dark < row.size:
            height.append(y[row[0]])
            position.append(0.5 * (x[row[dark - 1]] + x[row[dark]]))
    if len(height) < 5:
        raise _no_edge("fewer than 5 rows have a dark and a bright side")
    return _robust_line(np.array(height), np.array(position))


def _robust_line(height: NDArray[np.float64], position: NDArray[np.float64]) -> _Line:
    """Return the straight line through the rows' positions; rows far from it (defects, noise) are left out."""
    keep = np.ones(height.size, dtype=bool)
    slope, offset = 0.0, float(np.median(position))
    for _ in range(3):
        slope, offset = np.polyfit(height[keep], position[keep], 1)
        error = np.abs(position - offset - slope * height)
        keep = error <= max(4.0 * 1.4826 * float(np.median(error)), 0.05)
        if np.count_nonzero(keep) < 3:
            break
    return _Line(float(offset), float(slope))


def _row_centroid(x: NDArray[np.float64], values: NDArray[np.float64], centre: float, reach: float) -> float | None:
    """Return the centroid of a row's derivative under a Hamming window about `centre`, or None where nothing rises there."""
    middle = 0.5 * (x[1:] + x[:-1])
    offset = middle - centre
    inside = np.abs(offset) < reach
    weight = (0.54 + 0.46 * np.cos(np.pi * offset[inside] / reach)) * np.diff(values)[inside]
    total = float(np.sum(weight))
    if not total > 0:
        return None
    moment = float(np.sum(weight * offset[inside])) / total
    return centre + moment if abs(moment) < reach else None


def _half_length(line: _Line, shape: tuple[int, int]) -> float:
    """Return the half length of a profile that lies within the region on both sides of the middle of the edge [px]."""
    middle = line.offset + line.slope * 0.5 * (shape[0] - 1)
    return min(middle + 0.5, shape[1] - 0.5 - middle) / math.hypot(1.0, line.slope)


def _profile(
    distance: NDArray[np.float64], values: NDArray[np.float64], half_px: float, bin_px: float
) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Return bin centres (m,) [px], the edge profile (m,) there, and the standard deviation of the samples about it.

    The mean of a bin belongs to the mean distance of its samples; the local slope carries it to the bin's centre.
    """
    count = 2 * int(half_px / bin_px)
    index = np.floor(distance / bin_px).astype(np.int64) + count // 2
    inside = (index >= 0) & (index < count)
    distance, values, index = distance[inside], values[inside], index[inside]
    number = np.bincount(index, minlength=count)
    if np.any(number == 0):
        raise FieldError(
            f"{np.count_nonzero(number == 0)} of {count} bins of the edge's profile are empty: the edge lies along the pixel "
            "grid (or at a slope of small whole numbers), or the region is too short along the edge. Tilt the edge by 2 to 10 "
            "degrees, or choose a longer region.",
            path="region",
            value=int(np.count_nonzero(number == 0)),
        )
    centres = np.asarray((np.arange(count) - count // 2 + 0.5) * bin_px, dtype=np.float64)
    mean = np.bincount(index, values, count) / number
    lag = np.bincount(index, distance, count) / number - centres
    profile = np.asarray(mean, dtype=np.float64)
    for _ in range(2):
        profile = np.asarray(mean - lag * np.gradient(profile, bin_px), dtype=np.float64)
    error = values - np.interp(distance, centres, profile)
    return centres, profile, float(np.sqrt(np.sum(error**2) / max(error.size - count, 1)))


def _check_profile(
    centres: NDArray[np.float64], profile: NDArray[np.float64], residual: float, values: NDArray[np.float64]
) -> None:
    """Refuse what is no edge."""
    variance = float(np.var(values))
    end = max(3, profile.size // 8)
    dark, bright = float(np.mean(profile[:end])), float(np.mean(profile[-end:]))
    explained = 1.0 - residual**2 / variance if variance > 0 else 0.0
    if explained < MIN_EXPLAINED or bright - dark < MIN_STEP_SNR * residual:
        raise _no_edge(
            f"the distance from the best line explains {max(explained, 0.0):.0%} of the variance (needs "
            f"{MIN_EXPLAINED:.0%}), the step is {(bright - dark) / residual if residual > 0 else math.inf:.2g} times the noise"
        )
    share = (profile - dark) / (bright - dark)
    first = centres[int(np.flatnonzero(share >= 0.1)[0])]
    last = centres[int(np.flatnonzero(share <= 0.9)[-1])]
    if last - first > MAX_RISE_SHARE * (centres[-1] - centres[0]):
        raise _no_edge(
            f"the rise from 10 to 90 % takes {last - first:.1f} of {centres[-1] - centres[0]:.1f} px: no plateau is reached; "
            "choose a wider region"
        )


def _transform(
    centres: NDArray[np.float64],
    profile: NDArray[np.float64],
    frequency: NDArray[np.float64],
    *,
    bin_px: float,
    window: Window,
) -> NDArray[np.float64]:
    """Return the MTF: |Fourier transform| of the windowed differences of successive bins, over that at 0, corrected.

    A bin is the mean over its width and a difference the integral of the derivative over as much: each multiplies the
    spectrum by sinc(f w), and both are divided out exactly.
    """
    step = np.diff(profile)
    place = 0.5 * (centres[1:] + centres[:-1])
    half_px = -centres[0]
    peak = float(np.sum(place * step) / np.sum(step))
    weighted = step * _window(place - min(max(peak, -0.25 * half_px), 0.25 * half_px), half_px, window)
    spectrum = np.abs(np.exp(-2j * np.pi * np.outer(frequency, place)) @ weighted)
    return np.asarray(spectrum / spectrum[0] / np.sinc(frequency * bin_px) ** 2)


def _window(offset: NDArray[np.float64], half_px: float, window: Window) -> NDArray[np.float64]:
    """Return the weights at distances from the line spread function's centre."""
    if window == "none":
        return np.ones_like(offset)
    share = np.minimum(np.abs(offset) / half_px, 1.0)
    if window == "hamming":
        return np.asarray(0.54 + 0.46 * np.cos(np.pi * share))
    return np.asarray(np.where(share <= 0.5, 1.0, 0.5 + 0.5 * np.cos(2.0 * np.pi * (share - 0.5))))


def _no_edge(why: str) -> FieldError:
    return FieldError(f"the region holds no straight edge: {why}. Choose a region with one edge across it.", path="region")


def _checked_region(region: ArrayLike) -> NDArray[np.float64]:
    values = np.asarray(region, dtype=np.float64)
    if values.ndim != 2 or min(values.shape) < MIN_SIDE_PX:
        raise ShapeError(f"region has shape {values.shape}; must be (rows, cols), at least {MIN_SIDE_PX} x {MIN_SIDE_PX}.")
    if not np.all(np.isfinite(values)):
        raise FieldError("region holds NaN or Inf; every pixel must be finite.", path="region")
    return values


def _checked_window(window: Window) -> Window:
    if window not in get_args(Window):
        raise FieldError(unknown_name_message("window", window, get_args(Window)), path="window", value=window)
    return window
