"""Random numbers of a path: Owen-scrambled Sobol points by hashing, padded pair by pair.

Each pair of dimensions is a two-dimensional Sobol sequence with its own nested uniform scramble and its own shuffle of the
sample order, all made from the sample's number by integer arithmetic: no tables, no state but that number, and any number of
samples may be added later. [Burley 2020; Laine and Karras 2011; constants of the hash: Vegdahl 2021]
"""

from __future__ import annotations

from typing import Any

__all__ = ["PathSampler", "hash_pair"]

_FLOAT_STEP = 2.0**-32
_BELOW_ONE = 1.0 - 2.0**-24


def hash_pair(mi: Any, a: Any, b: Any) -> Any:
    """Return a well-mixed UInt32 of two (finaliser of MurmurHash3)."""
    value = mi.UInt32(a) * 0x9E3779B1 + mi.UInt32(b)
    value = (value ^ (value >> 16)) * 0x85EBCA6B
    value = (value ^ (value >> 13)) * 0xC2B2AE35
    return value ^ (value >> 16)


def _scramble(value: Any, seed: Any) -> Any:
    """Return the Laine-Karras hash: an Owen scramble of the bit-reversed argument."""
    value = value ^ (value * 0x3D20ADEA)
    value = value + seed
    value = value * ((seed >> 16) | 1)
    value = value ^ (value * 0x05526C56)
    return value ^ (value * 0x53A22864)


class PathSampler:
    """Numbers for one sample of a path per lane: `seed` tells sequences apart, `sample` is the place in one (both UInt32)."""

    def __init__(self, mi: Any, seed: Any, sample: Any) -> None:
        import drjit as dr  # noqa: PLC0415 - the renderer is loaded late

        self._mi, self._dr = mi, dr
        self._seed = seed
        self._reversed = dr.brev(sample)

    def pair(self, dimension: Any) -> Any:
        """Return a Point2f in [0, 1)^2; `dimension` (UInt32 or int) numbers the pairs of a path."""
        mi, dr = self._mi, self._dr
        seed = hash_pair(mi, self._seed, dimension)
        index = dr.brev(_scramble(self._reversed, seed))
        x = index
        # The second Sobol generator is Pascal's triangle modulo 2: a Kronecker power of [[1, 1], [0, 1]].
        y = index
        y = y ^ ((y & 0xAAAAAAAA) >> 1)
        y = y ^ ((y & 0xCCCCCCCC) >> 2)
        y = y ^ ((y & 0xF0F0F0F0) >> 4)
        y = y ^ ((y & 0xFF00FF00) >> 8)
        y = y ^ ((y & 0xFFFF0000) >> 16)
        x = dr.brev(_scramble(x, hash_pair(mi, seed, 1)))
        y = dr.brev(_scramble(y, hash_pair(mi, seed, 2)))
        return mi.Point2f(self._fraction(x), self._fraction(y))

    def _fraction(self, bits: Any) -> Any:
        return self._dr.minimum(self._mi.Float(bits) * _FLOAT_STEP, _BELOW_ONE)
