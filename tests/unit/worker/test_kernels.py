"""Kernels that the image brings reach the user's cache, once, and none of it can stop a worker."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import yaml

from fullwell.schema import validate
from fullwell.schema.loading import document_of
from fullwell_worker.kernels import bring_kernels

ROOT = Path(__file__).resolve().parents[3]


def test_kernels_are_copied_where_there_are_none(tmp_path: Path) -> None:
    source, home = tmp_path / "image", tmp_path / "home"
    source.mkdir()
    for name in ("a.llvm.bin", "b.llvm.bin"):
        (source / name).write_bytes(name.encode())
    (home / ".drjit").mkdir(parents=True)
    (home / ".drjit" / "b.llvm.bin").write_bytes(b"own")
    assert bring_kernels(source, home) == 1
    assert bring_kernels(source, home) == 0
    assert (home / ".drjit" / "a.llvm.bin").read_bytes() == b"a.llvm.bin"
    assert (home / ".drjit" / "b.llvm.bin").read_bytes() == b"own"


def test_nothing_to_copy_or_nowhere_to_put_it_is_no_error(tmp_path: Path) -> None:
    assert bring_kernels(None) == 0
    assert bring_kernels(tmp_path / "absent", tmp_path) == 0
    (tmp_path / "x.bin").touch()
    (tmp_path / "home").write_text("a file")
    assert bring_kernels(tmp_path, tmp_path / "home") == 0


def test_the_recipe_of_the_warm_up_is_valid_and_a_failing_one_fails_no_build() -> None:
    document = document_of(yaml.safe_load((ROOT / "worker" / "warmup.yaml").read_text()))
    validate(document)
    lines = (ROOT / "worker" / "Dockerfile").read_text().replace("\\\n", " ").splitlines()
    (step,) = (line.removeprefix("RUN ") for line in lines if "warmup.yaml -o" in line)
    shell = shutil.which("sh") or "/bin/sh"
    build = subprocess.run([shell, "-c", step], env={"PATH": "/nonexistent"}, capture_output=True, text=True, check=False)
    assert "NOTICE: no kernels were compiled" in build.stdout
