"""Files appear whole or not at all."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest

from fullwell.core import atomic_write, write_atomically


def test_the_content_arrives_and_nothing_else(tmp_path: Path) -> None:
    atomic_write(tmp_path / "new" / "file.bin", b"content")
    assert (tmp_path / "new" / "file.bin").read_bytes() == b"content"
    assert [file.name for file in (tmp_path / "new").iterdir()] == ["file.bin"]


def test_a_failure_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    target = tmp_path / "file.bin"
    target.write_bytes(b"old")

    def fail() -> None:
        with write_atomically(target) as partial:
            partial.write_bytes(b"half")
            raise RuntimeError("broke")

    with pytest.raises(RuntimeError, match="broke"):
        fail()
    assert target.read_bytes() == b"old"
    assert [file.name for file in tmp_path.iterdir()] == ["file.bin"]


def test_a_block_that_writes_nothing_fails_and_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError), write_atomically(tmp_path / "file"):
        pass
    assert list(tmp_path.iterdir()) == []


def test_concurrent_writers_leave_one_whole_file(tmp_path: Path) -> None:
    target = tmp_path / "file.bin"
    contents = [bytes([number]) * 100_000 for number in range(8)]
    writers = [threading.Thread(target=atomic_write, args=(target, content)) for content in contents]
    for writer in writers:
        writer.start()
    for writer in writers:
        writer.join()
    assert target.read_bytes() in contents
    assert [file.name for file in tmp_path.iterdir()] == ["file.bin"]
