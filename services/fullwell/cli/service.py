"""Commands around the service: serve, worker, submit, status, cancel, retry, fetch."""

from __future__ import annotations

import dataclasses
import json
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fullwell.core.errors import FieldError

if TYPE_CHECKING:
    from fullwell.client import Frame, FullwellClient, Job

__all__ = ["register"]

JobArgument = Annotated[str, typer.Argument(help="Job id, as submit and status show it.", metavar="JOB")]
JsonOption = Annotated[bool, typer.Option("--json", help="Report as JSON.")]
UrlOption = Annotated[str, typer.Option("--url", help="Address of the service; default FULLWELL_URL, else this machine's.")]

SHOWN_JOBS = 20
SHOWN_FRAMES = 20


def register(app: typer.Typer) -> None:
    """Add the commands of this module to `app`."""
    for command in (serve, worker, submit, status, cancel, retry, fetch):
        app.command()(command)


def serve(
    host: Annotated[str | None, typer.Option(help="Address to listen at; default 127.0.0.1.")] = None,
    port: Annotated[int | None, typer.Option(help="Port to listen at, 0 for any free one; default 8000.")] = None,
    workers: Annotated[int | None, typer.Option(help="Number of worker processes; default 1.", min=0)] = None,
    home: Annotated[Path | None, typer.Option(help="Folder for database, objects and logs; default FULLWELL_HOME.")] = None,
) -> None:
    """Run the whole service on this machine: API, pages, broker and workers. Ctrl-C stops it."""
    from fullwell.core.settings import load_settings
    from fullwell.jobs.supervisor import serve as run_service

    settings = load_settings(host=host, port=port, workers=workers, home=home)
    if not (settings.has_keys or settings.is_loopback or settings.allow_open):
        raise FieldError(
            f"host is {settings.host!r}: the service would be open to everyone who can reach it. "
            "Set FULLWELL_API_KEYS, or FULLWELL_ALLOW_OPEN=1 if that is meant.",
            "host",
            settings.host,
        )
    # The children read the environment; what was said on the command line must win there too.
    os.environ |= {"FULLWELL_HOST": settings.host, "FULLWELL_WORKERS": str(settings.workers)}
    run_service(settings, say=lambda text: print(text, flush=True))


def worker(
    name: Annotated[str, typer.Option(help="Name of this worker, shown in the status.")] = "",
    health: Annotated[bool, typer.Option("--health", help="Tell whether this machine's worker is alive, and exit.")] = False,
) -> None:
    """Run one more worker for the service of this machine, or for the one that the environment names."""
    arguments = [*(["--name", name] if name else []), *(["--health"] if health else [])]
    # In place of this process: signals and exit code are the worker's own.
    os.execv(sys.executable, [sys.executable, "-m", "fullwell_worker", *arguments])


def submit(
    recipe: Annotated[Path, typer.Argument(help="Recipe file, YAML or JSON.", metavar="RECIPE")],
    overrides: Annotated[
        list[str] | None, typer.Option("--set", help="Override one value: path=value, for example seed=7.")
    ] = None,
    files: Annotated[
        list[Path] | None, typer.Option("--file", help="A further file beside the recipe that its models need.")
    ] = None,
    priority: Annotated[int, typer.Option(min=0, max=9, help="0 is served first, 9 last.")] = 3,
    wait: Annotated[bool, typer.Option("--wait", help="Wait until the job has ended; exit code 1 if it is not done.")] = False,
    as_json: JsonOption = False,
    url: UrlOption = "",
) -> None:
    """Submit a recipe to the service, with the files that it names."""
    from fullwell.client import FullwellClient

    with FullwellClient(url) as client:
        job = client.submit(recipe, overrides=_parse_overrides(overrides), files=_beside(recipe, files), priority=priority)
        if wait:
            if not as_json:
                print(f"{job.id}: {job.frames.total} frame{'' if job.frames.total == 1 else 's'} of {job.name!r}", flush=True)
            job = _wait(client, job, quiet=as_json)
        failed = list(client.frames(job.id, state="failed")) if job.frames.failed else []
    if as_json:
        print(json.dumps(_job_document(job) | {"errors": [_frame_document(frame) for frame in failed]}, indent=2))
    elif wait:
        _print_job(job, failed)
    else:
        print(job.id)
        print(f"fullwell status {job.id} shows its progress.", file=sys.stderr)
    if wait and job.state != "done":
        raise typer.Exit(1)


def status(
    job_id: Annotated[str | None, typer.Argument(help="Job id; without it, the latest jobs.", metavar="[JOB]")] = None,
    as_json: JsonOption = False,
    url: UrlOption = "",
) -> None:
    """Show the latest jobs, or one job with its running and failed frames."""
    from fullwell.client import FullwellClient

    with FullwellClient(url) as client:
        if job_id is None:
            _show_jobs(client.jobs(limit=SHOWN_JOBS), as_json=as_json)
            return
        job = client.job(job_id)
        frames = list(client.frames(job_id)) if as_json else _frames_to_show(client, job)
    if as_json:
        print(json.dumps(_job_document(job) | {"frame_list": [_frame_document(frame) for frame in frames]}, indent=2))
        return
    _print_job(job, frames)


def cancel(job_id: JobArgument, as_json: JsonOption = False, url: UrlOption = "") -> None:
    """Cancel a job; what is done stays."""
    from fullwell.client import FullwellClient

    with FullwellClient(url) as client:
        job = client.cancel(job_id)
    if as_json:
        print(json.dumps(_job_document(job), indent=2))
        return
    running = f"; {job.frames.running} running frames stop after their present pass" if job.frames.running else ""
    print(f"{job.id} is being cancelled{running}" if not job.ended else f"{job.id} is {job.state}")


