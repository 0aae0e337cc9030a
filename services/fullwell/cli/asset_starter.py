"""Bringing the starter library into a store, on this machine or behind an address."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from fullwell.assets.records import PreparedAsset
    from fullwell.cli.asset_store import LocalAssets
    from fullwell.client import Asset, FullwellClient

__all__ = ["bring_starter"]

WHO: Final = "starter"
REASON: Final = "part of the starter library, whose generators are tested"


def bring_starter(store: FullwellClient | LocalAssets, bars: Any, *, only: str, packaged: bool, approve: bool) -> list[Asset]:
    """Generate the starter library and take it in; return its assets. What is here already stays as it is.

    A service gets it as one archive: its own checks of an archive hold for these as for any.
    """
    from fullwell.cli.asset_store import LocalAssets

    if isinstance(store, LocalAssets):
        return _generate(store, bars, only=only, packaged=packaged, approve=approve)
    from fullwell.core.settings import load_settings

    with tempfile.TemporaryDirectory(prefix="fullwell-starter-") as folder:
        home = Path(folder)
        settings = load_settings(home=home, database_url=f"sqlite:///{home / 'starter.sqlite3'}", store_url=home.as_uri())
        with LocalAssets(settings) as here:
            made = _generate(here, bars, only=only, packaged=packaged, approve=approve)
            here.export(home / "starter.zip", ids=[asset.id for asset in made])
        came = store.assets.import_archive(home / "starter.zip", trust_states=approve)
    return list(came)


def _generate(store: LocalAssets, bars: Any, *, only: str, packaged: bool, approve: bool) -> list[Asset]:
    makers = {name: make for name, make in _makers(packaged=packaged).items() if only in name}
    total = bars.add_task("starter library", total=len(makers))
    made: list[Asset] = []
    for name, make in makers.items():
        bars.update(total, description=name)
        asset, _ = store.add(make(), who=WHO)
        # A decision that a person has made about it stays.
        if approve and asset.state == "pending" and not asset.document["reviewed_by"]:
            store.review("approved", ids=[asset.id], reason=REASON, who=WHO)
        made.append(store.get(asset.id))
        bars.advance(total)
    return made


def _makers(*, packaged: bool) -> dict[str, Callable[[], PreparedAsset]]:
    """Return {id: what prepares that asset}."""
    from fullwell.assets.starter.library import packaged_assets, packaged_ids, prepare_starter, starter_entries

    makers: dict[str, Callable[[], PreparedAsset]] = {entry.id: partial(prepare_starter, entry) for entry in starter_entries()}
    if packaged:
        makers |= {name: partial(_only_one, packaged_assets, name) for name in packaged_ids()}
    return makers


def _only_one(prepare: Callable[[list[str]], Iterator[PreparedAsset]], name: str) -> PreparedAsset:
    return next(prepare([name]))
