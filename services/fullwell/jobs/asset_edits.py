"""Edits as clients give them: all tags replaced, a licence changed in part; the library only adds and removes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from fullwell.assets.licences import check_licence
from fullwell.assets.records import LicenceRecord
from fullwell.core import FieldError, unknown_name_message
from fullwell.jobs.asset_library import AssetLibrary
from fullwell.jobs.asset_records import AssetEntry

__all__ = ["AssetEdits", "edit_assets", "edit_from"]


@dataclass(frozen=True, slots=True)
class AssetEdits:
    """What to change; None and empty leave as it is. `tags` replaces all tags; the licence's parts change one by one."""

    title: str | None = None
    asset_class: str | None = None
    tags: tuple[str, ...] | None = None
    add_tags: tuple[str, ...] = ()
    remove_tags: tuple[str, ...] = ()
    licence: str | None = None
    attribution: str | None = None
    licence_url: str | None = None
    part_materials: Mapping[str, str] = field(default_factory=dict)

    @property
    def looks_at_present(self) -> bool:
        """Whether the result depends on what an asset has now."""
        terms = (self.licence, self.attribution, self.licence_url)
        return self.tags is not None or (None in terms and any(term is not None for term in terms))


_NAMES: Final = {"class": "asset_class"}


def edit_from(changes: Mapping[str, Any]) -> AssetEdits:
    """Return the edits of plain data, as `PATCH /v1/assets/{id}` takes them; FieldError for an unknown field."""
    known = {"class", *(name for name in AssetEdits.__dataclass_fields__ if name != "asset_class")}
    for name in changes:
        if name not in known:
            raise FieldError(unknown_name_message("field", name, known), name, name)
    fields: dict[str, Any] = {_NAMES.get(name, name): value for name, value in changes.items()}
    fields |= {name: tuple(value) for name, value in fields.items() if isinstance(value, list)}
    return AssetEdits(**fields)


def edit_assets(
    library: AssetLibrary, ids: Sequence[str], edits: AssetEdits, *, who: str, expected_version: int | None = None
) -> tuple[AssetEntry, ...]:
    """Make the changes to assets and return their latest entries: to all or, where one is refused, to none.

    Raises
    ------
    FieldError
        A value is illegal, or several assets are to get what depends on what each has now.
    ConflictError
        `expected_version` is not the latest version.
    """
    add_tags, remove_tags, licence = edits.add_tags, edits.remove_tags, None
    if edits.looks_at_present:
        if len(ids) != 1:
            raise FieldError(
                f"tags, or a part of the licence, can be replaced for one asset at a time, not for {len(ids)}. Give add_tags "
                "and remove_tags, or licence, attribution and licence_url together.",
                "changes",
            )
        now = library.get(ids[0])
        expected_version = expected_version or now.version  # what is replaced must be what was looked at
        licence = _terms(edits, now.manifest.licence)
        if edits.tags is not None:
            add_tags += edits.tags
            remove_tags += tuple(tag for tag in now.manifest.tags if tag not in edits.tags)
    elif edits.licence is not None:
        licence = _terms(edits, LicenceRecord(edits.licence))
    return library.edit(
        ids,
        who=who,
        asset_class=edits.asset_class,
        add_tags=add_tags,
        remove_tags=remove_tags,
        title=edits.title,
        licence=licence,
        part_materials=edits.part_materials,
        expected_version=expected_version,
    )


def _terms(edits: AssetEdits, now: LicenceRecord) -> LicenceRecord:
    return LicenceRecord(
        now.spdx if edits.licence is None else check_licence(edits.licence),
        now.attribution if edits.attribution is None else edits.attribution,
        now.url if edits.licence_url is None else edits.licence_url,
    )
