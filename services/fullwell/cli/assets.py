"""`fullwell assets`: import, list, show, approve, reject, edit, export; on this machine's store, or a service's."""

from __future__ import annotations

import contextlib
import dataclasses
import json
import logging
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, cast

import typer

from fullwell.core.errors import FieldError, FullwellError

if TYPE_CHECKING:
    from fullwell.cli.asset_store import AssetStore, Described, LocalAssets
    from fullwell.client import Asset, FullwellClient, Ingestion

__all__ = ["register"]

assets_app = typer.Typer(name="assets", help="The asset store: models with licences, checks and reviews.", no_args_is_help=True)

ServerOption = Annotated[
    str,
    typer.Option(
        "--server", "--url", metavar="URL", help="Address of a service; default FULLWELL_URL, else this machine's store."
    ),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Report as JSON.")]
ClassOption = Annotated[str, typer.Option("--class", help="Only this class, such as car.")]
TagOption = Annotated[list[str] | None, typer.Option("--tag", help="Only with this tag; may be given again.")]
WithoutOption = Annotated[list[str] | None, typer.Option("--without-tag", help="Only without this tag.")]
LicenceOption = Annotated[list[str] | None, typer.Option("--licence", help="Only under this SPDX licence; may be given again.")]
TextOption = Annotated[str, typer.Option("--text", help="Only where each word begins a word of the asset's texts.")]
StateOption = Annotated[str, typer.Option("--state", help="Only pending, approved or rejected ones.")]
AllOption = Annotated[bool, typer.Option("--all", help="Yes, everything that the conditions find.")]
IdsArgument = Annotated[list[str] | None, typer.Argument(help="Asset ids.", metavar="[ID]...")]
ReasonOption = Annotated[str, typer.Option("--reason", help="Why; kept with the decision.")]
OneArgument = Annotated[str, typer.Argument(help="Asset id.", metavar="ID")]

LOUD: Final = ("warning", "decide", "failed")
STATE_STYLES: Final = {"approved": "green", "rejected": "red", "pending": "yellow"}
CHECK_STYLES: Final = {"ok": "green", "mended": "cyan", "warning": "yellow", "decide": "bold yellow", "failed": "bold red"}
SHOWN_FINDINGS: Final = 6
PIPE_COLUMNS: Final = 110


def register(app: typer.Typer) -> None:
    """Add `fullwell assets` to `app`."""
    commands: dict[str, Any] = {
        "import": import_models,
        "list": list_assets,
        "search": search,
        "show": show,
        "approve": approve,
        "reject": reject,
        "edit": edit,
        "retire": retire,
        "export": export,
        "import-archive": import_archive,
        "gc": collect_garbage,
        "reindex": reindex,
        "previews": previews,
        "starter": starter,
    }
    for name, command in commands.items():
        assets_app.command(name)(command)
    app.add_typer(assets_app)


# -- import -----------------------------------------------------------------------------------------------------------


@dataclasses.dataclass(slots=True)
class _Row:
    """One model of an import, and what became of it."""

    path: Path
    asset: Asset | None = None
    error: str = ""
    is_new: bool = True
    ingestion_id: str = ""
    sent: int = 0
    files: int = 0
    preview_error: str = ""

    def document(self) -> dict[str, Any]:
        shown = None if self.asset is None else dict(self.asset.document)
        row: dict[str, Any] = {"path": str(self.path), "asset": shown, "error": self.error or None, "new": self.is_new}
        if self.ingestion_id:
            row |= {"ingestion": self.ingestion_id, "files": self.files, "sent": self.sent}
        return row | {"preview_error": self.preview_error or None}


def import_models(
    paths: Annotated[list[Path], typer.Argument(help="Models, archives (.zip), or folders of models.", metavar="PATH...")],
    licence: Annotated[str, typer.Option("--licence", help="SPDX expression, such as CC0-1.0 or CC-BY-4.0.")],
    asset_class: Annotated[str, typer.Option("--class", help="What they are, such as car.")],
    attribution: Annotated[str, typer.Option(help="Whom to name.")] = "",
    licence_url: Annotated[str, typer.Option(help="Where the licence is stated.")] = "",
    tags: Annotated[list[str] | None, typer.Option("--tag", "--tags", help="Tags, separated by commas.")] = None,
    asset_id: Annotated[str, typer.Option("--id", help="Id, for one model; else made from its file's name.")] = "",
    title: Annotated[str, typer.Option(help="Name for people, for one model.")] = "",
    unit_m: Annotated[float | None, typer.Option("--unit-m", help="Metres per unit of the files; else detected.")] = None,
    up: Annotated[str, typer.Option("--up", help="Axis that points up: x, y or z; else detected.")] = "",
    forward: Annotated[str, typer.Option("--forward", help="Axis that points forward: x, -x, y, -y, z or -z.")] = "",
    length_m: Annotated[float | None, typer.Option("--length-m", help="Scale to this length [m].")] = None,
    recursive: Annotated[bool, typer.Option("-r", "--recursive", help="Look for models in folders of folders too.")] = False,
    variant: Annotated[list[str] | None, typer.Option("--variant", help="USD variant: SET=CHOICE; may be given again.")] = None,
    member: Annotated[str, typer.Option(help="Which file of an archive is the model.")] = "",
    root: Annotated[Path | None, typer.Option(help="Folder whose files models may take along; default their own.")] = None,
    with_previews: Annotated[bool, typer.Option("--previews/--no-previews", help="Wait for pictures, or leave them.")] = True,
    as_json: JsonOption = False,
    server: ServerOption = "",
) -> None:
    """Take models in: read, check, mend, and store them; they wait for a review then. Exit code 1 if one was refused."""
    from fullwell.cli.asset_store import Described

    _check_words(asset_class, licence)
    models = _models_of(paths, recursive=recursive)
    if len(models) > 1 and (asset_id or title):
        raise typer.BadParameter(f"--id and --title are for one model; there are {len(models)}.")
    given = Described(
        asset_class=asset_class,
        licence=licence,
        attribution=attribution,
        licence_url=licence_url,
        id=asset_id,
        title=title,
        tags=_words(tags),
        unit_m=unit_m,
        up_axis=up,
        forward_axis=forward,
        length_m=length_m,
        variant=_pairs(variant, "--variant"),
        member=member,
    )
    rows = [_Row(model) for model in models]
    with _opened(server) as store:
        if _is_remote(store):
            _import_remotely(cast("FullwellClient", store), rows, given, root, previews=with_previews, quiet=as_json)
        else:
            _import_here(cast("LocalAssets", store), rows, given, root, previews=with_previews, quiet=as_json)
    if as_json:
        print(json.dumps({"items": [row.document() for row in rows]}, indent=2))
    else:
        _print_import(rows, at_service=bool(rows and rows[0].ingestion_id))
    if any(row.error for row in rows):
        raise typer.Exit(1)


def _check_words(class_name: str, licence: str) -> None:
    """Refuse what every model would be refused for, before any is read."""
    from fullwell.assets.classes import asset_class
    from fullwell.assets.licences import check_licence

    try:
        asset_class(class_name, path="--class")
        check_licence(licence, path="--licence")
    except FieldError as error:
        raise typer.BadParameter(str(error)) from None


def _models_of(paths: list[Path], *, recursive: bool) -> list[Path]:
    from fullwell.client.models import find_models

    models: list[Path] = []
    for path in paths:
        if path.is_dir():
            found = find_models(path, recursive=recursive)
            if not found:
                raise typer.BadParameter(f"{path} holds no model{'' if recursive else '; -r looks into its folders'}.")
            models += found
        elif path.is_file():
            models.append(path)
        else:
            raise typer.BadParameter(f"{path} does not exist.")
    return list(dict.fromkeys(models))


def _import_here(
    store: LocalAssets, rows: list[_Row], given: Described, root: Path | None, *, previews: bool, quiet: bool
) -> None:
    from fullwell.client.models import collect_model

    with store.reader() as reader, _bars(quiet=quiet) as bars:
        total = bars.add_task("assets", total=len(rows))
        for row in rows:
            bar = bars.add_task(row.path.name, total=1.0)
            try:
                files = collect_model(row.path, root=root)
                row.files = len(files)
                moving = partial(_move_stage, bars, bar)
                row.asset, row.is_new = store.import_model(files, given, reader, moving)
            except FullwellError as error:
                row.error = str(error)
            bars.remove_task(bar)
            bars.advance(total)
    if previews:
        _render_here(store, rows, quiet=quiet)


def _render_here(store: LocalAssets, rows: list[_Row], *, quiet: bool, again: bool = False) -> None:
    wanted = [row for row in rows if row.asset is not None and (again or not store.has_previews(row.asset))]
    if not wanted:
        return
    with _bars(quiet=quiet) as bars:
        total = bars.add_task("previews", total=len(wanted))
        for row in wanted:
            assert row.asset is not None
            bar = bars.add_task(row.asset.id, total=1.0)
            try:
                store.render_previews(row.asset, partial(_move, bars, bar, row.asset.id), again=again)
            except FullwellError as error:
                row.preview_error = str(error)
            bars.remove_task(bar)
            bars.advance(total)


def _import_remotely(
    client: FullwellClient, rows: list[_Row], given: Described, root: Path | None, *, previews: bool, quiet: bool
) -> None:
    words = dataclasses.asdict(given)
    with _bars(quiet=quiet) as bars:
        sending = bars.add_task("sending", total=len(rows))
        for row in rows:
            try:
                handed_over = client.assets.import_model(row.path, root=root, **words)
                row.ingestion_id = handed_over.ingestion.id
                row.files, row.sent = handed_over.files, handed_over.sent
            except FullwellError as error:
                row.error = _refusal(error)
            bars.advance(sending)
        bars.remove_task(sending)
        waiting = [row for row in rows if row.ingestion_id]
        total = bars.add_task("assets", total=len(waiting))
        for row in waiting:
            bar = bars.add_task(row.path.name, total=1.0)

            def show(now: Ingestion, bar: Any = bar) -> None:
                bars.update(bar, completed=now.fraction, description=now.stage or now.state)

            _settle(client, row, client.assets.wait(row.ingestion_id, progress=show, stored_is_enough=not previews))
            bars.remove_task(bar)
            bars.advance(total)


def _settle(client: FullwellClient, row: _Row, ended: Ingestion) -> None:
    row.preview_error = ended.preview_error
    if ended.state == "failed":
        row.error = ended.error
    else:
        row.asset = client.assets.get(ended.asset_id, ended.version)
        row.is_new = True


def _refusal(error: FullwellError) -> str:
    fields = getattr(error, "errors", ())
    return "; ".join(item.message for item in fields) or str(error)


def _print_import(rows: list[_Row], *, at_service: bool) -> None:
    from rich.markup import escape

    _print_assets([row.asset for row in rows if row.asset is not None], checks=True)
    console = _console()
    for row in rows:
        if row.asset is None:
            console.print(f"[bold red] refused[/]  {escape(str(row.path))}: {escape(row.error)}", soft_wrap=True)
            continue
        if not row.is_new:
            console.print(f"{row.asset.id} is here already, as version {row.asset.version}.")
        _print_findings(console, row.asset)
        if row.preview_error:
            console.print(f"[yellow]{row.asset.id} has no previews: {escape(row.preview_error)}[/]", soft_wrap=True)
    good = sum(row.asset is not None for row in rows)
    sent = f", {sum(row.sent for row in rows)} of {sum(row.files for row in rows)} files sent" if at_service else ""
    print(f"{good} of {len(rows)} models are in the store{sent}.")
    if any(row.asset is not None and row.asset.state == "pending" for row in rows):
        print("They wait for a review: fullwell assets show ID, then approve or reject ID...")


def _print_findings(console: Any, asset: Asset) -> None:
    from rich.markup import escape

    loud = [check for check in asset.document["manifest"]["checks"] if check["state"] in LOUD]
    for check in loud[:SHOWN_FINDINGS]:
        style = CHECK_STYLES[check["state"]]
        console.print(f"[{style}]{check['state']:>8}[/]  {asset.id}: {escape(check['message'])}", soft_wrap=True)
    if len(loud) > SHOWN_FINDINGS:
        console.print(f"          {asset.id}: {len(loud) - SHOWN_FINDINGS} more; fullwell assets show {asset.id}")


# -- looking ----------------------------------------------------------------------------------------------------------


def list_assets(
    asset_class: ClassOption = "",
    tags: TagOption = None,
    without_tags: WithoutOption = None,
    licences: LicenceOption = None,
    state: StateOption = "",
    text: TextOption = "",
    min_length_m: Annotated[float | None, typer.Option("--min-length-m", help="Least extent along x [m].")] = None,
    max_length_m: Annotated[float | None, typer.Option("--max-length-m", help="Largest extent along x [m].")] = None,
    order: Annotated[str, typer.Option(help="id, newest, title, class, size or triangles.")] = "id",
    limit: Annotated[int, typer.Option(min=1, help="Most lines.")] = 200,
    as_json: JsonOption = False,
    server: ServerOption = "",
) -> None:
    """List the assets that meet all conditions."""
    conditions = _conditions(asset_class, tags, without_tags, licences, state, text)
    conditions |= {"min_length_m": min_length_m, "max_length_m": max_length_m}
    _list(conditions, order, limit, as_json=as_json, server=server)


def search(
    words: Annotated[list[str], typer.Argument(help="Words; each must begin a word of the asset's texts.", metavar="WORD...")],
    order: Annotated[str, typer.Option(help="id, newest, title, class, size or triangles.")] = "id",
    limit: Annotated[int, typer.Option(min=1, help="Most lines.")] = 200,
    as_json: JsonOption = False,
    server: ServerOption = "",
) -> None:
    """List the assets in whose id, title, class, tags, licence or attribution all words occur."""
    _list({"text": " ".join(words)}, order, limit, as_json=as_json, server=server)


def _list(conditions: dict[str, Any], order: str, limit: int, *, as_json: bool, server: str) -> None:
    from itertools import islice

    with _opened(server) as store:
        found = list(islice(_of(store).all(order=order, **conditions), limit + 1))
    shown = found[:limit]
    if as_json:
        print(json.dumps({"items": [dict(asset.document) for asset in shown], "more": len(found) > limit}, indent=2))
        return
    if not shown:
        print("No asset meets these conditions. fullwell assets import takes models in.")
        return
    _print_assets(shown)
    print(
        f"{len(shown)} asset{'' if len(shown) == 1 else 's'}"
        + ("; there are more, --limit shows them" if len(found) > limit else "")
    )


def show(
    asset_id: OneArgument,
    version: Annotated[int | None, typer.Option("--version", help="A version; default the newest.")] = None,
    as_json: JsonOption = False,
    server: ServerOption = "",
) -> None:
    """Show an asset: dimensions, checks, parts and materials, versions, and who did what when."""
    with _opened(server) as store:
        asset = _of(store).get(asset_id, version)
        versions = _of(store).versions(asset_id)
        events = _of(store).events(asset_id)
    if as_json:
        happened = [dataclasses.asdict(event) | {"at": event.at.isoformat()} for event in events]
        listed = [dict(each.document) for each in versions]
        print(json.dumps(dict(asset.document) | {"versions": listed, "events": happened}, indent=2))
        return
    _print_asset(asset)
    _print_history(versions, events)


# -- deciding ---------------------------------------------------------------------------------------------------------


def approve(
    ids: IdsArgument = None,
    reason: ReasonOption = "",
    asset_class: ClassOption = "",
    tags: TagOption = None,
    without_tags: WithoutOption = None,
    licences: LicenceOption = None,
    text: TextOption = "",
    state: Annotated[str, typer.Option("--state", help="Of those found, only ones in this state.")] = "pending",
    everything: AllOption = False,
    as_json: JsonOption = False,
    server: ServerOption = "",
) -> None:
    """Approve assets, by id or by conditions and --all: recipes draw them from now on."""
    conditions = _conditions(asset_class, tags, without_tags, licences, state, text)
    _review("approved", ids, conditions, reason, everything=everything, as_json=as_json, server=server)


def reject(
    ids: IdsArgument = None,
    reason: ReasonOption = "",
    asset_class: ClassOption = "",
    tags: TagOption = None,
    without_tags: WithoutOption = None,
    licences: LicenceOption = None,
    text: TextOption = "",
    state: Annotated[str, typer.Option("--state", help="Of those found, only ones in this state.")] = "pending",
    everything: AllOption = False,
    as_json: JsonOption = False,
    server: ServerOption = "",
) -> None:
    """Reject assets, by id or by conditions and --all; a reason is needed."""
    conditions = _conditions(asset_class, tags, without_tags, licences, state, text)
    _review("rejected", ids, conditions, reason, everything=everything, as_json=as_json, server=server)


def _review(
    state: str, ids: list[str] | None, conditions: dict[str, Any], reason: str, *, everything: bool, as_json: bool, server: str
) -> None:
    with _opened(server) as store:
        chosen = _selected(store, ids, conditions, everything=everything)
        changed = _of(store).review(state, reason=reason, **chosen)
    if as_json:
        print(json.dumps({"items": [dict(asset.document) for asset in changed]}, indent=2))
    else:
        _print_assets(list(changed))
        print(f"{_count(len(changed))} {state}")


def edit(
    ids: IdsArgument = None,
    title: Annotated[str | None, typer.Option(help="New name for people.")] = None,
    new_class: Annotated[str | None, typer.Option("--set-class", help="New class.")] = None,
    add_tags: Annotated[list[str] | None, typer.Option("--add-tag", help="Tags to add, separated by commas.")] = None,
    remove_tags: Annotated[list[str] | None, typer.Option("--remove-tag", help="Tags to take away.")] = None,
    set_licence: Annotated[str | None, typer.Option("--set-licence", help="New SPDX licence.")] = None,
    attribution: Annotated[str | None, typer.Option(help="Whom to name.")] = None,
    material: Annotated[list[str] | None, typer.Option("--material", help="PART=MATERIAL, such as body=paint/red.")] = None,
    asset_class: ClassOption = "",
    tags: TagOption = None,
    text: TextOption = "",
    everything: AllOption = False,
    as_json: JsonOption = False,
    server: ServerOption = "",
) -> None:
    """Change assets, by id or by conditions and --all; each change is a new version."""
    changes: dict[str, Any] = {"title": title, "class": new_class, "licence": set_licence, "attribution": attribution}
    changes |= {"add_tags": list(_words(add_tags)), "remove_tags": list(_words(remove_tags))}
    changes["part_materials"] = _pairs(material, "--material")
    changes = {name: value for name, value in changes.items() if value not in (None, [], {})}
    if not changes:
        raise typer.BadParameter("nothing is to be changed; give --title, --set-class, --add-tag, --material or another.")
    with _opened(server) as store:
        chosen = _selected(store, ids, _conditions(asset_class, tags, None, None, "", text), everything=everything)
        changed = _of(store).edit_many(changes, **chosen)
    if as_json:
        print(json.dumps({"items": [dict(asset.document) for asset in changed]}, indent=2))
    else:
        _print_assets(list(changed))


def retire(
    ids: Annotated[list[str], typer.Argument(help="Asset ids.", metavar="ID...")],
    reason: ReasonOption = "",
    as_json: JsonOption = False,
    server: ServerOption = "",
) -> None:
    """Take assets out of the catalogue: found and drawn no more, until they are imported again. What they made stays."""
    with _opened(server) as store:
        gone = [_of(store).retire(asset_id, reason=reason) for asset_id in ids]
    if as_json:
        print(json.dumps({"items": [dict(asset.document) for asset in gone]}, indent=2))
    else:
        print(f"{', '.join(asset.id for asset in gone)} retired")


# -- archives and upkeep ----------------------------------------------------------------------------------------------


def export(
    ids: IdsArgument = None,
    output: Annotated[Path, typer.Option("-o", "--output", help="The archive to write.")] = Path("assets.zip"),
    asset_class: ClassOption = "",
    tags: TagOption = None,
    licences: LicenceOption = None,
    text: TextOption = "",
    state: Annotated[
        str, typer.Option("--state", help="Of those found, only ones in this state; any with --state any.")
    ] = "approved",
    as_json: JsonOption = False,
    server: ServerOption = "",
) -> None:
    """Write assets with their files, previews and licences into one archive; without ids, all approved ones."""
    query = None if ids else _conditions(asset_class, tags, None, licences, "" if state == "any" else state, text)
    with _opened(server) as store:
        _of(store).export(output, ids=ids or (), query=query)
    size = output.stat().st_size
    print(json.dumps({"path": str(output), "bytes": size}) if as_json else f"{output} holds {size / 1e6:.1f} MB")


def import_archive(
    archive: Annotated[Path, typer.Argument(help="What `fullwell assets export` wrote.", exists=True, dir_okay=False)],
    trust_states: Annotated[
        bool,
        typer.Option("--trust-states", help="Keep the decisions of where it was made; else all wait for a review."),
    ] = False,
    as_json: JsonOption = False,
    server: ServerOption = "",
) -> None:
    """Take in an archive of assets; it is verified as a whole before anything of it is stored."""
    with _opened(server) as store:
        came = _of(store).import_archive(archive, trust_states=trust_states)
    if as_json:
        print(json.dumps({"items": [dict(asset.document) for asset in came]}, indent=2))
    else:
        _print_assets(list(came))
        print(f"{len(came)} asset{'' if len(came) == 1 else 's'} came in")


def collect_garbage(
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only say what would go.")] = False,
    as_json: JsonOption = False,
    server: ServerOption = "",
) -> None:
    """Remove blobs and previews that no version, job or ingestion refers to, and that are older than a day."""
    with _opened(server) as store:
        report = _of(store).collect_garbage(dry_run=dry_run)
    if as_json:
        print(json.dumps(report, indent=2))
        return
    verb = "would be removed" if dry_run else "were removed"
    print(f"{report['blobs']} blobs and {report['previews']} previews ({report['bytes'] / 1e6:.1f} MB) {verb}")
    print(f"{report['kept']} blobs are referred to, {report['young']} are too young to go")


def reindex(as_json: JsonOption = False, server: ServerOption = "") -> None:
    """Make the catalogue anew from the object store, which is the truth about assets."""
    with _opened(server) as store:
        count = _of(store).reindex()
    print(json.dumps({"versions": count}) if as_json else f"{count} versions are in the catalogue")


def previews(
    ids: IdsArgument = None,
    missing: Annotated[bool, typer.Option("--missing", help="Of all assets that have none.")] = False,
    as_json: JsonOption = False,
    server: ServerOption = "",
) -> None:
    """Render pictures again, or with --missing where there are none; a service's workers do it when they come to it."""
    if bool(ids) == missing:
        raise typer.BadParameter("give ids, or --missing.")
    with _opened(server) as store:
        if _is_remote(store):
            client = cast("FullwellClient", store)
            wanted = list(
                ids or [asset.id for asset in client.assets.all() if not client.assets.get(asset.id).document["previews"]]
            )
            queued = [client.assets.render_previews(asset_id).id for asset_id in wanted]
            print(json.dumps({"ingestions": queued}) if as_json else f"{_count(len(queued))} queued for the workers")
            return
        here = cast("LocalAssets", store)
        rows = [_Row(Path(asset.id), asset) for asset in ([here.get(each) for each in ids] if ids else here.all())]
        _render_here(here, rows, quiet=as_json, again=bool(ids))
    failed = {row.path.name: row.preview_error for row in rows if row.preview_error}
    if as_json:
        print(json.dumps({"failed": failed}))
    else:
        for name, error in failed.items():
            print(f"{name}: {error}", file=sys.stderr)
        print(f"{_count(len(rows) - len(failed))} shown in pictures now")
    if failed:
        raise typer.Exit(1)


def starter(
    packaged: Annotated[bool, typer.Option("--packaged", help="The models of the installed SUMO package too.")] = False,
    approved: Annotated[bool, typer.Option("--approve", help="Approve what comes in.")] = False,
    only: Annotated[str, typer.Option("--only", help="Only entries with this in their id.")] = "",
    with_previews: Annotated[bool, typer.Option("--previews/--no-previews", help="Render pictures.")] = True,
    as_json: JsonOption = False,
    server: ServerOption = "",
) -> None:
    """Take in the starter library: models that this program generates. What is here already stays as it is."""
    from fullwell.cli.asset_starter import bring_starter

    with _opened(server) as store:
        with _bars(quiet=as_json) as bars:
            came = bring_starter(store, bars, only=only, packaged=packaged, approve=approved)
        if with_previews and not _is_remote(store):
            _render_here(cast("LocalAssets", store), [_Row(Path(asset.id), asset) for asset in came], quiet=as_json)
    if as_json:
        print(json.dumps({"items": [dict(asset.document) for asset in came]}, indent=2))
    else:
        _print_assets(came)
        print(f"{_count(len(came))} in the store, of the starter library")


# -- parts ------------------------------------------------------------------------------------------------------------


@contextlib.contextmanager
def _opened(server: str) -> Iterator[FullwellClient | LocalAssets]:
    """Yield the client of a service, or this machine's store."""
    from fullwell.core.settings import load_settings

    settings = load_settings()
    if server or settings.url:
        from fullwell.client import FullwellClient

        with FullwellClient(server) as client:
            yield client
        return
    from fullwell.cli.asset_store import LocalAssets
    from fullwell.jobs.logs import configure_logs

    configure_logs(level=logging.WARNING)
    with LocalAssets(settings) as here:
        yield here


def _is_remote(store: FullwellClient | LocalAssets) -> bool:
    from fullwell.client import FullwellClient

    return isinstance(store, FullwellClient)


def _of(store: FullwellClient | LocalAssets) -> AssetStore:
    return cast("AssetStore", cast("FullwellClient", store).assets if _is_remote(store) else store)


def _selected(
    store: FullwellClient | LocalAssets, ids: list[str] | None, conditions: dict[str, Any], *, everything: bool
) -> dict[str, Any]:
    """Return the selection that ids or conditions make; conditions need --all."""
    if ids:
        return {"ids": ids}
    if everything:
        return {"query": conditions}
    found = [asset.id for asset in _of(store).all(**conditions)]
    shown = ", ".join(found[:5]) + (", ..." if len(found) > 5 else "")
    raise typer.BadParameter(f"give ids, or --all for the {len(found)} assets that these conditions find: {shown or 'none'}.")


def _conditions(
    asset_class: str, tags: list[str] | None, without: list[str] | None, licences: list[str] | None, state: str, text: str
) -> dict[str, Any]:
    return {
        "asset_class": asset_class,
        "tags": list(_words(tags)),
        "without_tags": list(_words(without)),
        "licences": list(licences or []),
        "states": [state] if state else [],
        "text": text,
    }


def _words(given: list[str] | None) -> tuple[str, ...]:
    return tuple(word.strip() for text in given or [] for word in text.split(",") if word.strip())


def _pairs(given: list[str] | None, option: str) -> dict[str, str]:
    pairs: dict[str, str] = {}
    for text in given or []:
        name, equals, value = text.partition("=")
        if not equals or not name or not value:
            raise typer.BadParameter(f"{option} {text!r} is not NAME=VALUE.")
        pairs[name] = value
    return pairs


def _bars(*, quiet: bool) -> Any:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    class Count(MofNCompleteColumn):
        """Numbers for whole things, per cent for one."""

        def render(self, task: Any) -> Any:
            from rich.text import Text

            return super().render(task) if isinstance(task.total, int) else Text(f"{task.percentage:>3.0f}%")

    columns = (TextColumn("{task.description:<28.28}"), BarColumn(), Count(), TimeElapsedColumn())
    return Progress(*columns, console=Console(stderr=True), disable=quiet, transient=True)


def _console() -> Any:
    """Return where reports go; in a pipe there is no terminal's width to keep."""
    from rich.console import Console

    return Console() if sys.stdout.isatty() else Console(width=PIPE_COLUMNS)


def _move_stage(bars: Any, bar: Any, done: float, stage: str) -> None:
    """Move a bar to the share that is done, and name the stage."""
    bars.update(bar, completed=done, description=stage)


def _move(bars: Any, bar: Any, name: str, done: float) -> None:
    bars.update(bar, completed=done, description=name)


def _print_assets(assets: list[Asset], *, checks: bool = False) -> None:
    from rich import box
    from rich.markup import escape
    from rich.table import Column, Table

    if not assets:
        return
    columns = [
        Column("asset", no_wrap=True, overflow="fold"),
        Column("class", no_wrap=True),
        Column("L x W x H \\[m]", justify="right", no_wrap=True),
    ]
    if checks:
        columns.append(Column("checks"))
    else:
        columns += [Column("triangles", justify="right", no_wrap=True), Column("state", no_wrap=True), Column("licence")]
        columns.append(Column("tags"))
    table = Table(*columns, box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for asset in assets:
        size = " x ".join(f"{extent:.2f}" for extent in asset.size_m)
        row = [f"{escape(asset.id)} [dim]v{asset.version}[/]", asset.asset_class, size]
        if checks:
            row.append(_check_counts(asset))
        else:
            style = STATE_STYLES.get(asset.state, "white")
            ask = " [bold yellow]?[/]" if asset.needs_decision and asset.state == "pending" else ""
            row += [
                f"{asset.triangles:,}",
                f"[{style}]{asset.state}[/]{ask}",
                escape(asset.licence),
                escape(" ".join(asset.tags)),
            ]
        table.add_row(*row)
    _console().print(table)


def _count(number: int) -> str:
    return "1 asset is" if number == 1 else f"{number} assets are"


def _check_counts(asset: Asset) -> str:
    found = [check["state"] for check in asset.document["manifest"]["checks"]]
    shown = [f"[{style}]{found.count(state)} {state}[/]" for state, style in CHECK_STYLES.items() if state in found]
    return ", ".join(shown) or "none"


def _print_asset(asset: Asset) -> None:
    from rich.markup import escape
    from rich.table import Table

    console, document = _console(), asset.document
    manifest = document["manifest"]
    style = STATE_STYLES.get(asset.state, "white")
    console.print(f"[bold]{escape(asset.title or asset.id)}[/]  {asset.id} version {asset.version}  [{style}]{asset.state}[/]")
    if document["reviewed_by"]:
        why = f": {document['reason']}" if document["reason"] else ""
        console.print(
            f"  by {escape(document['reviewed_by'])} on {document['reviewed_at'][:16].replace('T', ' ')}{escape(why)}"
        )
    size = " x ".join(f"{extent:.3f}" for extent in asset.size_m)
    source, terms = manifest["source"], document["licence"]
    console.print(f"  class      {asset.asset_class}; tags {escape(', '.join(asset.tags) or 'none')}")
    console.print(f"  size       {size} m (length, width, height)")
    console.print(f"  licence    {escape(terms['spdx'])}{escape(', ' + terms['attribution'] if terms['attribution'] else '')}")
    axes = f"{source['unit_m']:g} m per unit, up {source['up_axis']}, forward {source['forward_axis']}"
    console.print(f"  source     {source['kind']} {escape(source['name'])}; {axes}")
    levels = ", ".join(f"{level['triangles']:,} ({level['bytes'] / 1e3:.0f} kB)" for level in manifest["levels"])
    console.print(f"  triangles  {levels}")
    console.print(f"  previews   {', '.join(document['previews']) or 'none yet'}")
    console.print(f"  digest     {asset.digest}")
    checks = Table("check", "state", "finding", show_lines=False)
    for check in manifest["checks"]:
        checks.add_row(check["name"], f"[{CHECK_STYLES[check['state']]}]{check['state']}[/]", escape(check["message"]))
    console.print(checks)
    parts = Table("part", "triangles", "area \\[m2]", "material", "chosen by")
    for part in manifest["parts"]:
        material = part["material"]
        name = material["name"] or "from the file's colour"
        parts.add_row(escape(part["name"]), f"{part['triangles']:,}", f"{part['area_m2']:.3g}", name, material["origin"])
    console.print(parts)


def _print_history(versions: list[Asset], events: list[Any]) -> None:
    from rich.markup import escape
    from rich.table import Table

    console = _console()
    history = Table("when", "version", "what", "who", "why")
    for event in events:
        when = f"{event.at.astimezone():%Y-%m-%d %H:%M}"
        history.add_row(when, str(event.version), event.kind, escape(event.who), escape(event.detail))
    console.print(history)
    console.print(
        f"{len(versions)} version{'' if len(versions) == 1 else 's'}: {', '.join(str(each.version) for each in versions)}"
    )
