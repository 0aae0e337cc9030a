"""Canonical JSON and digests: equal where the values are, different where they are not, the same on every machine."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fullwell.core import canonical_json, digest_of, sha256_file, sha256_hex

plain = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False) | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=20,
)


@dataclass(frozen=True)
class Point:
    x: float
    y: float


@dataclass(frozen=True)
class Vector:
    x: float
    y: float


def test_sha256_of_nothing_is_the_published_value() -> None:
    # FIPS 180-4 example values.
    assert sha256_hex(b"") == "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"
    assert sha256_hex(b"abc") == "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"


def test_a_files_digest_is_that_of_its_bytes(tmp_path: Path) -> None:
    content = bytes(range(256)) * 20_000
    (tmp_path / "file").write_bytes(content)
    assert sha256_file(tmp_path / "file") == sha256_hex(content)


def test_the_order_of_keys_does_not_matter() -> None:
    assert canonical_json({"b": 1, "a": [1, 2]}) == canonical_json({"a": [1, 2], "b": 1}) == b'{"a":[1,2],"b":1}'


def test_the_order_of_items_matters() -> None:
    assert digest_of([1, 2]) != digest_of([2, 1])


def test_minus_zero_is_zero() -> None:
    assert canonical_json(-0.0) == canonical_json(0.0) == b"0.0"


def test_numpy_scalars_are_plain_numbers() -> None:
    assert canonical_json([np.float64(0.1), np.int32(3), np.bool_(True)]) == b"[0.1,3,true]"


def test_text_is_kept_as_utf8() -> None:
    assert canonical_json("ü") == '"ü"'.encode()


def test_dataclasses_with_equal_fields_but_other_names_differ() -> None:
    assert digest_of(Point(1.0, 2.0)) == digest_of(Point(1.0, 2.0))
    assert digest_of(Point(1.0, 2.0)) != digest_of(Vector(1.0, 2.0))
    assert digest_of(Point(1.0, 2.0)) != digest_of(Point(2.0, 1.0))
    assert json.loads(canonical_json(Point(1.0, 2.0))) == {"type": "Point", "x": 1.0, "y": 2.0}


def test_arrays_count_by_content_shape_and_type_not_by_memory_layout() -> None:
    array = np.arange(6.0).reshape(2, 3)
    assert digest_of(array) == digest_of(np.asfortranarray(array)) == digest_of(np.tile(array, 2)[:, :3])
    others = (array.reshape(3, 2), array.astype(np.float32), array + 1e-15 * (array + 1), array[:, ::-1])
    assert len({digest_of(other) for other in (array, *others)}) == 5


def test_sets_do_not_depend_on_their_order() -> None:
    assert canonical_json({"b", "a", "c"}) == b'["a","b","c"]'


@pytest.mark.parametrize("value", [Path("a"), object(), b"bytes", 1j, int])
def test_what_is_not_content_is_refused(value: object) -> None:
    with pytest.raises(TypeError):
        canonical_json({"key": value})


def test_nan_is_refused_and_infinity_has_a_name() -> None:
    with pytest.raises(ValueError, match="NaN"):
        canonical_json([float("nan")])
    assert canonical_json([float("inf"), float("-inf")]) == b'["inf","-inf"]'


@given(plain)
def test_plain_values_return_from_canonical_json(value: object) -> None:
    assert json.loads(canonical_json(value)) == value


def test_digests_do_not_depend_on_the_hash_seed() -> None:
    code = "from fullwell.core import digest_of; print(digest_of({'names': {'x', 'y', 'z', 'w'}, 'b': 1.5}))"
    digests = {
        subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True, env={"PYTHONHASHSEED": seed}
        ).stdout
        for seed in ("0", "1", "2")
    }
    assert len(digests) == 1
