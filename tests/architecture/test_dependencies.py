"""Installs are reproducible: versions only, and none missing."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PIN = re.compile(r"([A-Za-z0-9][A-Za-z0-9._-]*)==([0-9][A-Za-z0-9.!+_-]*)")


def _folded(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def _pins() -> list[str]:
    lines = (ROOT / "constraints" / "constraints.txt").read_text().splitlines()
    return [line for line in lines if line and not line.startswith("#")]


def test_constraints_are_names_and_versions_only() -> None:
    assert [line for line in _pins() if not PIN.fullmatch(line)] == []


def test_every_requirement_of_the_project_has_a_tested_version() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    extras = project["project"]["optional-dependencies"].values()
    wanted = [
        *project["project"]["dependencies"],
        *project["build-system"]["requires"],
        *(name for extra in extras for name in extra),
    ]
    names = {_folded(re.split(r"[\[<>=!~; ]", name, maxsplit=1)[0]) for name in wanted} - {"fullwell"}
    pinned = {_folded(line.partition("==")[0]) for line in _pins()}
    assert sorted(names - pinned) == []


def test_each_package_is_pinned_once() -> None:
    names = [_folded(line.partition("==")[0]) for line in _pins()]
    assert sorted(names) == sorted(set(names))
