"""Checks of a submission before anything is stored."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from fullwell.core import FieldError, canonical_json
from fullwell.jobs.files import blob_key, check_references, file_references
from fullwell.schema import RecipeDocument, load_recipe, validate
from fullwell_api.services import Services

__all__ = ["check_blobs", "checked_document"]


def checked_document(recipe: Mapping[str, Any], overrides: Mapping[str, Any], files: Mapping[str, str]) -> RecipeDocument:
    """Return the validated document of a submission; RecipeError or FieldError say what is wrong.

    Files are not opened: they are checked by name and digest here, and by content when a worker reads them.
    """
    try:
        canonical_json([recipe, overrides])
    except ValueError:  # NaN, or text that is no Unicode
        raise FieldError("the recipe holds a number that is not one (NaN) or text that is not Unicode.", "recipe") from None
    # A mapping, never text: text could name a file of this machine.
    document = load_recipe(dict(recipe), overrides=overrides)
    plain = document.plain()
    check_references(plain, files)
    if not any(True for _ in file_references(plain)):
        # Names of sensors, spectra and the like, and every value of `vary`. Model files are read by workers only.
        validate(document)
    return document


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
