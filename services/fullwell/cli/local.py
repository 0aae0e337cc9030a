"""Commands that work in this process: render, plan, validate, show."""

from __future__ import annotations

import json
import logging
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from fullwell.core.errors import FieldError, NotFoundError

if TYPE_CHECKING:
    from rich.progress import Progress

    from fullwell.pipeline import StageStore
    from fullwell.schema import RecipeBuilder, RecipeDocument
    from fullwell.schema.assets import AssetSource

__all__ = ["register"]

RecipeArgument = Annotated[Path, typer.Argument(help="Recipe file, YAML or JSON.", metavar="RECIPE")]
SetOption = Annotated[
    list[str] | None, typer.Option("--set", help="Override one value: path=value, for example quality.noise_ratio=1.")
]
CacheOption = Annotated[
    Path | None,
    typer.Option(
        "--cache",
        metavar="DIR",
        help="Folder whose cache/ keeps rendered light between runs; default FULLWELL_HOME where it is set, else the user's "
        "cache folder. FULLWELL_CACHE_BYTES bounds it; 0 turns it off.",
    ),
]
NoSkipOption = Annotated[
    bool, typer.Option("--no-skip", help="Leave nothing out that the planner would, to see what that changes.")
]
JsonOption = Annotated[bool, typer.Option("--json", help="Report as JSON.")]


def register(app: typer.Typer) -> None:
    """Add the commands of this module to `app`."""
    app.command()(render)
    app.command()(plan)
    app.command()(validate)
    app.command()(show)


def render(
    recipe: RecipeArgument,
    output: Annotated[
        Path | None, typer.Option("-o", "--output", help="Folder for the frames; default out/<recipe name>.")
    ] = None,
    overrides: SetOption = None,
    frames: Annotated[str | None, typer.Option(help="Frames to make: one number, or A-B with both ends included.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Replace frames that were made from another recipe.")] = False,
    cache: CacheOption = None,
    no_cache: Annotated[bool, typer.Option("--no-cache", help="Render everything anew and keep nothing.")] = False,
    no_skip: NoSkipOption = False,
    as_json: JsonOption = False,
) -> None:
    """Make the frames of a recipe on this machine, in this process."""
    from fullwell.pipeline import run_frame
    from fullwell.schema import RecipeBuilder
    from fullwell.storage import LocalStore

    document, assets = _pinned(_load(recipe, overrides))
    wanted = _frame_range(frames, document.frame_count())
    builder = RecipeBuilder(document, base_dir=document.base_dir, assets=assets)
    builder.validate()  # a frame that cannot be made is found before the first one is
    folder = output if output is not None else Path("out") / document.name
    store = LocalStore(folder)
    stages = None if no_cache else _stage_store(cache)
    finished: list[dict[str, Any]] = []
    with _progress(quiet=as_json) as bars:
        total = bars.add_task(document.name, total=len(wanted))
        for index in wanted:
            bar = bars.add_task(f"frame {index}: load", total=1.0)
            prefix = f"frames/{index}"
            if force:
                _forget_other(store, prefix, builder, index, skip=not no_skip)
            manifest = run_frame(
                document,
                index,
                store,
                prefix,
                builder=builder,
                stages=stages,
                skip=not no_skip,
                progress=lambda at, bar=bar, index=index: bars.update(  # type: ignore[misc]
                    bar, completed=at.fraction, description=f"frame {index}: {at.stage}"
                ),
            )
            bars.remove_task(bar)
            bars.advance(total)
            finished.append(_summary(folder / prefix, index, manifest))
    if as_json:
        print(json.dumps({"frames": finished}, indent=2))
        return
    for item in finished:
        print(f"frame {item['index']}: {item['folder']} ({', '.join(item['products'])})")
    reused = [entry for item in finished for entry in item["cache"] if entry["result"] == "hit"]
    if reused:
        saved_s = sum(entry["saved_wall_s"] for entry in reused)
        print(f"note: the light of {len(reused)} view(s) came from the cache, which saved {saved_s:.3g} s of rendering")
    for warning in sorted({warning for item in finished for warning in item["warnings"]}):
        print(f"note: {warning}")


