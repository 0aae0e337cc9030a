"""What a local store does beyond the contract: crashes, vanishing folders, permissions."""

from __future__ import annotations

import os
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from fullwell.core import StorageError
from fullwell.storage import LocalStore

CRASH = """
import io, os, sys
from pathlib import Path
from fullwell.storage import LocalStore

class Crashing(io.RawIOBase):
    pieces = 0
    def read(self, size=-1):
        self.pieces += 1
        if self.pieces > 2:
            os._exit(9)
        return b"x" * 1000

LocalStore(Path(sys.argv[1])).put("jobs/1/product.bin", Crashing(), if_absent=sys.argv[2] == "1")
"""


@pytest.mark.parametrize("if_absent", [True, False])
def test_what_a_crash_leaves_is_never_listed_and_never_in_the_way(tmp_path: Path, if_absent: bool) -> None:
    command = [sys.executable, "-c", CRASH, str(tmp_path), str(int(if_absent))]
    assert subprocess.run(command, check=False).returncode == 9
    left = [file for file in tmp_path.rglob("*") if file.is_file()]
    assert len(left) == 1
    assert left[0].name.endswith(".partial")

    store = LocalStore(tmp_path)
    assert list(store.list()) == []
    assert not store.exists("jobs/1/product.bin")
    store.put("jobs/1/product.bin", b"whole", if_absent=if_absent)
    assert [found.key for found in store.list()] == ["jobs/1/product.bin"]
    assert store.get("jobs/1/product.bin") == b"whole"


def test_nothing_but_the_object_is_left_after_a_put(tmp_path: Path) -> None:
    LocalStore(tmp_path).put("a/b", b"x")
    assert [file.name for file in tmp_path.rglob("*")] == ["a", "b"]


def test_deleting_removes_folders_that_became_empty(tmp_path: Path) -> None:
    store = LocalStore(tmp_path / "root")
    store.put("a/b/c", b"x")
    store.put("a/d", b"x")
    store.delete("a/b/c")
    assert not (tmp_path / "root/a/b").exists()
    store.delete("a/d")
    assert (tmp_path / "root").is_dir()
    assert list((tmp_path / "root").iterdir()) == []


@pytest.mark.slow
def test_writers_survive_a_deleter_that_removes_their_folder(tmp_path: Path) -> None:
    store = LocalStore(tmp_path)
    done = threading.Event()

    def delete() -> None:
        while not done.is_set():
            store.delete("deep/er/one")

    with ThreadPoolExecutor(2) as pool:
        deleters = [pool.submit(delete) for _ in range(2)]
        try:
            for number in range(300):
                store.put("deep/er/one" if number % 2 else "deep/er/two", b"x")
                store.put("deep/er/three", b"x")
                store.delete("deep/er/two")
                assert store.get("deep/er/three") == b"x"
                store.delete("deep/er/three")
        finally:
            done.set()
        for deleter in deleters:
            deleter.result()


def test_symbolic_names_of_other_places_are_not_reachable(tmp_path: Path) -> None:
    (tmp_path / "secret").write_text("secret")
    store = LocalStore(tmp_path / "root")
    for key in ("../secret", "/etc/passwd", "a/../../secret"):
        with pytest.raises(Exception, match="not legal"):
            store.get(key)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(StorageError, match="FULLWELL_STORE_URL"):
        LocalStore(tmp_path).check()


def test_a_root_that_is_a_file_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    with pytest.raises(StorageError, match="FULLWELL_STORE_URL"):
        LocalStore(tmp_path / "file").check()
