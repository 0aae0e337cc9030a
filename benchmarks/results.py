"""Results that outlive a run, bounded time, and pages that scripts fill in."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fullwell.core.files import write_atomically
from fullwell.core.hashing import digest_of

__all__ = ["DOCS", "Deadline", "ResultStore", "cost_at_error", "fill_page", "markdown_table", "number"]

Record = dict[str, Any]

DOCS = Path(__file__).resolve().parents[1] / "docs" / "benchmarks"
"""Where the pages and plots are."""


class ResultStore:
    """Records by key, each in a file of its own in one folder: a run that is stopped loses at most what was under way.

    A key is plain data (scene, size, engine with version, budget, seed); a rerun finds what is there and does the rest.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        folder.mkdir(parents=True, exist_ok=True)

    def get(self, key: Record) -> Record | None:
        """Return the record of a key, or None."""
        path = self._path(key)
        return json.loads(path.read_text())["record"] if path.is_file() else None

    def put(self, key: Record, record: Record) -> None:
        """Keep a record."""
        with write_atomically(self._path(key)) as partial:
            partial.write_text(json.dumps({"key": key, "record": record}, indent=1) + "\n")

    def all(self) -> list[tuple[Record, Record]]:
        """Return all (key, record) pairs, in an order that does not depend on when they were made."""
        documents = [json.loads(path.read_text()) for path in sorted(self._folder.glob("*.json"))]
        pairs = [(document["key"], document["record"]) for document in documents]
        return sorted(pairs, key=lambda pair: json.dumps(pair[0], sort_keys=True))

    def _path(self, key: Record) -> Path:
        return self._folder / f"{digest_of(key)[:24]}.json"


class Deadline:
    """Wall time that a run may take; what would not fit any more is not begun."""

    def __init__(self, minutes: float) -> None:
        self._until = time.monotonic() + 60 * minutes

    @property
    def left_s(self) -> float:
        """Seconds left, never negative."""
        return max(0.0, self._until - time.monotonic())

    def allows(self, seconds: float = 0.0) -> bool:
        """Return whether `seconds` more fit."""
        return self.left_s > seconds


def cost_at_error(costs: ArrayLike, errors: ArrayLike, wanted: float, *, beyond: float = 2.0) -> float | None:
    """Return the cost at which a renderer reaches the error `wanted`, between its runs on a log-log scale.

    Where a costlier run happens to have a larger error than a cheaper one, the cheaper counts as having the larger too. Beyond
    the first or last run the error is taken to fall as one over the root of the cost, by a factor of `beyond` at most;
    farther away, or without runs, the answer is None.
    """
    order = np.argsort(np.asarray(costs, dtype=np.float64))
    cost = np.log(np.asarray(costs, dtype=np.float64)[order])
    error = np.log(np.maximum(np.asarray(errors, dtype=np.float64)[order], 1e-12))
    if not cost.size or not wanted > 0:
        return None
    error = np.maximum.accumulate(error[::-1])[::-1]
    goal = math.log(wanted)
    nearest = cost[0], error[0]
    if goal <= error[-1]:
        nearest = cost[-1], error[-1]
    elif goal < error[0]:
        return float(np.exp(np.interp(goal, error[::-1], cost[::-1])))
    if abs(goal - nearest[1]) > math.log(beyond):
        return None
    return float(np.exp(nearest[0] - 2.0 * (goal - nearest[1])))


def number(value: float | None, digits: int = 3) -> str:
    """Return a number for a table, with `digits` significant ones; a dash where there is none."""
    if value is None or not math.isfinite(value):
        return "-"
    if value == 0:
        return "0"
    places = max(0, digits - 1 - math.floor(math.log10(abs(value))))
    if value >= 10**digits:
        return f"{value:,.0f}".replace(",", " ")
    return f"{value:.{places}f}"


def markdown_table(header: Sequence[str], rows: Iterable[Sequence[str]], *, left: int = 1) -> str:
    """Return a table; all columns but the first `left` are right-aligned."""
    rule = ["---" if column < left else "---:" for column in range(len(header))]
    return "\n".join("| " + " | ".join(row) + " |" for row in [header, rule, *rows])


def fill_page(page: Path, name: str, content: str) -> None:
    """Replace what stands between ``<!-- name -->`` and ``<!-- /name -->`` in a page.

    Raises ValueError where the page has no such place.
    """
    text = page.read_text(encoding="utf-8")
    first, last = f"<!-- {name} -->", f"<!-- /{name} -->"
    if text.count(first) != 1 or text.count(last) != 1:
        raise ValueError(f"{page.name} must have one {first} and one {last}")
    before, _, rest = text.partition(first)
    _, _, after = rest.partition(last)
    with write_atomically(page) as partial:
        partial.write_text(f"{before}{first}\n{content.strip()}\n{last}{after}", encoding="utf-8")