def _summary(folder: Path, index: int, manifest: dict[str, Any]) -> dict[str, Any]:
    return {
        "index": index,
        "folder": str(folder),
        "products": [product["name"] for product in manifest["products"]],
        "warnings": manifest["warnings"],
        "seconds": manifest["run"]["seconds"],
        "cpu_s": manifest["run"].get("cpu_s"),
        "cache": manifest["run"].get("cache", []),
    }


def _stage_store(folder: Path | None) -> StageStore | None:
    """Return the stage cache of commands in `folder` or at its usual place; None where the settings turn it off."""
    from fullwell.core.settings import load_settings
    from fullwell.jobs.logs import configure_logs
    from fullwell.pipeline import StageStore
    from fullwell.storage import LocalStore

    configure_logs(level=logging.WARNING)  # to standard error: a cache in trouble is told, and reports stay readable
    limit = load_settings().cache_bytes
    return StageStore(LocalStore(folder or _cache_folder()), max_bytes=limit) if limit else None


def _cache_folder() -> Path:
    """Return the folder that FULLWELL_HOME names, else ``fullwell`` in the user's cache folder, by the XDG rule."""
    if home := os.environ.get("FULLWELL_HOME"):
        return Path(home).expanduser()
    given = os.environ.get("XDG_CACHE_HOME", "")
    return (Path(given) if given.startswith("/") else Path.home() / ".cache") / "fullwell"


def _pinned(document: RecipeDocument) -> tuple[RecipeDocument, AssetSource | None]:
    """Return the recipe with its draws pinned to what this machine's asset store holds now, and that store."""
    from fullwell.schema.assets import asks_for_assets, pin_assets

    if not asks_for_assets(document):
        return document, None
    from fullwell.core.settings import load_settings
    from fullwell.pipeline.assets import assets_of_settings

    assets = assets_of_settings(load_settings())
    return pin_assets(document, assets), assets


def _forget_other(store: Any, prefix: str, builder: RecipeBuilder, index: int, *, skip: bool) -> None:
    """Remove a published frame that was made from another recipe; the same frame is left alone and reused."""
    from fullwell.dataset.encode import decode_json
    from fullwell.pipeline import MANIFEST_NAME
    from fullwell.pipeline.keys import frame_digest

    key = f"{prefix}/{MANIFEST_NAME}"
    if store.exists(key):
        digest = frame_digest(builder.frame(index), skip=skip)
        if decode_json(store.get(key)).get("frame_digest") != digest:
            store.delete(key)  # the commit point first: a crash in between leaves products that nobody reads
            store.delete_prefix(f"{prefix}/")


def plan(
    recipe: RecipeArgument,
    overrides: SetOption = None,
    frame: int = 0,
    cache: CacheOption = None,
    no_cache: Annotated[bool, typer.Option("--no-cache", help="Do not look for what is kept already.")] = False,
    no_skip: NoSkipOption = False,
    as_json: JsonOption = False,
) -> None:
    """Say what a frame would need, what is skipped and why; nothing is rendered."""
    from fullwell.pipeline import plan_document, plan_frame, with_cache_steps
    from fullwell.schema import build_frame

    document, assets = _pinned(_load(recipe, overrides))
    described = build_frame(document, frame, base_dir=document.base_dir, assets=assets)
    decided = plan_frame(described, skip=not no_skip)
    stages = None if no_cache else _stage_store(cache)
    if stages is not None:
        decided = with_cache_steps(decided, described, stages)
    if as_json:
        print(json.dumps({"frame": frame, "plan": plan_document(decided)}, indent=2))
        return
    from rich.console import Console
    from rich.table import Table

    table = Table("what", "decision", "why", "bound on the error", "expected cost", title=f"{document.name}, frame {frame}")
    for step in decided.steps:
        table.add_row(step.what, step.decision, step.why, step.error_bound, step.cost)
    Console().print(table)


