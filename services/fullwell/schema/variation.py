"""One recipe, many frames: what `vary` sets for each of them, independent of order and number."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

from fullwell.core.errors import FieldError
from fullwell.core.rng import stream
from fullwell.schema.v1.recipe import RecipeDocument
from fullwell.schema.v1.vary import Choice, Integer, LogUniform, Normal, Uniform, VaryDocument

__all__ = ["TIME_PATH", "clip_times", "extreme_values", "frame_values"]

TIME_PATH = "scene.traffic.time_s"
_MAX_REDRAWS = 1000


def frame_values(document: RecipeDocument, index: int) -> dict[str, Any]:
    """Return what `vary` sets for frame `index`: path to value, grid first. Raises FieldError outside 0 .. count - 1."""
    count = document.frame_count()
    if not 0 <= index < count:
        raise FieldError(f"frame {index} does not exist; must be >= 0 and <= {count - 1}.", path="index", value=index)
    vary = document.vary
    if vary is None:
        return {}
    draws = 1 if vary.random is None else vary.random.frames
    rest, moment = divmod(index // vary.repeat, 1 if vary.clip is None else vary.clip.frames)
    draw, cell = rest % draws, rest // draws
    values = _grid_values(vary, cell)
    if vary.random is not None:
        for path, distribution in vary.random.values.items():
            values[path] = _draw(distribution, document.seed, draw, path)
    if vary.clip is not None:
        values |= _clip_values(document, values, moment)
    return values


def clip_times(vary: VaryDocument, start_s: float) -> tuple[float, ...]:
    """Return the moments [s] of a clip that begins at `start_s`; that moment alone where the recipe makes no clip."""
    if vary.clip is None:
        return (start_s,)
    return tuple(round(start_s + number / vary.clip.frame_rate_hz, 6) for number in range(vary.clip.frames))


def _clip_values(document: RecipeDocument, values: dict[str, Any], moment: int) -> dict[str, Any]:
    """Return the time of a moment of the clip, and when its ego was chosen: at the first."""
    traffic = document.scene.traffic
    if traffic is None or document.vary is None:  # what a recipe refuses
        return {}
    start_s = float(values.get(TIME_PATH, traffic.time_s))
    found: dict[str, Any] = {TIME_PATH: clip_times(document.vary, start_s)[moment]}
    if traffic.ego is not None and traffic.ego.id is None and traffic.ego.chosen_at_s is None:
        found["scene.traffic.ego.chosen_at_s"] = start_s
    return found


def _grid_values(vary: VaryDocument, cell: int) -> dict[str, Any]:
    chosen: dict[str, Any] = {}
    for path, values in reversed(vary.grid.items()):
        cell, position = divmod(cell, len(values))
        chosen[path] = values[position]
    return dict(reversed(chosen.items()))


def _draw(distribution: Any, seed: int, draw: int, path: str) -> Any:
    """Return one value. The stream depends on the seed, the number of the draw and the path only."""
    rng = stream(seed, "vary", draw, path)
    match distribution:
        case Uniform(low=low, high=high):
            return min(low + (high - low) * rng.random(), high)
        case LogUniform(low=low, high=high):
            return min(max(low * math.exp(math.log(high / low) * rng.random()), low), high)
        case Integer(low=low, high=high):
            return min(low + math.floor((high - low + 1) * rng.random()), high)
        case Normal():
            return _normal(distribution, rng)
        case Choice():
            return _choice(distribution, rng.random())
        case _:
            raise TypeError(f"{type(distribution).__name__} is not a distribution")


def _normal(distribution: Normal, rng: Any) -> float:
    low = -math.inf if distribution.low is None else distribution.low
    high = math.inf if distribution.high is None else distribution.high
    value = distribution.mean
    for _ in range(_MAX_REDRAWS):
        value = distribution.mean + distribution.standard_deviation * float(rng.standard_normal())
        if low <= value <= high:
            return value
    return min(max(value, low), high)


def _choice(distribution: Choice, uniform: float) -> Any:
    weights = distribution.weights or [1.0] * len(distribution.values)
    threshold = uniform * math.fsum(weights)
    reached = 0.0
    for value, weight in zip(distribution.values, weights, strict=True):
        reached += weight
        if threshold < reached:
            return value
    return [value for value, weight in zip(distribution.values, weights, strict=True) if weight > 0][-1]


def extreme_values(vary: VaryDocument) -> Iterator[tuple[str, str, Any]]:
    """Yield (where it stands, path, value) for every value of the grid and the extremes of every distribution."""
    for path, values in vary.grid.items():
        for position, value in enumerate(values):
            yield f'vary.grid."{path}"[{position}]', path, value
    for path, distribution in ({} if vary.random is None else vary.random.values).items():
        where = f'vary.random.values."{path}"'
        if isinstance(distribution, Choice):
            for position, value in enumerate(distribution.values):
                yield f"{where}.values[{position}]", path, value
            continue
        for key in ("low", "mean", "high"):
            value = getattr(distribution, key, None)
            if value is not None:
                yield f"{where}.{key}", path, value
