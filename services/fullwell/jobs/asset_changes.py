"""What may go into the library, and what a curator may change of it."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final

from fullwell.assets.classes import asset_class
from fullwell.assets.materials.catalogue import asset_material
from fullwell.assets.records import AssetManifest, LicenceRecord, PartRecord, check_tags
from fullwell.assets.store import StoredManifest, check_digest
from fullwell.core import FieldError, canonical_json, unknown_name_message

__all__ = ["AssetChanges", "check_text", "storable"]

MAX_LINE: Final = 200
MAX_PARAGRAPH: Final = 2000
MAX_MANIFEST_BYTES: Final = 4 << 20


def check_text(text: str, *, path: str, most: int = MAX_LINE) -> str:
    """Return a line of text without spaces around it; FieldError where it is too long or holds control characters."""
    stripped = text.strip()
    if len(stripped) > most:
        raise FieldError(f"{path} has {len(stripped)} characters; at most {most} are allowed.", path=path, value=stripped[:80])
    if any(
        ord(character) < 0x20 or 0x7F <= ord(character) < 0xA0 or 0xD800 <= ord(character) < 0xE000 for character in stripped
    ):
        raise FieldError(f"{path} is {text[:80]!r}; control characters are not allowed.", path=path, value=text[:80])
    return stripped


def storable(manifest: AssetManifest) -> StoredManifest:
    """Return a manifest as it will come back from the store, with the digest that it will have.

    Raises
    ------
    FieldError
        A text is too long or holds control characters, a size is not finite, a digest is none, there is no level, or the
        document is larger than 4 MiB.
    """
    check_text(manifest.title, path="title")
    check_text(manifest.licence.spdx, path="licence.spdx")
    check_text(manifest.licence.attribution, path="licence.attribution", most=MAX_PARAGRAPH)
    check_text(manifest.licence.url, path="licence.url", most=MAX_PARAGRAPH)
    if not manifest.licence.spdx.strip():
        raise FieldError("licence.spdx is empty; every asset needs a licence. Give an SPDX expression.", path="licence.spdx")
    if not all(math.isfinite(extent_m) and extent_m >= 0 for extent_m in manifest.size_m):
        raise FieldError(f"size_m is {manifest.size_m}; extents must be finite and >= 0 [m].", path="size_m")
    if not manifest.levels:
        raise FieldError("levels is empty; an asset has at least one level of detail.", path="levels")
    for digest in manifest.blobs():
        check_digest(digest, path="manifest")
    try:
        document = canonical_json(manifest.document())
    except (ValueError, TypeError) as error:
        raise FieldError(f"the manifest of {manifest.id!r} is not plain data: {error}.", path="manifest") from error
    if len(document) > MAX_MANIFEST_BYTES:
        raise FieldError(
            f"the manifest of {manifest.id!r} has {len(document)} bytes; at most {MAX_MANIFEST_BYTES} are allowed. "
            "Merge parts or leave generator parameters out.",
            path="manifest",
        )
    # Once there and back: 4 in a size becomes 4.0, and the digest is then that of the manifest that comes out again.
    return StoredManifest.from_content(canonical_json(AssetManifest.from_document(json.loads(document)).document()))


@dataclass(frozen=True, slots=True)
class AssetChanges:
    """What a curator changes of assets; None and empty leave as it is.

    Attributes
    ----------
    part_materials
        {part: entry of the material catalogue}.
    """

    asset_class: str | None = None
    add_tags: tuple[str, ...] = ()
    remove_tags: tuple[str, ...] = ()
    title: str | None = None
    licence: LicenceRecord | None = None
    part_materials: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.asset_class is not None:
            asset_class(self.asset_class, path="class")
        check_tags(self.add_tags, path="add_tags")
        check_tags(self.remove_tags, path="remove_tags")
        if self.title is not None and not self.title.strip():
            raise FieldError("title is empty; must have 1 to 200 characters.", path="title", value=self.title)

    def apply(self, manifest: AssetManifest) -> tuple[AssetManifest, str]:
        """Return the changed manifest, and what was changed in words; the same manifest and no words where nothing was."""
        tags = check_tags(tuple((set(manifest.tags) | set(self.add_tags)) - set(self.remove_tags)))
        title = manifest.title if self.title is None else check_text(self.title, path="title")
        chosen_class = self.asset_class or manifest.asset_class
        licence = self.licence or manifest.licence
        parts = self._parts(manifest)
        changed = manifest.with_changes(title=title, asset_class=chosen_class, tags=tags, licence=licence, parts=parts)
        words = [
            f"class {manifest.asset_class} to {chosen_class}" if chosen_class != manifest.asset_class else "",
            *(f"tag {tag} added" for tag in tags if tag not in manifest.tags),
            *(f"tag {tag} removed" for tag in manifest.tags if tag not in tags),
            f"title {manifest.title!r} to {title!r}" if title != manifest.title else "",
            f"licence {manifest.licence.spdx} to {licence.spdx}" if licence != manifest.licence else "",
            *(
                f"material of {new.name} to {new.material.name}"
                for old, new in zip(manifest.parts, parts, strict=True)
                if old != new
            ),
        ]
        return changed, "; ".join(word for word in words if word)

    def _parts(self, manifest: AssetManifest) -> tuple[PartRecord, ...]:
        known = [part.name for part in manifest.parts]
        for name in self.part_materials:
            if name not in known:
                raise FieldError(
                    f"part_materials of {manifest.id}: {unknown_name_message('part', name, known)}", "part_materials", name
                )
        names = {
            part: asset_material(material, path=f"part_materials[{part!r}]").name
            for part, material in self.part_materials.items()
        }
        return tuple(
            replace(part, material=replace(part.material, origin="curator", name=names[part.name]))
            if names.get(part.name, part.material.name) != part.material.name
            else part
            for part in manifest.parts
        )
