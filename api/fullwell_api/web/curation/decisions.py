"""Approving, rejecting and editing: one asset or all that are selected, with a way back."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

from nicegui import ui

from fullwell.assets.query import ReviewState
from fullwell.jobs.asset_records import AssetEntry
from fullwell_api.web.curation import dialogs

if TYPE_CHECKING:
    from fullwell_api.web.curation.page import CurationPage

__all__ = ["Decisions"]

UNDO_SHOWN_S: Final = 8.0
DONE: Final = {"approved": "Approved", "rejected": "Rejected", "pending": "Pending again:"}


class Decisions:
    """What a curator does with assets, on one page."""

    def __init__(self, page: CurationPage) -> None:
        self._page = page
        self._undo: dict[str, ReviewState] = {}

    def targets(self) -> list[AssetEntry]:
        """Return what a key or button acts on: the open asset, else the selected ones, else the one in focus."""
        page = self._page
        if page.view.asset:
            return [page.detail.newest] if page.detail.newest is not None else []
        wanted = page.selected or ([page.focus] if page.focus else [])
        return [entry for asset in wanted if (entry := page.entry(asset)) is not None]

    async def approve(self) -> None:
        """Approve; where a check asks for a decision, say why."""
        targets = self._allowed("approved")
        if not targets:
            return
        unsettled = [entry for entry in targets if entry.manifest.needs_decision]
        if not unsettled:
            await self._decide(targets, "approved", "")
            return
        questions = [
            (entry.manifest.title, check.message)
            for entry in unsettled
            for check in entry.manifest.checks
            if check.state in ("decide", "failed")
        ]
        reason = await dialogs.ask_reason(_heading("Approve", targets), "Approve", questions=questions, good=True)
        if reason:
            await self._decide(targets, "approved", reason)

    async def reject(self) -> None:
        """Reject, with a reason."""
        targets = self._allowed("rejected")
        if not targets:
            return
        reason = await dialogs.ask_reason(_heading("Reject", targets), "Reject", questions=[], good=False)
        if reason:
            await self._decide(targets, "rejected", reason)

    async def edit(self) -> None:
        """Change class, tags, licence, and of a single asset its title."""
        targets = self._allowed(None)
        if not targets:
            return
        changes = await dialogs.ask_changes(targets)
        if not changes:
            return
        expected: dict[str, Any] = {"expected_version": targets[0].version} if len(targets) == 1 else {}
        page = self._page
        before = {entry.id: entry.version for entry in targets}
        entries = await page.attempt(page.library.edit, list(before), who=self._who(), **changes, **expected)
        if entries is None:
            return
        count = sum(entry.version != before[entry.id] for entry in entries)
        ui.notify(f"{count} new version{'' if count == 1 else 's'}" if count else "Nothing was different", type="info")
        await self.after(entries)

    async def undo(self) -> None:
        """Give assets back the states that they had before the last decision."""
        undo, self._undo = self._undo, {}
        page = self._page
        for state in dict.fromkeys(undo.values()):
            ids = [asset for asset, before in undo.items() if before == state]
            entries = await page.attempt(page.library.review, ids, state, who=self._who(), reason="undone")
            if entries is None:
                return
            ui.notify(f"{_named(entries)} {'is' if len(entries) == 1 else 'are'} {state} again", type="info")
        await page.refresh()
        if page.view.asset:
            await page.detail.show(page.view)

    async def after(self, entries: Sequence[AssetEntry]) -> None:
        """Show what has changed."""
        page = self._page
        await page.changed(entries)
        if page.view.asset:
            await page.detail.show(page.view)

    def _allowed(self, decision: ReviewState | None) -> list[AssetEntry]:
        if refusal := self._page.refusal():
            ui.notify(f"{refusal}.", type="warning")
            return []
        targets = self.targets()
        if decision is not None and targets and all(entry.state == decision for entry in targets):
            ui.notify(f"{_named(targets)} {'is' if len(targets) == 1 else 'are'} {decision} already", position="top")
            return []
        return targets

    async def _decide(self, targets: Sequence[AssetEntry], decision: ReviewState, reason: str) -> None:
        page = self._page
        ids = [entry.id for entry in targets]
        expected: dict[str, Any] = {"expected_version": targets[0].version} if len(targets) == 1 else {}
        entries = await page.attempt(page.library.review, ids, decision, who=self._who(), reason=reason, **expected)
        if entries is None:
            return
        self._undo = {entry.id: entry.state for entry in targets if entry.state != decision}
        kind = "positive" if decision == "approved" else "info"
        page.shell.tell_undoable(f"{DONE[decision]} {_named(entries)}", kind=kind, shown_s=UNDO_SHOWN_S)
        opened, following = page.view.asset, self._following()
        await page.changed(entries)
        if not opened:
            return
        leaves = page.view.state in ("pending", "approved", "rejected") and page.view.state != decision
        if leaves and following:
            await page.leaf_to(following)
        elif leaves and not page.entries:
            await page.close()
        else:
            await page.detail.show(page.view)

    def _following(self) -> str:
        """Return the asset after the open one: a curator goes through what waits without going back to the grid."""
        places = [entry.id for entry in self._page.entries]
        opened = self._page.view.asset
        if opened not in places:
            return ""
        place = places.index(opened)
        return next(iter([*places[place + 1 :], *reversed(places[:place])]), "")

    def _who(self) -> str:
        caller = self._page.caller()
        return caller.name if caller is not None else ""


def _named(entries: Sequence[AssetEntry]) -> str:
    return f"“{entries[0].manifest.title}”" if len(entries) == 1 else f"{len(entries)} assets"


def _heading(verb: str, entries: Sequence[AssetEntry]) -> str:
    return f"{verb} {_named(entries)}"
