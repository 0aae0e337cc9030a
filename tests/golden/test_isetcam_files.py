"""Every file of ISETCam's reference numbers in compatibility mode; docs/validation/isetcam_golden.md has the differences."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from isetcam_comparisons import COMPARISONS, GOLDEN_TOLERANCE, STANDARD_ERRORS

ROOT = Path(__file__).resolve().parents[2]
TABLE = ROOT / "docs" / "validation" / "isetcam_golden.md"


@pytest.mark.parametrize("file", COMPARISONS)
def test_a_reference_file_is_reproduced(file: str, reference: Callable[[str], Any]) -> None:
    found = COMPARISONS[file](reference)
    assert found.values + found.statistics > 0
    assert found.largest <= GOLDEN_TOLERANCE, found.worst
    assert found.most_errors <= STANDARD_ERRORS, found.worst_statistic


def test_no_file_of_the_reference_is_left_out(reference: Callable[[str], Any]) -> None:
    reference("isetcam/spectra.json")  # skips where the reference is not there
    folder = Path(os.environ.get("FULLWELL_REFERENCE_DIR", ROOT.parent / "shared" / "reference")) / "isetcam"
    assert {path.stem for path in folder.glob("*.json")} == set(COMPARISONS)


def test_the_table_has_a_row_for_every_file() -> None:
    rows = [line for line in TABLE.read_text(encoding="utf-8").splitlines() if line.startswith("| `")]
    assert {row.split("`")[1] for row in rows} == {f"{name}.json" for name in COMPARISONS}
