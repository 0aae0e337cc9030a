"""Assets for tests of the store: small manifests with real blobs behind them."""

from __future__ import annotations

from typing import Any

from fullwell.assets.records import (
    AssetManifest,
    Check,
    LevelRecord,
    LicenceRecord,
    MaterialChoice,
    PartRecord,
    PreparedAsset,
    SourceRecord,
)
from fullwell.core import sha256_hex

__all__ = ["PNG", "open_check", "prepared_asset"]

PNG = b"\x89PNG\r\n\x1a\n" + b"not a picture that anyone looks at"


def open_check() -> Check:
    """Return a check that asks a person to decide."""
    return Check("scale", "decide", "Half a metre or half a foot?")


def prepared_asset(asset_id: str, content: bytes = b"a model", **changes: Any) -> PreparedAsset:
    """Return an asset of one level, whose file has the given content."""
    digest = sha256_hex(content)
    manifest = AssetManifest(
        id=asset_id,
        title=asset_id.replace("-", " ").title(),
        asset_class="car",
        tags=("sedan",),
        size_m=(4.5, 1.8, 1.5),
        levels=(LevelRecord(12, digest, len(content)),),
        parts=(
            PartRecord("body", 10, 8.0, MaterialChoice("rule", "paint/red"), paintable=True),
            PartRecord("glass", 2, 1.5, MaterialChoice("upsampled")),
        ),
        licence=LicenceRecord("CC-BY-4.0", "Ada Modeller", "https://example.org/ada"),
        source=SourceRecord("generator", "tests"),
    )
    return PreparedAsset(manifest.with_changes(**changes), {digest: content})
