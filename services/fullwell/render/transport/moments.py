"""An exposure cut into moments, in each of which the scene stands still; and which samples see which of them."""

from __future__ import annotations

from dataclasses import dataclass
from math import gcd

import numpy as np
from numpy.typing import NDArray

from fullwell.core.rng import seed32
from fullwell.scene import Camera, SceneDescription

__all__ = ["Moments", "Turns"]


@dataclass(frozen=True, slots=True, eq=False)
class Moments:
    """Equally long moments one after the other, and when the rows of the film are exposed.

    Attributes
    ----------
    scenes, cameras
        Of each moment, as they are in its middle. The very same scene may stand for several moments.
    start
        (rows,) when each film row's exposure begins, in moments after the beginning of the first.
    length
        How long the exposure of a row is, in moments.
    """

    scenes: tuple[SceneDescription, ...]
    cameras: tuple[Camera, ...]
    start: NDArray[np.float64]
    length: float

    @property
    def count(self) -> int:
        """Number of moments."""
        return len(self.scenes)


class Turns:
    """Which moment each sample of a pixel's replica falls into.

    Sample j of a replica is exposed at the share ``order[j modulo steps] + shift`` (modulo 1) of its row's exposure. The steps
    divide the exposure evenly, in an order in which each few are spread over it; the shift is random, one for each replica of
    each pixel. So every moment gets its share of the exposure on average, the replicas are independent, and their spread holds
    what time adds to the error. Which sample a moment gets depends on its number alone: all samples together are one sequence,
    the same as of a scene that stands still.
    """

    def __init__(self, moments: Moments, *, cols: int, replicas: int, seed: int, bands: int) -> None:
        """Prepare for a film of `cols` columns; `bands` is the number of spectral bands that are kept, 1 for none.

        The number of steps has no factor in common with the bands, which the samples visit by turns too: each band sees every
        moment.
        """
        self._moments, self._cols = moments, cols
        steps = max(2, int(np.ceil(moments.length)))
        while gcd(steps, bands) > 1:
            steps += 1
        self.steps = steps
        generator = np.random.Generator(np.random.Philox(key=seed32(seed, "moments")))
        self._shift = generator.random(size=(len(moments.start) * cols, replicas))
        self._order = np.argsort(np.argsort([_radical_inverse(k) for k in range(steps)], kind="stable"), kind="stable") / steps

    def moment(self, pixels: NDArray[np.int64], step: int) -> NDArray[np.int64]:
        """Return (pixels, replicas) the moment of the samples whose number is `step` modulo `steps`."""
        share = np.mod(self._order[step] + self._shift[pixels], 1.0)
        start = self._moments.start[pixels // self._cols]
        number = np.floor(start[:, None] + share * self._moments.length).astype(np.int64)
        return np.asarray(np.clip(number, 0, self._moments.count - 1))

    def span(
        self, first: NDArray[np.int64], count: NDArray[np.int64], step: int
    ) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return (first, count) of those of the samples [first, first + count) whose number is `step` modulo `steps`.

        Counted by turns: turn t is sample t x `steps` + `step`.
        """
        begin, end = (-((step - number) // self.steps) for number in (first, first + count))
        return begin, end - begin


def _radical_inverse(number: int) -> float:
    """Return a whole number with its binary digits mirrored at the point, in [0, 1)."""
    value, place = 0.0, 0.5
    while number:
        value += place * (number & 1)
        number, place = number >> 1, place / 2
    return value
