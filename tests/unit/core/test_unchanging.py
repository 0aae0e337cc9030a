"""Digests of what never changes."""

from __future__ import annotations

import dataclasses

import numpy as np

from fullwell.core.hashing import Unchanging, digest_of


@dataclasses.dataclass(frozen=True, slots=True, eq=False)
class Kept(Unchanging):
    values: np.ndarray


def test_digest_of_what_never_changes_is_its_content_and_worked_out_once() -> None:
    first, same, other = Kept(np.arange(3.0)), Kept(np.arange(3.0)), Kept(np.arange(4.0))
    assert digest_of([first, first]) == digest_of([same, first])
    assert digest_of(first) != digest_of(other)
    before = digest_of(first)
    first.values[0] = 7.0  # against the promise: what was worked out stays
    assert digest_of(first) == before
    assert digest_of(Kept(first.values)) != before
