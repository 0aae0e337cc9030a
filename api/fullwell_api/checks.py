"""Checks of a submission before anything is stored."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fullwell.core import AssetError, FieldError, canonical_json
from fullwell.jobs.files import blob_key, check_references, file_references
from fullwell.schema import RecipeDocument, load_recipe, validate
from fullwell.schema.assets import asks_for_assets, pin_assets
from fullwell_api.services import Services

if TYPE_CHECKING:
    from fullwell.assets.query import AssetQuery
    from fullwell.assets.records import AssetManifest
    from fullwell.jobs.asset_library import AssetLibrary

__all__ = ["check_blobs", "checked_document"]


def checked_document(
    recipe: Mapping[str, Any],
    overrides: Mapping[str, Any],
    files: Mapping[str, str],
    *,
    library: AssetLibrary | None = None,
) -> RecipeDocument:
    """Return the validated document of a submission; RecipeError or FieldError say what is wrong.

    Files are not opened: they are checked by name and digest here, and by content when a worker reads them. Draws of assets
    are pinned to what the library holds now, so that workers, and a retry next year, choose among the same.
    """
    try:
        canonical_json([recipe, overrides])
    except ValueError:  # NaN, or text that is no Unicode
        raise FieldError("the recipe holds a number that is not one (NaN) or text that is not Unicode.", "recipe") from None
    # A mapping, never text: text could name a file of this machine.
    document = load_recipe(dict(recipe), overrides=overrides)
    plain = document.plain()
    check_references(plain, files)
    if asks_for_assets(document):
        return document if library is None else pin_assets(document, _Candidates(library))
    if not any(True for _ in file_references(plain)):
        # Names of sensors, spectra and the like, and every value of `vary`. Model files are read by workers only.
        validate(document)
    return document


class _Candidates:
    """A library as recipes ask it for candidates. Models are read by workers only."""

    def __init__(self, library: AssetLibrary) -> None:
        self._library = library

    def candidates(self, query: AssetQuery) -> Sequence[tuple[str, str]]:
        """Return (id, digest) of each asset that matches, sorted by id."""
        return self._library.candidates(query)

    def manifest(self, digest: str) -> AssetManifest:
        """Return a version's manifest."""
        return self._library.by_digest(digest).manifest

    def level_file(self, manifest: AssetManifest, level: int) -> Path:
        """Refuse: this process opens no models."""
        raise AssetError(f"level {level} of asset {manifest.id!r} cannot be read here; workers do.")


def check_blobs(parts: Services, files: Mapping[str, str]) -> None:
    """Raise FieldError when the content of a file has not been uploaded."""
    digests = sorted(set(files.values()))
    found = parts.threads.map(parts.store.exists, [blob_key(digest) for digest in digests])
    missing = {digest for digest, there in zip(digests, found, strict=True) if not there}
    for name, digest in files.items():
        if digest in missing:
            raise FieldError(
                f"files[{name!r}] has not been uploaded (and {len(missing) - 1} more). PUT its content to /v1/blobs/{digest}.",
                f"files[{name!r}]",
                digest,
            )
