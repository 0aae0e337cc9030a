"""Addresses of stores: what is understood, and that secrets never come back out."""

from __future__ import annotations

import pickle
import subprocess
import sys
from pathlib import Path

import pytest

from fullwell.core import FieldError
from fullwell.storage import LocalStore, redacted_url, store_from_url
from fullwell.storage.s3 import S3Store


def test_a_file_address_gives_a_local_store() -> None:
    store = store_from_url("file:///data/my%20objects")
    assert isinstance(store, LocalStore)
    assert store.root == Path("/data/my objects")


def test_an_s3_address_gives_an_s3_store() -> None:
    store = store_from_url("s3://key:sec%2Fret@minio:9000/frames?secure=0&region=eu-1")
    assert isinstance(store, S3Store)
    assert (store.endpoint, store.bucket, store.secure, store.region) == ("minio:9000", "frames", False, "eu-1")


def test_s3_speaks_https_where_nothing_else_is_said() -> None:
    store = store_from_url("s3://key:secret@s3.example.org/frames")
    assert isinstance(store, S3Store)
    assert store.secure


@pytest.mark.parametrize(
    "url",
    ["", "/just/a/path", "http://host/bucket", "file://relative/path", "s3://host/bucket", "s3://key@host/bucket",
     "s3://key:topsecret@host", "s3://key:topsecret@host/a/b", "s3://key:topsecret@/bucket", "s3://key:topsecret@host:port/b",
     "s3://key:topsecret@host/b?secure=maybe", "s3://key:top/secret@host/b", "s3://key:topsecret@host/b?secur=0"],
)  # fmt: skip
def test_addresses_that_are_not_understood_are_refused_without_the_secret(url: str) -> None:
    with pytest.raises(FieldError) as caught:
        store_from_url(url, "settings.store_url")
    assert caught.value.path == "settings.store_url"
    assert "secret@" not in str(caught.value)
    assert "topsecret" not in str(caught.value) + repr(caught.value.value)


def test_an_unknown_option_is_answered_with_the_nearest() -> None:
    with pytest.raises(FieldError, match="'secur' is not known; did you mean 'secure'"):
        store_from_url("s3://key:secret@host/bucket?secur=0")


def test_a_representation_holds_no_keys() -> None:
    store = store_from_url("s3://anaccess:topsecret@host:9000/bucket?secure=0")
    assert repr(store) == "S3Store('http://host:9000', bucket='bucket')"
    assert redacted_url("s3://anaccess:topsecret@host:9000/bucket") == "s3://***@host:9000/bucket"


def test_a_local_store_can_be_sent_to_another_process(tmp_path: Path) -> None:
    store = LocalStore(tmp_path)
    assert pickle.loads(pickle.dumps(store)).root == tmp_path


def test_importing_storage_does_not_load_the_s3_client() -> None:
    code = "import sys, fullwell.storage; sys.exit('minio' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
