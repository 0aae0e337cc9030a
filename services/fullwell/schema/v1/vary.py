"""How one recipe becomes many frames."""

from __future__ import annotations

import math
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from fullwell.schema.errors import RecipeError
from fullwell.schema.paths import parse_path
from fullwell.schema.v1.common import Count, Document, Number, Positive, Range, Whole, refuse

__all__ = ["ClipDocument", "Distribution", "RandomVariation", "VaryDocument"]

MAX_FRAMES = 1_000_000
_FrameCount = Annotated[int, Range(ge=1, le=MAX_FRAMES, whole=True)]


class Uniform(Document):
    """Any number from `low` to `high`, all equally likely."""

    distribution: Literal["uniform"]
    low: Number
    high: Number

    @model_validator(mode="after")
    def _ordered(self) -> Uniform:
        check_order(self)
        return self


class LogUniform(Document):
    """Numbers from `low` to `high` whose logarithm is uniform."""

    distribution: Literal["log_uniform"]
    low: Positive
    high: Positive

    @model_validator(mode="after")
    def _ordered(self) -> LogUniform:
        check_order(self)
        return self


class Normal(Document):
    """Gaussian; with `low` or `high`, values outside are drawn again (truncated, at most 1000 times, then clipped)."""

    distribution: Literal["normal"]
    mean: Number
    standard_deviation: Annotated[float, Range(ge=0)]
    low: Number | None = None
    high: Number | None = None

    @model_validator(mode="after")
    def _ordered(self) -> Normal:
        if self.low is not None and self.high is not None:
            check_order(self)
        return self


class Integer(Document):
    """Whole numbers from `low` to `high`, both included."""

    distribution: Literal["integer"]
    low: Whole
    high: Whole

    @model_validator(mode="after")
    def _ordered(self) -> Integer:
        check_order(self)
        return self


class Choice(Document):
    """One of `values` (anything the place may hold), with optional relative `weights`."""

    distribution: Literal["choice"]
    values: list[Any] = Field(min_length=1, max_length=100_000)
    weights: list[Annotated[float, Range(ge=0)]] | None = None

    @model_validator(mode="after")
    def _weights_fit(self) -> Choice:
        if self.weights is not None and len(self.weights) != len(self.values):
            refuse(f"has {len(self.weights)} entries; must be as many as values: {len(self.values)}.", "weights")
        if self.weights is not None and not sum(self.weights) > 0:
            refuse("must not all be 0.", "weights")
        return self


def check_order(document: Any) -> None:
    """Refuse a `low` above `high`."""
    if document.low > document.high:
        refuse(f"is {document.low:g}; must be <= high, {document.high:g}.", "low", value=document.low)


Distribution = Annotated[Uniform | LogUniform | Normal | Integer | Choice, Field(discriminator="distribution")]


def _check_path(path: str, *at: str) -> None:
    try:
        first = parse_path(path)[0]
    except RecipeError as error:
        refuse(f"is no place to vary: {error.message}", *at, value=path)
    if first in ("files", "name", "schema", "vary"):
        refuse(f"is no place to vary: {first} is the same for all frames.", *at, value=path)


class RandomVariation(Document):
    """`frames` draws of all `values` (path: distribution)."""

    frames: _FrameCount
    values: dict[str, Distribution] = Field(min_length=1, max_length=1000)


class ClipDocument(Document):
    """A clip of a traffic scene: `frames` moments at a frame rate, the first at scene.traffic.time_s.

    An ego that is chosen by rules is chosen at the first and keeps the cameras.
    """

    frames: _FrameCount
    frame_rate_hz: Annotated[float, Range(ge=0.01, le=1000)] = 10.0


class VaryDocument(Document):
    """Frames = product of the grid's list lengths x random.frames x clip.frames x repeat; the last of these varies fastest.

    `grid` (path: values) makes every combination, its last entry fastest. The draws of `random` are the same for every
    point of the grid. `clip` lets traffic go on from frame to frame. `repeat` renders the same frame again with other noise.
    """

    grid: dict[str, Annotated[list[Any], Field(min_length=1, max_length=100_000)]] = Field(default_factory=dict)
    random: RandomVariation | None = None
    clip: ClipDocument | None = None
    repeat: Count = 1

    @model_validator(mode="after")
    def _bounded(self) -> VaryDocument:
        if self.frame_count() > MAX_FRAMES:
            refuse(
                f"asks for {self.frame_count()} frames; must be <= {MAX_FRAMES}. Split the recipe.", value=self.frame_count()
            )
        for path in self.grid:
            _check_path(path, "grid", path)
        for path in {} if self.random is None else self.random.values:
            _check_path(path, "random", "values", path)
            if path in self.grid:
                refuse("is in grid and in random; keep one of them.", "grid", path)
        return self

    def frame_count(self) -> int:
        """Return the number of frames."""
        grid = math.prod(len(values) for values in self.grid.values())
        draws = 1 if self.random is None else self.random.frames
        return grid * draws * (1 if self.clip is None else self.clip.frames) * self.repeat
