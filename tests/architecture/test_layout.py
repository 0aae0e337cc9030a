"""The rules of the source tree that no linter knows."""

from __future__ import annotations

import ast
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
LIBRARY = ROOT / "services" / "fullwell"
PACKAGE_FOLDERS = (LIBRARY, ROOT / "api" / "fullwell_api", ROOT / "worker" / "fullwell_worker")
PHYSICS = ("radiometry", "scene", "optics", "sensor", "isp", "render", "metrics", "labels")

NANOMETRE_FACTOR = re.compile(r"\b1(?:\.0*)?[eE][+-]?0*9\b")


def _sources(*folders: Path) -> list[Path]:
    return sorted(path for folder in folders for path in folder.rglob("*.py"))


def _name(path: Path) -> str:
    return str(path.relative_to(ROOT))


@pytest.mark.parametrize("folder", ["api", "worker", "services"])
def test_no_module_lies_loose_beside_the_packages(folder: str) -> None:
    assert list((ROOT / folder).glob("*.py")) == []


def test_every_folder_of_modules_is_a_package() -> None:
    folders = {path.parent for path in _sources(*PACKAGE_FOLDERS)}
    assert [_name(folder) for folder in sorted(folders) if not (folder / "__init__.py").is_file()] == []


@pytest.mark.parametrize("path", [path for path in _sources(*PACKAGE_FOLDERS) if path.name == "__init__.py"], ids=_name)
def test_every_package_says_what_is_public(path: Path) -> None:
    body = ast.parse(path.read_text()).body
    if all(isinstance(statement, ast.Expr) for statement in body):
        return  # a docstring alone exports nothing
    assert "__all__" in _assigned_names(body), f"{_name(path)} has no __all__"


@pytest.mark.parametrize("path", _sources(*PACKAGE_FOLDERS), ids=_name)
def test_every_module_says_what_it_is(path: Path) -> None:
    if path.name == "__init__.py" and not path.read_text().strip():
        pytest.fail(f"{_name(path)} is empty: one sentence says what the package is for")
    assert ast.get_docstring(ast.parse(path.read_text())), f"{_name(path)} has no docstring"


@pytest.mark.parametrize("path", _sources(*(LIBRARY / name for name in PHYSICS)), ids=_name)
def test_physics_code_has_no_bare_nanometre_factor(path: Path) -> None:
    """A named constant of a module may be 1e-9 (a tolerance, say); a factor between units is in core/constants.py."""
    tree = ast.parse(path.read_text())
    named = {id(number) for statement in tree.body for number in _numbers_of_constant(statement)}
    lines = path.read_text().splitlines()
    bare = [
        f"{_name(path)}:{node.lineno}: {lines[node.lineno - 1].strip()}"
        for node in ast.walk(tree)
        if isinstance(node, ast.Constant) and isinstance(node.value, float) and id(node) not in named
        if NANOMETRE_FACTOR.fullmatch(ast.get_source_segment(path.read_text(), node) or "")
    ]
    assert bare == [], "use NM_PER_M of fullwell.core.constants, or give the number a name and a reason"


def test_nothing_names_a_package_registry_or_a_place_on_one_machine() -> None:
    hosts = ("pypi", "pythonhosted", "test.pypi"), ("org",)
    words = [rf"{name}\.{end}" for name in hosts[0] for end in hosts[1]]
    words += ["proxy" + r"\.golang", "deb" + r"\.debian\.org", "registry" + r"\.npmjs", "--(?:extra-)?index" + "-url"]
    words += ["/wo" + "rk/(?:main|shared)", "/ro" + "ot/", "/ho" + "me/[a-z]+/"]
    forbidden = re.compile("|".join(words))
    found = [
        f"{_name(path)}:{number}: {line.strip()[:120]}"
        for path, text in _tracked_texts()
        for number, line in enumerate(text.splitlines(), start=1)
        if forbidden.search(line)
    ]
    assert found == []


def test_no_private_key_or_cloud_credential_is_committed() -> None:
    pattern = re.compile("BEGIN (?:RSA |EC |OPENSSH )?PRIVATE" + r" KEY|\bAKIA[0-9A-Z]{16}\b")
    assert [_name(path) for path, text in _tracked_texts() if pattern.search(text)] == []


def _tracked_texts() -> Iterator[tuple[Path, str]]:
    listing = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=False)
    if listing.returncode != 0:
        pytest.skip("this is not a checkout")
    for name in listing.stdout.split("\0"):
        path = ROOT / name
        if not name or not path.is_file() or path.stat().st_size > 2_000_000:
            continue
        try:
            yield path, path.read_text(encoding="utf-8")
        except UnicodeDecodeError:
            continue  # an image or a table of numbers


def _assigned_names(body: list[ast.stmt]) -> set[str]:
    names: set[str] = set()
    for statement in body:
        targets = statement.targets if isinstance(statement, ast.Assign) else []
        if isinstance(statement, ast.AnnAssign):
            targets = [statement.target]
        names |= {target.id for target in targets if isinstance(target, ast.Name)}
    return names


def _numbers_of_constant(statement: ast.stmt) -> list[ast.AST]:
    if isinstance(statement, ast.Assign | ast.AnnAssign) and all(name.isupper() for name in _assigned_names([statement])):
        return list(ast.walk(statement))
    return []
