"""The `fullwell` command: one typer application; each command lives in a module of its own and imports late."""

from __future__ import annotations

import functools
import sys

import typer

from fullwell.core.errors import FullwellError

__all__ = ["app", "main"]

app = typer.Typer(
    name="fullwell",
    help="Scene recipes become labelled, physically exact camera data.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


@functools.cache
def _register() -> None:
    """Add the commands to the application, once in a process."""
    from fullwell.cli import assets, bench, doctor, local, measure, service

    for module in (local, measure, service, assets, doctor, bench):
        module.register(app)


def main() -> None:
    """Run the command line. Exit code 0 done, 1 failed, 2 wrong usage."""
    _register()
    try:
        app()
    except FullwellError as error:
        print(f"error: {error}", file=sys.stderr)
        sys.exit(1)
