"""What a process loads, however indirectly: the API no renderer, the worker no web framework, the client nothing heavy."""

from __future__ import annotations

import subprocess
import sys

import pytest

RENDERERS = ("mitsuba", "drjit", "sumolib", "traci", "libsumo")
WEB = ("fastapi", "starlette", "uvicorn", "nicegui")

PROGRAM = """
import importlib, pkgutil, sys
package = importlib.import_module(sys.argv[1])
for module in pkgutil.walk_packages(package.__path__, package.__name__ + "."):
    if not module.name.endswith("__main__"):
        importlib.import_module(module.name)
print(" ".join(name for name in sys.argv[2:] if name in sys.modules))
"""


@pytest.mark.parametrize(
    ("package", "unwanted"),
    [
        ("fullwell_api", RENDERERS),
        ("fullwell_worker", WEB),
        ("fullwell.cli", (*RENDERERS, *WEB, "celery", "scipy", "colour")),
        ("fullwell.client", (*RENDERERS, *WEB, "celery", "scipy", "colour", "sqlalchemy")),
        ("fullwell.render", ("mitsuba", "drjit")),
        ("fullwell.jobs", (*RENDERERS, *WEB)),
    ],
)
def test_importing_a_package_loads_nothing_its_process_must_not_have(package: str, unwanted: tuple[str, ...]) -> None:
    command = [sys.executable, "-c", PROGRAM, package, *unwanted]
    child = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert child.returncode == 0, child.stderr
    assert child.stdout.split() == []
