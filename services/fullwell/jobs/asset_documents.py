"""Entries of the asset library as plain data: what the HTTP interface answers, and what commands print."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Any

from fullwell.jobs.asset_records import AssetEntry, AssetEvent

__all__ = ["asset_detail_document", "asset_document", "event_document"]


def asset_document(entry: AssetEntry) -> dict[str, Any]:
    """Return a version without its parts; times are ISO 8601, sizes along x (forward), y (left), z (up) [m]."""
    manifest, here = entry.manifest, f"/v1/assets/{entry.id}"
    licence = manifest.licence
    return {
        "id": entry.id,
        "version": entry.version,
        "digest": entry.digest,
        "title": manifest.title,
        "class": manifest.asset_class,
        "tags": list(manifest.tags),
        "licence": {"spdx": licence.spdx, "attribution": licence.attribution, "url": licence.url},
        "state": entry.state,
        "size_m": list(manifest.size_m),
        "triangles": manifest.levels[0].triangles,
        "levels": len(manifest.levels),
        "needs_decision": manifest.needs_decision,
        "retired": entry.retired,
        "created_at": _time(entry.created_at),
        "created_by": entry.created_by,
        "reviewed_at": _time(entry.reviewed_at),
        "reviewed_by": entry.reviewed_by,
        "reason": entry.reason,
        "links": {
            "self": here,
            # By version, so that the address of a picture changes with what it shows.
            "thumb": f"{here}/preview/thumb?version={entry.version}",
            "file": f"{here}/files/0?version={entry.version}",
            "versions": f"{here}/versions",
            "events": f"{here}/events",
        },
    }


def asset_detail_document(entry: AssetEntry, previews: Sequence[str]) -> dict[str, Any]:
    """Return a version with its manifest and the names of its previews."""
    return asset_document(entry) | {"manifest": entry.manifest.document(), "previews": list(previews)}


def event_document(event: AssetEvent) -> dict[str, Any]:
    """Return what happened to an asset."""
    return {
        "kind": event.kind,
        "version": event.version,
        "who": event.who,
        "at": _time(event.when),
        "detail": event.detail,
    }


def _time(seconds: float | None) -> str | None:
    return None if seconds is None else datetime.fromtimestamp(seconds, UTC).isoformat()
