"""The asset store of this machine, with the methods of `AssetClient`: commands work on either."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from datetime import datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, Protocol

from fullwell.client.assets import Asset, AssetEvent, asset_from
from fullwell.core import FieldError, NotFoundError, sha256_file

if TYPE_CHECKING:
    from fullwell.assets.query import AssetQuery
    from fullwell.assets.records import AssetManifest, PreparedAsset
    from fullwell.client.models import ModelFiles
    from fullwell.core.settings import Settings
    from fullwell.jobs.asset_library import AssetLibrary

__all__ = ["AssetStore", "Described", "LocalAssets"]

WHO: Final = "local"
GARBAGE_AGE_S: Final = 86400.0


@dataclass(frozen=True, slots=True)
class Described:
    """What a person says of a model; empty and None where nothing was said."""

    asset_class: str
    licence: str
    attribution: str = ""
    licence_url: str = ""
    id: str = ""
    title: str = ""
    tags: tuple[str, ...] = ()
    unit_m: float | None = None
    up_axis: str = ""
    forward_axis: str = ""
    length_m: float | None = None
    variant: Mapping[str, str] | None = None
    member: str = ""


class AssetStore(Protocol):
    """What commands need of a store, on this machine or behind an address; see `AssetClient`."""

    def all(self, *, order: str = "", **conditions: Any) -> Iterator[Asset]: ...

    def get(self, asset_id: str, version: int | None = None) -> Asset: ...

    def versions(self, asset_id: str) -> list[Asset]: ...

    def events(self, asset_id: str) -> list[AssetEvent]: ...

    def review(
        self, state: str, *, ids: Iterable[str] = (), query: Mapping[str, Any] | None = None, reason: str = ""
    ) -> tuple[Asset, ...]: ...

    def edit(self, asset_id: str, changes: Mapping[str, Any], *, version: int | None = None) -> Asset: ...

    def edit_many(
        self, changes: Mapping[str, Any], *, ids: Iterable[str] = (), query: Mapping[str, Any] | None = None
    ) -> tuple[Asset, ...]: ...

    def retire(self, asset_id: str, *, reason: str = "") -> Asset: ...

    def export(self, target: Path | str, *, ids: Iterable[str] = (), query: Mapping[str, Any] | None = None) -> None: ...

    def import_archive(self, archive: Path | str, *, trust_states: bool = False) -> tuple[Asset, ...]: ...

    def collect_garbage(self, *, dry_run: bool = True) -> dict[str, Any]: ...

    def reindex(self) -> int: ...


class LocalAssets:
    """The embedded store and database of this machine, or those that the environment names, without a service."""

    def __init__(self, settings: Settings) -> None:
        from fullwell.jobs.asset_library import AssetLibrary
        from fullwell.jobs.database import Database
        from fullwell.storage import store_from_url

        self._settings = settings
        self._store = store_from_url(settings.store)
        self._database = Database(settings.database)
        self._database.upgrade()
        self.library: AssetLibrary = AssetLibrary(self._store, self._database)

    def __enter__(self) -> LocalAssets:
        return self

    def __exit__(self, *_: object) -> None:
        self._database.close()

    # -- in and out ---------------------------------------------------------------------------------------------------

    def reader(self) -> Any:
        """Return the process that reads models, one after the other."""
        from fullwell.assets.ingest import IngestProcess
        from fullwell.jobs.asset_requests import ingest_limits

        return IngestProcess(ingest_limits(self._settings))

    def import_model(
        self, files: ModelFiles, given: Described, reader: Any, progress: Callable[[float, str], None]
    ) -> tuple[Asset, bool]:
        """Read a model and store it; return the asset and whether it is a new version."""
        from fullwell.assets.records import LicenceRecord
        from fullwell.jobs.asset_requests import AssetRequest

        request = AssetRequest(
            files={name: sha256_file(file) for name, file in files.items()},
            main=files.main,
            asset_class=given.asset_class,
            licence=LicenceRecord(given.licence, given.attribution, given.licence_url),
            id=given.id,
            title=given.title,
            tags=given.tags,
            unit_m=given.unit_m,
            up_axis=given.up_axis,
            forward_axis=given.forward_axis,
            length_m=given.length_m,
            variant=given.variant or {},
            member=given.member,
        ).checked()
        folder = _folder_of(files)
        return self.add(reader.prepare(folder, request.main, request.options(), progress=progress))

    def add(self, prepared: PreparedAsset, *, who: str = WHO) -> tuple[Asset, bool]:
        """Store a prepared asset; return it and whether it is a new version."""
        before = self._last_version(prepared.manifest.id)
        entry = self.library.add(prepared, who=who)
        return self._detail(entry), entry.version != before

    def _last_version(self, asset_id: str) -> int:
        try:
            return self.library.get(asset_id).version
        except NotFoundError:
            return 0

    def render_previews(self, asset: Asset, progress: Callable[[float], None], *, again: bool = False) -> None:
        """Render an asset's pictures in this process, where they are not there yet."""
        from fullwell.assets.cache import BlobCache
        from fullwell.assets.store import StoredAssets
        from fullwell.pipeline.previews import render_previews

        manifest = self._manifest(asset)
        if again:
            self.forget_previews(manifest)
        cache = BlobCache(self._settings.asset_cache, self._settings.asset_cache_bytes)
        render_previews(manifest, self._store, assets=StoredAssets(self._store, cache), progress=progress)

    def forget_previews(self, manifest: AssetManifest) -> None:
        """Remove one picture: then all are rendered, and the others stay to be seen until that is done."""
        self._store.delete(self.library.preview_key(manifest.look_digest, "chart"))

    def has_previews(self, asset: Asset) -> bool:
        """Whether an asset has its pictures."""
        return "chart" in self.library.preview_names(self._manifest(asset).look_digest)

    def _manifest(self, asset: Asset) -> AssetManifest:
        return self.library.get(asset.id, asset.version).manifest

    def export(self, target: Path | str, *, ids: Iterable[str] = (), query: Mapping[str, Any] | None = None) -> None:
        """Write assets into one archive."""
        self.library.export(list(ids) if query is None else _query(query), Path(target))

    def import_archive(self, archive: Path | str, *, trust_states: bool = False) -> tuple[Asset, ...]:
        """Take in an archive and return its assets."""
        entries = self.library.import_archive(Path(archive), who=WHO, trust_states=trust_states)
        return tuple(self._plain(entry) for entry in entries)

    # -- looking ------------------------------------------------------------------------------------------------------

    def all(self, *, order: str = "", **conditions: Any) -> Iterator[Asset]:
        """Yield every asset that a search finds."""
        cursor = ""
        while True:
            page = self.library.search(_query(conditions), cursor=cursor, limit=500, order=order or "id")  # type: ignore[arg-type]
            yield from (self._plain(entry) for entry in page.entries)
            if not (cursor := page.next_cursor):
                return

    def get(self, asset_id: str, version: int | None = None) -> Asset:
        """Return an asset with its manifest."""
        return self._detail(self.library.get(asset_id, version))

    def versions(self, asset_id: str) -> list[Asset]:
        """Return all versions of an asset, newest first."""
        return [self._plain(entry) for entry in self.library.versions(asset_id)]

    def events(self, asset_id: str) -> list[AssetEvent]:
        """Return who did what to an asset, newest first."""
        return [
            AssetEvent(event.kind, event.version, event.who, datetime.fromtimestamp(event.when).astimezone(), event.detail)
            for event in self.library.events(asset_id)
        ]

    # -- deciding -----------------------------------------------------------------------------------------------------

    def review(
        self,
        state: str,
        *,
        ids: Iterable[str] = (),
        query: Mapping[str, Any] | None = None,
        reason: str = "",
        who: str = WHO,
    ) -> tuple[Asset, ...]:
        """Approve, reject or put back to pending several assets."""
        entries = self.library.review(self._chosen(ids, query), state, who=who, reason=reason)  # type: ignore[arg-type]
        return tuple(self._plain(entry) for entry in entries)

    def edit(self, asset_id: str, changes: Mapping[str, Any], *, version: int | None = None) -> Asset:
        """Change an asset and return its new version."""
        return self._edited([asset_id], changes, version)[0]

    def edit_many(
        self, changes: Mapping[str, Any], *, ids: Iterable[str] = (), query: Mapping[str, Any] | None = None
    ) -> tuple[Asset, ...]:
        """Change several assets in the same way."""
        return self._edited(self._chosen(ids, query), changes, None)

    def _edited(self, ids: list[str], changes: Mapping[str, Any], version: int | None) -> tuple[Asset, ...]:
        from fullwell.jobs.asset_edits import edit_assets, edit_from

        entries = edit_assets(self.library, ids, edit_from(changes), who=WHO, expected_version=version)
        return tuple(self._plain(entry) for entry in entries)

    def retire(self, asset_id: str, *, reason: str = "") -> Asset:
        """Take an asset out of the catalogue."""
        return self._plain(self.library.retire(asset_id, who=WHO, reason=reason))

    def collect_garbage(self, *, dry_run: bool = True) -> dict[str, Any]:
        """Remove what nothing refers to."""
        report = asdict(self.library.collect_garbage(dry_run=dry_run, min_age_s=GARBAGE_AGE_S))
        report.pop("digests", None)
        return report

    def reindex(self) -> int:
        """Rebuild the catalogue from the object store."""
        return self.library.reindex()

    # -- parts --------------------------------------------------------------------------------------------------------

    def _chosen(self, ids: Iterable[str], query: Mapping[str, Any] | None) -> list[str]:
        chosen = list(ids) if query is None else [asset.id for asset in self.all(**query)]
        if not chosen:
            raise NotFoundError("no asset meets these conditions; nothing was changed")
        return chosen

    def _plain(self, entry: Any) -> Asset:
        from fullwell.jobs.asset_documents import asset_document

        return asset_from(asset_document(entry))

    def _detail(self, entry: Any) -> Asset:
        from fullwell.jobs.asset_documents import asset_detail_document

        return asset_from(asset_detail_document(entry, self.library.preview_names(entry.manifest.look_digest)))


def _folder_of(files: ModelFiles) -> Path:
    """Return the folder that the paths of a model's files are relative to."""
    main = files[files.main]
    return main.parents[len(Path(files.main).parts) - 1]


def _query(conditions: Mapping[str, Any]) -> AssetQuery:
    """Return the query of conditions as `AssetClient.search` takes them; FieldError for an unknown one."""
    from fullwell.assets.query import AssetQuery

    given = {name: value for name, value in conditions.items() if value not in (None, "", (), [])}
    spans: dict[str, Any] = {
        name: (given.pop(f"min_{name}", None), given.pop(f"max_{name}", None)) for name in ("length_m", "width_m", "height_m")
    }
    known = {"asset_class", "tags", "without_tags", "licences", "states", "text", "ids"}
    if unknown := set(given) - known:
        raise FieldError(f"there is no condition {min(unknown)!r}; there are {', '.join(sorted(known))}.", min(unknown))
    plain: dict[str, Any] = {name: value if isinstance(value, str) else tuple(value) for name, value in given.items()}
    return AssetQuery(**{"states": (), **plain}, **spans)
