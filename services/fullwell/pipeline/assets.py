"""Where recipes on this machine find assets, and what their draws choose among."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from fullwell.assets.cache import BlobCache
from fullwell.assets.query import AssetQuery
from fullwell.assets.store import StoredAssets
from fullwell.core.settings import Settings
from fullwell.storage import store_from_url

if TYPE_CHECKING:
    from fullwell.jobs.asset_library import AssetLibrary

__all__ = ["CataloguedAssets", "assets_of_settings"]


class CataloguedAssets(StoredAssets):
    """Assets of a library that can be searched."""

    def __init__(self, library: AssetLibrary, cache: BlobCache) -> None:
        super().__init__(library.store, cache)
        self._library = library

    def candidates(self, query: AssetQuery) -> Sequence[tuple[str, str]]:
        """Return (id, digest) of each asset that matches, by its newest matching version, sorted by id."""
        return self._library.candidates(query)


def assets_of_settings(settings: Settings) -> CataloguedAssets:
    """Return the assets of the store and catalogue that the settings name; the database is made where there is none yet."""
    from fullwell.jobs.asset_library import AssetLibrary  # noqa: PLC0415 - most recipes draw nothing
    from fullwell.jobs.database import Database  # noqa: PLC0415

    database = Database(settings.database)
    database.upgrade()
    library = AssetLibrary(store_from_url(settings.store), database)
    return CataloguedAssets(library, BlobCache(settings.asset_cache, settings.asset_cache_bytes))
