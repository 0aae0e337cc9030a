"""Separate random streams for separate effects, so that switching one off leaves the others as they were."""

from __future__ import annotations

import numpy as np

__all__ = ["split_generator", "split_keys"]


def split_keys(rng: np.random.Generator, count: int) -> tuple[tuple[int, int], ...]:
    """Return `count` keys of 128 bits, as two halves each, drawn from `rng`, which advances.

    Asking for more keys leaves the first ones as they were.
    """
    keys = rng.integers(0, 2**64, size=(count, 2), dtype=np.uint64, endpoint=False)
    return tuple((int(low), int(high)) for low, high in keys)


def split_generator(rng: np.random.Generator, count: int) -> tuple[np.random.Generator, ...]:
    """Return `count` independent Philox generators keyed by 128-bit numbers drawn from `rng`, which advances."""
    keys = split_keys(rng, count)
    return tuple(np.random.Generator(np.random.Philox(key=np.array(key, dtype=np.uint64))) for key in keys)
