"""What differs between two versions of an asset, line by line."""

from __future__ import annotations

from dataclasses import dataclass

from fullwell.assets.records import AssetManifest, PartRecord
from fullwell.jobs.asset_records import AssetEntry
from fullwell_api.web.curation.spectra import material_title
from fullwell_api.web.curation.words import bytes_text, class_text, size_text

__all__ = ["Difference", "differences"]


@dataclass(frozen=True, slots=True)
class Difference:
    """A field in both versions; "–" where one has none."""

    field: str
    first: str
    second: str

    @property
    def differs(self) -> bool:
        """Whether the two are not the same."""
        return self.first != self.second


def differences(first: AssetEntry, second: AssetEntry) -> tuple[Difference, ...]:
    """Return all fields of two versions, in the order of the detail view; parts by name, those of either version."""
    one, other = first.manifest, second.manifest
    lines = [
        Difference("state", first.state, second.state),
        Difference("title", one.title, other.title),
        Difference("class", class_text(one.asset_class), class_text(other.asset_class)),
        Difference("tags", _tags(one, other), _tags(other, one)),
        Difference("size", size_text(one.size_m), size_text(other.size_m)),
        Difference("licence", one.licence.spdx, other.licence.spdx),
        Difference("attribution", one.licence.attribution or "–", other.licence.attribution or "–"),
        Difference("source", one.source.name or "–", other.source.name or "–"),
    ]
    for level in range(max(len(one.levels), len(other.levels))):
        lines.append(Difference(f"level {level}", _level(one, level), _level(other, level)))
    parts, others = {part.name: part for part in one.parts}, {part.name: part for part in other.parts}
    lines += [
        Difference(f"part {name}", _part(parts.get(name)), _part(others.get(name))) for name in dict.fromkeys([*parts, *others])
    ]
    checks, other_checks = ({check.name: check for check in manifest.checks} for manifest in (one, other))
    for name in dict.fromkeys([*checks, *other_checks]):
        texts = [f"{check.state}: {check.message}" if check else "–" for check in (checks.get(name), other_checks.get(name))]
        lines.append(Difference(f"check {name.replace('_', ' ')}", texts[0], texts[1]))
    return tuple(lines)


def _tags(manifest: AssetManifest, other: AssetManifest) -> str:
    own = sorted(set(manifest.tags) - set(other.tags))
    common = sorted(set(manifest.tags) & set(other.tags))
    return ", ".join([*common, *(f"+{tag}" for tag in own)]) or "–"


def _level(manifest: AssetManifest, level: int) -> str:
    if level >= len(manifest.levels):
        return "–"
    record = manifest.levels[level]
    return f"{record.triangles:,} triangles, {bytes_text(record.bytes)}, {record.sha256[:8]}"


def _part(part: PartRecord | None) -> str:
    return "–" if part is None else f"{part.triangles:,} triangles, {part.area_m2:.3g} m², {material_title(part.material)}"
