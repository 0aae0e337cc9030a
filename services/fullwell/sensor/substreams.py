"""Separate random streams for separate effects, so that switching one off leaves the others as they were."""

from __future__ import annotations

import numpy as np

__all__ = ["split_generator"]


def split_generator(rng: np.random.Generator, count: int) -> tuple[np.random.Generator, ...]:
    """Return `count` independent Philox generators keyed by 128-bit numbers drawn from `rng`, which advances."""
    keys = rng.integers(0, 2**64, size=(count, 2), dtype=np.uint64, endpoint=False)
    return tuple(np.random.Generator(np.random.Philox(key=key)) for key in keys)
