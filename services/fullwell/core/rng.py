"""Named random streams: noise depends on the root seed and on what it is for, never on order or worker count."""

from __future__ import annotations

import hashlib

import numpy as np

from fullwell.core.hashing import canonical_json

__all__ = ["seed32", "stream"]


def _digest(root_seed: int, names: tuple[str | int, ...]) -> bytes:
    return hashlib.sha256(canonical_json([int(root_seed), *names])).digest()


def stream(root_seed: int, *names: str | int) -> np.random.Generator:
    """Return the Philox generator of one purpose, for example ``stream(seed, "sensor", frame, "imx363")``.

    Different names give independent streams; the same names give the same stream on every machine. Seed 0 is a seed.
    """
    key = int.from_bytes(_digest(root_seed, names)[:16], "little")
    return np.random.Generator(np.random.Philox(key=key))


def seed32(root_seed: int, *names: str | int) -> int:
    """Return a 32-bit seed of one purpose, for samplers that take no wider one."""
    return int.from_bytes(_digest(root_seed, names)[:4], "little")