def validate(recipe: RecipeArgument, overrides: SetOption = None, as_json: JsonOption = False) -> None:
    """Check a recipe and the files it names without rendering."""
    from fullwell.schema import RecipeError
    from fullwell.schema import validate as validate_document

    try:
        document, assets = _pinned(_load(recipe, overrides))
        validate_document(document, base_dir=document.base_dir, assets=assets)
    except RecipeError as error:
        if not as_json:
            raise
        problems = [{"path": p.path, "message": p.message} for p in error.errors]
        print(json.dumps({"valid": False, "errors": problems}, indent=2))
        raise typer.Exit(1) from None
    if as_json:
        print(json.dumps({"valid": True, "frames": document.frame_count()}))
    else:
        count = document.frame_count()
        print(f"{recipe} is valid: {count} frame{'s' if count != 1 else ''}.")


def show(
    frame_dir: Annotated[Path, typer.Argument(help="Folder of one frame, or of a whole render.", metavar="FRAME_DIR")],
    output: Annotated[Path | None, typer.Option("-o", "--output", help="Picture to write; default FRAME_DIR/show.png.")] = None,
) -> None:
    """Make one picture of all products of a frame."""
    from fullwell.dataset.contact import picture_of_products

    folder = _frame_folder(frame_dir)
    products = {
        file.relative_to(folder).as_posix(): file.read_bytes()
        for file in sorted(folder.rglob("*"))
        if file.is_file() and file.name != "show.png" and not file.name.startswith(".")
    }
    manifest = json.loads(products["manifest.json"])
    target = output if output is not None else folder / "show.png"
    from fullwell.core.files import atomic_write

    title = f"{manifest.get('recipe_name', folder.name)}, frame {manifest.get('index', 0)}"
    atomic_write(target, picture_of_products(products, title))
    print(target)


def _frame_folder(given: Path) -> Path:
    """Return the frame's folder; a render with one frame may be named by its top folder."""
    if (given / "manifest.json").is_file():
        return given
    inside = sorted(given.glob("frames/*/manifest.json")) or sorted(given.glob("*/manifest.json"))
    if len(inside) == 1:
        return inside[0].parent
    if inside:
        raise FieldError(
            f"{given} holds {len(inside)} frames; name one of them, for example {inside[0].parent}.", path="FRAME_DIR"
        )
    raise NotFoundError(f"{given} holds no finished frame (no manifest.json). Run `fullwell render` first.")


def _load(recipe: Path, overrides: list[str] | None) -> RecipeDocument:
    from fullwell.schema import load_recipe

    return load_recipe(recipe, overrides=parse_overrides(overrides))


def parse_overrides(overrides: list[str] | None) -> dict[str, str]:
    """Return {path: value} of ``path=value`` words. Raises FieldError for a word without an equals sign."""
    pairs: dict[str, str] = {}
    for word in overrides or []:
        path, equals, value = word.partition("=")
        if not equals or not path.strip():
            raise FieldError(f"--set {word!r} is not path=value; write for example --set seed=7.", path="--set", value=word)
        pairs[path.strip()] = value
    return pairs


def _frame_range(text: str | None, count: int) -> range:
    """Return the frame numbers of "A" or "A-B". Raises FieldError outside 0 to count - 1."""
    if text is None:
        return range(count)
    first_text, _, last_text = text.partition("-")
    try:
        first = int(first_text)
        last = int(last_text) if last_text else first
    except ValueError:
        raise FieldError(f"--frames is {text!r}; must be a number or A-B, such as 0-7.", path="--frames", value=text) from None
    if not 0 <= first <= last < count:
        raise FieldError(f"--frames is {text!r}; this recipe has frames 0 to {count - 1}.", path="--frames", value=text)
    return range(first, last + 1)


def _progress(*, quiet: bool) -> Progress:
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    return Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        TextColumn("{task.percentage:>3.0f}%"),
        TimeElapsedColumn(),
        console=Console(file=sys.stderr),
        disable=quiet,
        transient=True,
    )
