"""Options of ingestion: what is refused, and that they and their error travel between processes."""

from __future__ import annotations

import json
import pickle

import pytest

from fullwell.assets.ingest import IngestError, IngestLimits, IngestOptions
from fullwell.assets.records import LicenceRecord
from fullwell.core.errors import AssetError, FieldError


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"unit_m": 0.0}, "unit_m"),
        ({"unit_m": float("nan")}, "unit_m"),
        ({"length_m": -1.0}, "length_m"),
        ({"unit_m": 1.0, "length_m": 4.0}, "length_m"),
        ({"up_axis": "w"}, "up_axis"),
        ({"forward_axis": "+x"}, "forward_axis"),
        ({"forward_axis": "-y", "up_axis": "y"}, "forward_axis"),
        ({"subdivide": 3}, "subdivide"),
        ({"max_texture_px": 0}, "max_texture_px"),
        ({"level_ratios": (0.5, 0.5)}, "level_ratios"),
        ({"level_ratios": (2.0,)}, "level_ratios"),
        ({"asset_class": "carr"}, "asset_class"),
        ({"id": "No Spaces"}, "id"),
        ({"tags": ("Big",)}, "tags"),
    ],
)
def test_illegal_options_are_refused_by_name(changes: dict[str, object], field: str) -> None:
    with pytest.raises(FieldError, match=field) as caught:
        IngestOptions(**{"id": "thing", **changes})  # type: ignore[arg-type]
    assert caught.value.path == field


def test_options_come_back_from_json() -> None:
    options = IngestOptions(
        id="a", asset_class="car", tags=("b", "a"), licence=LicenceRecord("CC0-1.0", "A. Author"), variants={"wheels": "wide"}
    )
    assert IngestOptions.from_document(json.loads(json.dumps(options.document()))) == options


@pytest.mark.parametrize("document", [{}, {"id": "a", "nonsense": 1}, {"id": "a", "licence": 3}, {"id": "a", "tags": 5}])
def test_damaged_options_are_refused(document: dict[str, object]) -> None:
    with pytest.raises(FieldError, match="damaged"):
        IngestOptions.from_document(document)


def test_limits_must_be_positive() -> None:
    with pytest.raises(FieldError, match="wall_s"):
        IngestLimits(wall_s=0.0)


def test_the_error_survives_pickling_with_its_cause() -> None:
    error = pickle.loads(pickle.dumps(IngestError("too much.", "file", "a.glb", "memory")))
    assert isinstance(error, IngestError)
    assert isinstance(error, AssetError)
    assert isinstance(error, FieldError)
    assert (error.message, error.path, error.value, error.cause) == ("too much.", "file", "a.glb", "memory")
