"""Documents keep their promises: links lead somewhere, and every effect has its module, its test and its page."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
EFFECTS = ROOT / "docs" / "effects.md"
COLUMNS = ("effect", "module", "test", "page", "status")
DOCUMENTS = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])

LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)(?:\s+\"[^\"]*\")?\)")
FENCE = re.compile(r"^(```|~~~).*?^\1", re.MULTILINE | re.DOTALL)
INLINE_CODE = re.compile(r"`[^`\n]+`")


def _name(path: Path) -> str:
    return str(path.relative_to(ROOT))


def _anchor(heading: str) -> str:
    """Return the fragment that a heading gets when it is shown on a code host."""
    plain = re.sub(r"[`*]|\[([^\]]*)\]\([^)]*\)", r"\1", heading)
    return re.sub(r"[^\w\- ]", "", plain.strip().lower()).replace(" ", "-")


def _anchors(path: Path) -> set[str]:
    return {_anchor(line.lstrip("#")) for line in FENCE.sub("", path.read_text()).splitlines() if line.startswith("#")}


@pytest.mark.parametrize("document", DOCUMENTS, ids=_name)
def test_relative_links_lead_somewhere(document: Path) -> None:
    text = INLINE_CODE.sub("", FENCE.sub("", document.read_text()))
    missing = []
    for target in LINK.findall(text):
        if re.match(r"[a-z][a-z0-9+.-]*:", target):
            continue
        file, _, fragment = target.partition("#")
        path = (document.parent / file).resolve() if file else document
        if not path.exists() or (fragment and path.suffix == ".md" and fragment not in _anchors(path)):
            missing.append(target)
    assert missing == []


def _effect_rows() -> list[dict[str, str]]:
    lines = EFFECTS.read_text().splitlines() if EFFECTS.is_file() else []
    cells = [[cell.strip() for cell in line.strip().strip("|").split("|")] for line in lines if line.lstrip().startswith("|")]
    rows: list[dict[str, str]] = []
    heading: list[str] = []
    for row in cells:
        if set("".join(row)) <= set("-: "):
            continue
        if tuple(cell.lower() for cell in row) == COLUMNS:
            heading = [cell.lower() for cell in row]
        elif heading and len(row) == len(heading):
            rows.append(dict(zip(heading, row, strict=True)))
    return rows


def _named_files(cell: str) -> list[str]:
    """Return the paths and dotted names of a cell: link targets, else what stands in backticks, else the words."""
    plain = [target.partition("#")[0] for target in LINK.findall(cell)] or re.findall(r"`([^`]+)`", cell)
    return plain or [word.strip(",;") for word in cell.split()]


def _exists(name: str) -> bool:
    path, _, _ = name.partition("::")
    bases = (ROOT, ROOT / "docs", ROOT / "tests", ROOT / "services", ROOT / "services" / "fullwell")
    if any((base / path).exists() for base in bases):
        return True
    dotted = ROOT / "services" / Path(*path.split("."))
    return dotted.is_dir() or dotted.with_name(f"{dotted.name}.py").is_file()


def test_the_table_of_effects_has_rows() -> None:
    assert _effect_rows(), f"docs/effects.md needs a table with the columns {' | '.join(COLUMNS)}"


@pytest.mark.parametrize("row", _effect_rows(), ids=lambda row: str(row["effect"]))
def test_every_effect_has_its_module_its_test_and_its_page(row: dict[str, str]) -> None:
    for column in ("module", "test", "page"):
        names = _named_files(row[column])
        assert names, f"{row['effect']}: the column {column} is empty"
        assert [name for name in names if not _exists(name)] == []
    assert row["status"], f"{row['effect']}: say how far it is validated"


def test_every_physics_page_is_in_the_table_of_effects() -> None:
    linked = {Path(name).name for row in _effect_rows() for name in _named_files(row["page"])}
    pages = {path.name for path in (ROOT / "docs" / "physics").glob("*.md")} - {"index.md", "README.md"}
    assert sorted(pages - linked) == []
