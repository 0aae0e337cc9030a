"""Recording that a worker's child has died, from a process of its own: the worker's main process may hold no connection."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import asdict, dataclass
from typing import Final

from fullwell.core import FullwellError
from fullwell.core.settings import load_settings

__all__ = ["Loss", "main", "record_loss_in_a_process"]

PATIENCE_S: Final = 20.0


@dataclass(frozen=True, slots=True)
class Loss:
    """The work of a message whose worker died, and how: frames of a job, or one ingestion."""

    worker: str
    cause: str
    job_id: str = ""
    numbers: tuple[int, ...] = ()
    ingestion_id: str = ""


def record_loss_in_a_process(loss: Loss) -> None:
    """Record a loss and return when that is done; subprocess errors come through."""
    command = [sys.executable, "-m", "fullwell_worker.loss", json.dumps(asdict(loss))]
    subprocess.run(command, stdin=subprocess.DEVNULL, check=True, timeout=PATIENCE_S)


def main(arguments: list[str]) -> int:
    """Record the loss that is given as JSON."""
    from fullwell.jobs.database import Database  # noqa: PLC0415
    from fullwell.jobs.ingestions import IngestionRepository  # noqa: PLC0415
    from fullwell.jobs.records import RetryRule  # noqa: PLC0415
    from fullwell.jobs.repository import JobRepository  # noqa: PLC0415

    loss = Loss(**json.loads(arguments[0]))
    settings = load_settings()
    rule = RetryRule(settings.max_attempts, settings.retry_delay_s)
    try:
        database = Database(settings.database)
        if loss.ingestion_id:
            IngestionRepository(database).lose(loss.ingestion_id, worker=loss.worker, cause=loss.cause, rule=rule)
        else:
            JobRepository(database).lose(loss.job_id, loss.numbers, worker=loss.worker, cause=loss.cause, rule=rule)
    except FullwellError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