def retry(job_id: JobArgument, as_json: JsonOption = False, url: UrlOption = "") -> None:
    """Run the failed frames of a job again, and only those."""
    from fullwell.client import FullwellClient

    with FullwellClient(url) as client:
        count, job = client.retry(job_id)
    print(json.dumps(_job_document(job) | {"retried": count}, indent=2) if as_json else f"{count} frames of {job.id} run again")


def fetch(
    job_id: JobArgument,
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Folder for the frames; default the job's id.")] = None,
    as_json: JsonOption = False,
    url: UrlOption = "",
) -> None:
    """Load the products of the frames that are done, verified; run it again to resume. Exit code 1 if frames are missing."""
    from fullwell.client import FullwellClient

    folder = output if output is not None else Path(job_id)
    with FullwellClient(url) as client, _progress(quiet=as_json) as bars:
        bar = bars.add_task("fetching", total=None)
        fetched = client.fetch(
            job_id, folder, progress=lambda finished, total: bars.update(bar, completed=finished, total=total)
        )
    if as_json:
        document = dataclasses.asdict(fetched) | {"folder": str(fetched.folder)}
        print(json.dumps(document, indent=2))
    else:
        print(f"{len(fetched.frames)} frames in {fetched.folder}: {fetched.loaded} files loaded, {fetched.kept} were here")
        if fetched.missing:
            print(f"{len(fetched.missing)} frames are not done: {_numbers(fetched.missing)}", file=sys.stderr)
    if fetched.missing:
        raise typer.Exit(1)


def _wait(client: FullwellClient, job: Job, *, quiet: bool) -> Job:
    from fullwell.core.errors import ServiceError

    with _progress(quiet=quiet) as bars:
        bar = bars.add_task("queued", total=job.frames.total)

        def show(now: Job) -> None:
            counts = now.frames
            failed = f", {counts.failed} failed" if counts.failed else ""
            bars.update(bar, completed=counts.total - counts.queued - counts.running, description=f"{now.state}{failed}")

        try:
            if not quiet and client.workers() == 0:
                bars.console.print("No worker is connected yet; the job waits for one.", style="yellow")
        except ServiceError:
            pass  # not ready at this moment; waiting says more
        try:
            return client.wait(job.id, progress=show)
        except KeyboardInterrupt:
            bars.stop()
            print(f"The job goes on: fullwell status {job.id}, fullwell cancel {job.id}.", file=sys.stderr)
            raise typer.Exit(1) from None


def _progress(*, quiet: bool) -> Any:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    return Progress(*columns, console=Console(stderr=True), disable=quiet)


def _parse_overrides(words: list[str] | None) -> dict[str, str]:
    from fullwell.cli.local import parse_overrides

    return parse_overrides(words)


def _beside(recipe: Path, files: list[Path] | None) -> dict[str, Path]:
    """Return {path relative to the recipe: file} of the files given on the command line."""
    found: dict[str, Path] = {}
    for file in files or []:
        try:
            found[file.resolve().relative_to(recipe.resolve().parent).as_posix()] = file
        except ValueError:
            folder = recipe.resolve().parent
            raise FieldError(f"--file {str(file)!r} lies outside the recipe's folder, {folder}.", "--file", str(file)) from None
    return found


def _job_document(job: Job) -> dict[str, Any]:
    document = dataclasses.asdict(job)
    for key in ("created_at", "started_at", "finished_at"):
        document[key] = None if document[key] is None else document[key].isoformat()
    return document


def _frame_document(frame: Frame) -> dict[str, Any]:
    return dataclasses.asdict(frame)


def _frames_to_show(client: FullwellClient, job: Job) -> list[Frame]:
    frames: list[Frame] = []
    for state, count in (("running", job.frames.running), ("failed", job.frames.failed)):
        if count:
            frames += list(client.frames(job.id, state=state))[:SHOWN_FRAMES]
    return frames


def _print_job(job: Job, frames: list[Frame]) -> None:
    counts = job.frames
    parts = [f"{counts.done} of {counts.total} frames done"]
    parts += [f"{count} {name}" for name, count in _other_counts(job) if count]
    print(f"{job.id} ({job.name}) is {job.state}: {', '.join(parts)}")
    for frame in frames:
        if frame.state == "failed":
            print(f"  frame {frame.number} failed: {frame.error}")
        else:
            print(f"  frame {frame.number}: {frame.stage or 'starting'}, {frame.fraction:.0%}, attempt {frame.attempt}")
    if counts.failed and job.ended and not job.cancel_requested:
        print(f"fullwell retry {job.id} runs the failed frames again.")


def _other_counts(job: Job) -> tuple[tuple[str, int], ...]:
    counts = job.frames
    return (
        ("running", counts.running),
        ("queued", counts.queued),
        ("failed", counts.failed),
        ("cancelled", counts.cancelled),
    )


def _show_jobs(jobs: list[Job], *, as_json: bool) -> None:
    if as_json:
        print(json.dumps({"jobs": [_job_document(job) for job in jobs]}, indent=2))
        return
    if not jobs:
        print("There are no jobs. Submit a recipe: fullwell submit RECIPE")
        return
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Column, Table

    table = Table(Column("job", no_wrap=True, overflow="fold"), "name", "state", "done", "failed", "submitted")
    for job in jobs:
        done = f"{job.frames.done}/{job.frames.total}"
        when = f"{job.created_at.astimezone():%Y-%m-%d %H:%M}"
        table.add_row(job.id, escape(job.name), job.state, done, str(job.frames.failed), when)
    Console().print(table)


def _numbers(numbers: tuple[int, ...]) -> str:
    shown = ", ".join(str(number) for number in numbers[:SHOWN_FRAMES])
    return shown + (", ..." if len(numbers) > SHOWN_FRAMES else "")
