"""``python -m fullwell_worker``: run a worker until it is asked to stop, or ask whether one is alive (``--health``)."""

from __future__ import annotations

import argparse
import logging
import os
import sys
from pathlib import Path

from fullwell.core import FullwellError, ServiceError
from fullwell.core.settings import Settings, load_settings
from fullwell_worker.health import check_health

__all__ = ["main"]


def main(arguments: list[str] | None = None) -> int:
    """Run the command; return its exit code."""
    parser = argparse.ArgumentParser(prog="fullwell worker", description="Run a queue worker.")
    parser.add_argument("--name", default="", help="name of this worker, shown in the status")
    parser.add_argument("--health", action="store_true", help="tell whether the worker of this machine is alive, and exit")
    given = parser.parse_args(arguments)
    try:
        settings = load_settings()
        if given.health:
            print(f"alive, last sign of life {max(map(check_health, _health_files(settings))):.1f} s ago")
            return 0
        return _run(settings, given.name)
    except FullwellError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1


def _run(settings: Settings, name: str) -> int:
    # Read by Celery when it is imported: a worker that is asked to end finishes its frame within the soft shutdown's time,
    # else hands the message back.
    os.environ.setdefault("REMAP_SIGTERM", "SIGQUIT")
    from fullwell.jobs.database import Database  # noqa: PLC0415
    from fullwell.jobs.logs import configure_logs  # noqa: PLC0415
    from fullwell_worker.application import QueueWorker, wait_for_schema  # noqa: PLC0415
    from fullwell_worker.kernels import bring_kernels  # noqa: PLC0415
    from fullwell_worker.materials import remove_leftovers  # noqa: PLC0415

    broker_url, settings = _connected(settings)
    configure_logs(level=logging.INFO)
    database = Database(settings.database)
    wait_for_schema(database)
    database.close()
    remove_leftovers()
    bring_kernels(settings.kernels)
    QueueWorker(settings, broker_url=broker_url, name=name).run()
    return 0


def _health_files(settings: Settings) -> list[Path]:
    """Return the worker's health file, or those of the embedded service's workers."""
    own = settings.health_file
    return [own] if settings.worker_health_file or own.exists() else sorted(own.parent.glob("worker-*.health")) or [own]


def _connected(settings: Settings) -> tuple[str, Settings]:
    """Return the broker's address: as set, or that of the embedded service of the same home folder."""
    if settings.broker_url:
        return settings.broker_url, settings
    from fullwell.jobs.embedded import running_service  # noqa: PLC0415

    service = running_service(settings.home)
    if service is None:
        raise ServiceError("no broker is set. Set FULLWELL_BROKER_URL, or start `fullwell serve` on this machine.")
    return service.broker_url, settings


if __name__ == "__main__":
    sys.exit(main())
