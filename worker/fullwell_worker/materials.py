"""The files of a job on the worker's disk: one folder per process, holding one job's files at a time."""

from __future__ import annotations

import contextlib
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path

from fullwell.core import StorageError, sha256_file
from fullwell.jobs.files import blob_key, check_files
from fullwell.jobs.processes import current_process, is_gone, process_from_text
from fullwell.storage import ObjectStore

__all__ = ["JobFolder", "remove_leftovers"]

FOLDER_PREFIX = "fullwell-job-"
OWNER_FILE = "owner.json"


class JobFolder:
    """Holds the files of the job at hand. Made anew for another job, so a disk holds at most one job's files per worker."""

    def __init__(self) -> None:
        self._root: Path | None = None
        self._job_id = ""

    def prepare(self, job_id: str, files: Mapping[str, str], store: ObjectStore) -> Path:
        """Return a folder that holds exactly the job's files, each checked against its digest."""
        if self._root is not None and self._job_id == job_id:
            return self._root / "files"
        self.clear()
        # A killed worker leaves its folder behind; the owner's name in it lets the next worker remove it.
        self._root = Path(tempfile.mkdtemp(prefix=FOLDER_PREFIX))
        (self._root / OWNER_FILE).write_text(current_process().to_text())
        base = self._root / "files"
        base.mkdir()
        for name, digest in check_files(files).items():
            _fetch(store, digest, base / name)
        self._job_id = job_id
        return base

    def clear(self) -> None:
        """Remove the folder."""
        if self._root is not None:
            shutil.rmtree(self._root, ignore_errors=True)
        self._root, self._job_id = None, ""


def _fetch(store: ObjectStore, digest: str, target: Path) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    store.fetch_to(blob_key(digest), target)
    if (found := sha256_file(target)) != digest:
        target.unlink()
        raise StorageError(f"the stored content of {target.name!r} has SHA-256 {found}, not {digest}. Upload the file again.")


def remove_leftovers() -> None:
    """Remove the folders of workers that were killed."""
    for folder in Path(tempfile.gettempdir()).glob(f"{FOLDER_PREFIX}*"):
        with contextlib.suppress(OSError):
            owner = process_from_text((folder / OWNER_FILE).read_text())
            if owner is not None and is_gone(owner):
                shutil.rmtree(folder, ignore_errors=True)
