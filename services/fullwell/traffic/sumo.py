"""SUMO's programs, run as programs: found in the installed package, with limits, and with errors that people can read."""

from __future__ import annotations

import math
import os
import resource
import signal
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from typing import Final

from fullwell.core.errors import FieldError

__all__ = ["SumoLimits", "TrafficError", "run_sumo_program", "sumo_home"]

_SHOWN_LINES: Final = 4
_MIB: Final = 1 << 20
_PATIENCE: Final = 5.0


class TrafficError(FieldError):
    """A road network or a traffic run cannot be made from what was given; carries the path of the field."""


@dataclass(frozen=True, slots=True)
class SumoLimits:
    """What one run of a program may take: processor time [s], memory and size of a written file [bytes].

    Time by the clock may be `_PATIENCE` times as long, on a machine that is busy with other things.
    """

    time_s: float = 120.0
    memory_bytes: int = 4096 * _MIB
    file_bytes: int = 1024 * _MIB


@cache
def sumo_home() -> Path:
    """Return the folder of the installed SUMO. Raises TrafficError where there is none."""
    spec = find_spec("sumo")
    for place in [] if spec is None else (spec.submodule_search_locations or []):
        if (Path(place) / "bin").is_dir():
            return Path(place)
    raise TrafficError("SUMO is not installed. Install fullwell[traffic].", "scene.traffic")


def run_sumo_program(
    name: str, arguments: Sequence[str], *, folder: Path, path: str, what: str, limits: SumoLimits | None = None
) -> tuple[str, ...]:
    """Run a program of SUMO in a folder and return its warnings.

    Parameters
    ----------
    name
        netgenerate, netconvert, duarouter or sumo.
    path, what
        The recipe's field and the thing in it, for errors: "the road network".

    Raises
    ------
    TrafficError
        The program failed, took too long or too much memory; with its own first error lines.
    """
    allowed = limits or SumoLimits()
    command = [str(sumo_home() / "bin" / name), *arguments]
    environment = {"SUMO_HOME": str(sumo_home()), "PATH": os.environ.get("PATH", ""), "LC_ALL": "C.UTF-8", "TZ": "UTC"}
    try:
        told = subprocess.run(
            command,
            cwd=folder,
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            errors="replace",
            timeout=_PATIENCE * allowed.time_s,
            check=False,
            preexec_fn=lambda: _limit(allowed),
        )
    except subprocess.TimeoutExpired:
        raise _too_long(path, name, what, _PATIENCE * allowed.time_s) from None
    except OSError as error:
        raise TrafficError(f"{path}: {name} could not be started ({error.strerror}).", path) from error
    lines = [line.strip() for line in (told.stderr + "\n" + told.stdout).splitlines()]
    if told.returncode == -signal.SIGXCPU:
        raise _too_long(path, name, what, allowed.time_s)
    if told.returncode != 0:
        errors = [_without_folder(line, folder) for line in lines if line.startswith("Error")]
        cause = " ".join(errors[:_SHOWN_LINES]) or _ending(told.returncode)
        raise TrafficError(f"{path}: {name} cannot use {what}. {cause}", path)
    return tuple(_without_folder(line.removeprefix("Warning: "), folder) for line in lines if line.startswith("Warning"))


def _too_long(path: str, name: str, what: str, time_s: float) -> TrafficError:
    return TrafficError(f"{path}: {name} took longer than {time_s:g} s for {what}. Make it smaller.", path)


def _limit(limits: SumoLimits) -> None:
    seconds = math.ceil(limits.time_s)
    wanted = {resource.RLIMIT_AS: limits.memory_bytes, resource.RLIMIT_FSIZE: limits.file_bytes, resource.RLIMIT_CPU: seconds}
    for kind, value in wanted.items():
        _, hard = resource.getrlimit(kind)
        resource.setrlimit(kind, (value if hard == resource.RLIM_INFINITY else min(value, hard), hard))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))


def _without_folder(line: str, folder: Path) -> str:
    return line.removeprefix("Error: ").replace(f"{folder}/", "")


def _ending(code: int) -> str:
    return f"It died by signal {-code}." if code < 0 else f"It ended with exit code {code}."
