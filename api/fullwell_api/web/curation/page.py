"""The page itself: header, filters, the grid, and which asset is open. One object for each open page."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, ParamSpec, TypeVar, cast, get_args

from fastapi import Request
from nicegui import ui
from nicegui.element import Element

from fullwell.assets.query import REVIEW_STATES
from fullwell.core import FullwellError, ServiceError
from fullwell.jobs.asset_records import AssetEntry, AssetOrder
from fullwell_api.guards import Caller
from fullwell_api.web.curation import dialogs
from fullwell_api.web.curation.addresses import ANY_STATE, SPAN_NAMES, View, parse_view
from fullwell_api.web.curation.components import AssetGrid, Facets, SearchBox, Shell, button, icon, icon_button, tag
from fullwell_api.web.curation.context import MOUNT, Curation, curation_of
from fullwell_api.web.curation.decisions import Decisions
from fullwell_api.web.curation.detail import DetailView
from fullwell_api.web.curation.routes import style_address
from fullwell_api.web.curation.sessions import COOKIE
from fullwell_api.web.curation.uploads import Uploads
from fullwell_api.web.curation.words import card, class_text, metres_text

__all__ = ["ICON", "CurationPage", "curation_page"]

ICON: Final = Path(__file__).parents[1] / "files" / "icon.svg"
PAGE_CARDS: Final = 60
TABS: Final = (*REVIEW_STATES, ANY_STATE)
ORDER_WORDS: Final[dict[AssetOrder, str]] = {
    "newest": "Newest first",
    "title": "Title",
    "class": "Class",
    "size": "Largest first",
    "triangles": "Most triangles first",
    "id": "Id",
}
THEME_ICONS: Final = {"auto": "o_brightness_auto", "light": "o_light_mode", "dark": "o_dark_mode"}
assert set(ORDER_WORDS) == set(get_args(AssetOrder))

P = ParamSpec("P")
R = TypeVar("R")


async def curation_page(request: Request) -> None:
    """Build the page for one browser tab."""
    ui.add_head_html(f'<link rel="stylesheet" href="{style_address()}">')
    page = CurationPage(curation_of(request), request.cookies.get(COOKIE), parse_view(request.url.query, ORDER_WORDS))
    page.build()


class CurationPage:
    """What one open page shows and does. All calls to the library go through `run`, in threads of the service."""

    def __init__(self, curation: Curation, token: str | None, view: View) -> None:
        self.curation = curation
        self.library = curation.library
        self.view = view
        self.entries: list[AssetEntry] = []
        self.focus = ""
        self.selected: list[str] = []
        self._token = token
        self._cursor = ""
        self._round = 0
        self._last_toggled = ""
        self._stale = False
        self.decisions = Decisions(self)

    # -- who may do what ----------------------------------------------------------------------------------------------

    def caller(self) -> Caller | None:
        """Return who sits before the page now: a session may have ended since it was opened."""
        return self.curation.sessions.caller(self._token)

    def refusal(self) -> str:
        """Return why nothing can be changed, empty where it can."""
        caller = self.caller()
        if caller is not None and caller.may_curate:
            return ""
        return "Sign in with a curator key to change assets" if caller is None else f"The key of {caller.name!r} may look only"

    async def run(self, function: Callable[P, R], *args: P.args, **kwargs: P.kwargs) -> R:
        """Return what a function that waits returns, from a thread; nothing is read for a page whose session has ended."""
        if self.caller() is None:
            ui.navigate.reload()
            raise ServiceError("the session has ended. Sign in again.")
        return await self.curation.run(function, *args, **kwargs)

    async def attempt(self, function: Callable[P, R], *args: P.args, **kwargs: P.kwargs) -> R | None:
        """Return what a change returns; where it is refused, tell why and return None."""
        if refusal := self.refusal():
            ui.notify(f"{refusal}.", type="warning")
            return None
        try:
            return await self.run(function, *args, **kwargs)
        except FullwellError as error:
            ui.notify(error.message, type="negative", multi_line=True, timeout=9000, close_button="Close")
            return None

    # -- building -----------------------------------------------------------------------------------------------------

    def build(self) -> None:
        """Make all elements; data comes when the browser is there."""
        self.shell = Shell(on_key=self._key, on_address=self._address, on_theme=self._theme, on_undo=self.decisions.undo)
        known = self.caller() is not None
        self._header(known)
        if not known:
            self._locked()
            return
        with ui.element("div").classes("fw-frame") as self.frame:
            with ui.element("aside").classes("fw-side").props('aria-label="Filters"') as self.side:
                with ui.element("div").classes("fw-panel-head fw-only-narrow").style("width: 100%"):
                    tag("h2", "Filters")
                    icon_button("Close filters", "o_close", self._close_filters)
                self.facets = Facets(on_choose=self._choose, on_span=self._span)
            with ui.element("main").classes("fw-main"):
                self._bar()
                self.active = ui.element("div").classes("fw-active")
                self.message = ui.element("div")
                self.grid = AssetGrid(on_open=self.open, on_toggle=self.toggle, on_more=self.more)
        self.shade = ui.element("button").classes("fw-shade fw-only-narrow").props('aria-label="Close filters"')
        self.shade.on("click", lambda _: self._close_filters(), []).set_visibility(False)
        self.detail_box = ui.element("div")
        self.bulk_box = ui.element("div")
        self.detail = DetailView(self, self.detail_box)
        self.uploads = Uploads(self)
        ui.timer(0.0, self._begin, once=True)

    def _header(self, known: bool) -> None:
        with ui.element("header").classes("fw-header"):
            with ui.element("a").classes("fw-brand").props('href="/"'):
                ui.element("img").props('src="/web/icon.svg" alt="" width="28" height="28"')
                tag("span", "Fullwell")
            with ui.element("nav").props('aria-label="Pages"'):
                for text, address, here in (("Jobs", "/", False), ("Assets", f"{MOUNT}/", True), ("API", "/docs", False)):
                    link = tag("a", text).props(f'href="{address}"')
                    if here:
                        link.props('aria-current="page"')
            if known:
                self.search_box = SearchBox(self.view.text, on_search=self._search)
            else:
                ui.element("div").style("flex: 1")
            with ui.element("div").classes("fw-tools"):
                self._tools(known)

    def _tools(self, known: bool) -> None:
        caller = self.caller()
        if known:
            refusal = self.refusal()
            self.import_button = button(
                "Import",
                self._choose_files,
                symbol="o_upload_file",
                classes="" if refusal else "primary",
                refused=refusal,
                title="Import models: or drop them anywhere on the page",
                js_handler="() => document.querySelector('input[aria-label=\"Models to upload\"]').click()",
            )
        self.theme_button = icon_button("Theme: as the system", THEME_ICONS["auto"], self.shell.cycle_theme)
        if known:
            icon_button("Keyboard shortcuts (?)", "o_keyboard", dialogs.show_help, classes="fw-only-wide")
        if self.curation.services.settings.has_keys:
            if caller is None or not caller.may_curate:
                button("Sign in", lambda: dialogs.sign_in(self.shell), symbol="o_key")
            if caller is not None:
                tag("span", caller.name, "fw-caller").props(f'title="Signed in as {caller.name}"')
                icon_button("Sign out", "o_logout", self.shell.sign_out)

    def _locked(self) -> None:
        with ui.element("main").classes("fw-empty"):
            icon("o_lock")
            tag("h2", "This library needs a key")
            tag("p", "Sign in with an API key to look at assets, or with a curator key to decide about them and import more.")
            with ui.element("div").classes("row-of"):
                button("Sign in", lambda: dialogs.sign_in(self.shell), symbol="o_key", classes="primary")

    def _bar(self) -> None:
        self._tabs: dict[str, tuple[Element, Any]] = {}
        with ui.element("div").classes("fw-bar"):
            button("Filters", self._open_filters, symbol="o_tune", classes="fw-only-narrow")
            with ui.element("div").classes("fw-tabs").props('role="group" aria-label="Review state"'):
                for state in TABS:
                    with ui.element("button").props("type=button aria-pressed=false").classes(f"tab-{state}") as tab:
                        tag("span", state.capitalize())
                        count = tag("span", "", "fw-num")
                    tab.on("click", lambda _, state=state: self.go(replace(self.view, state=state)), [])
                    self._tabs[state] = (tab, count)
            ui.element("div").classes("grow")
            self.order_box = ui.element("select").classes("fw-select").props('aria-label="Order"')
            with self.order_box:
                for order, words in ORDER_WORDS.items():
                    tag("option", words).props(f'value="{order}"')
            self.order_box.props(f'value="{self.view.order or next(iter(ORDER_WORDS))}"')
            self.order_box.on("change", self._order, js_handler="(event) => emit(event.target.value)")

    # -- data ---------------------------------------------------------------------------------------------------------

    @property
    def order(self) -> AssetOrder:
        """The order of the grid."""
        return cast(AssetOrder, self.view.order or next(iter(ORDER_WORDS)))

    async def _begin(self) -> None:
        if not self.view.state:
            # Work that waits comes first; where none does, everything is shown.
            try:
                waiting = (await self.run(self.library.facets, self.view.query()))["state"].get("pending", 0)
            except FullwellError:
                waiting = 0
            self.view = replace(self.view, state="pending" if waiting and not self.view.asset else ANY_STATE)
            self.shell.replace(self._url())
        await self.refresh()
        if self.view.asset:
            await self._show_asset()
        await self.uploads.adopt()

    async def go(self, view: View) -> None:
        """Show another view, as a new step of the browser's history."""
        before, self.view = self.view, view
        self.shell.push(self._url())
        await self._changed(before)

    async def _address(self, query: str) -> None:
        before, self.view = self.view, parse_view(query, ORDER_WORDS)
        if not self.view.state:
            self.view = replace(self.view, state=ANY_STATE)
        self.search_box.set(self.view.text)
        await self._changed(before)

    async def _changed(self, before: View) -> None:
        if before.query() != self.view.query() or before.order != self.view.order:
            self.order_box.props(f'value="{self.order}"')
            await self.refresh()
        if (before.asset, before.version, before.compare) != (self.view.asset, self.view.version, self.view.compare):
            await self._show_asset()

    async def refresh(self) -> None:
        """Search anew, and count what other choices would show."""
        self._round += 1
        self._stale = False
        mine, view = self._round, self.view
        self.grid.wait()
        try:
            page = await self.run(self.library.search, view.query(), limit=PAGE_CARDS, order=self.order)
            counts = await self.run(self.library.facets, view.query())
            cards = await self.run(_cards, page.entries)
        except FullwellError as error:
            if mine == self._round:
                self._failed(error)
            return
        if mine != self._round:
            return  # another search has begun since
        self.entries, self._cursor = list(page.entries), page.next_cursor
        known = {entry.id for entry in self.entries}
        self._select([asset for asset in self.selected if asset in known])
        if self.focus not in known:
            self.focus = ""
        self._show_counts(counts)
        self._show_message()
        self.grid.show(cards, more=bool(self._cursor))
        self._mark()

    async def more(self) -> None:
        """Load the next part of the result."""
        if not self._cursor:
            return
        mine = self._round
        try:
            page = await self.run(
                self.library.search, self.view.query(), cursor=self._cursor, limit=PAGE_CARDS, order=self.order
            )
            cards = await self.run(_cards, page.entries)
        except FullwellError as error:
            ui.notify(error.message, type="negative")
            return
        if mine == self._round:
            self.entries += page.entries
            self._cursor = page.next_cursor
            self.grid.append(cards, more=bool(self._cursor))

    async def changed(self, entries: Sequence[AssetEntry]) -> None:
        """Show assets that have changed: where they stay in the result, where they leave it, and in the counts."""
        newest = {entry.id: entry for entry in entries}
        query = self.view.query()
        kept = [newest.get(entry.id, entry) for entry in self.entries]
        kept = [entry for entry in kept if entry.id not in newest or query.matches(entry.manifest, entry.state)]
        gone = {entry.id for entry in self.entries} - {entry.id for entry in kept}
        self._move_focus_from(gone, {entry.id for entry in kept})
        self.entries = kept
        self._select([asset for asset in self.selected if asset not in gone])
        self.grid.take_away(sorted(gone))
        self._mark()
        try:
            self.grid.change(await self.run(_cards, [entry for entry in kept if entry.id in newest]))
            self._show_counts(await self.run(self.library.facets, query))
        except FullwellError as error:
            ui.notify(error.message, type="negative")
        self._show_message()
        if not kept and self._cursor:
            await self.refresh()

    async def arrived(self) -> None:
        """Show what an import has brought, without moving what a person is looking at."""
        # What is open may be what has got its previews; its own view looks for them.
        self._stale = bool(self.view.asset)
        if not self._stale:
            await self.refresh()

    def _move_focus_from(self, gone: set[str], kept: set[str]) -> None:
        if self.focus in gone:
            places = [entry.id for entry in self.entries]
            after = places[places.index(self.focus) :]
            self.focus = next((asset for asset in [*after, *reversed(places)] if asset in kept), "")

    # -- showing ------------------------------------------------------------------------------------------------------

    def _url(self) -> str:
        return f"{MOUNT}/{self.view.address()}"

    def _show_counts(self, counts: dict[str, dict[str, int]]) -> None:
        states = counts["state"]
        for state, (tab, label) in self._tabs.items():
            number = sum(states.values()) if state == ANY_STATE else states.get(state, 0)
            label.set_text(f"{number:,}")
            tab.props(f"aria-pressed={'true' if state == self.view.state else 'false'}")
        view = self.view
        groups = [
            _group("class", "Class", counts["class"], {view.asset_class} - {""}, class_text),
            _group("tag", "Tags", counts["tag"], set(view.tags), str),
            _group("licence", "Licence", counts["licence"], set(view.licences), str),
        ]
        self.facets.show(groups, {name: list(getattr(view, name)) for name in SPAN_NAMES})
        self._show_active()

    def _show_active(self) -> None:
        view = self.view
        chips: list[tuple[str, View]] = []
        if view.text:
            chips.append((f"“{view.text}”", replace(view, text="")))
        if view.asset_class:
            chips.append((class_text(view.asset_class), replace(view, asset_class="")))
        chips += [(name, view.toggled("tag", name)) for name in view.tags]
        chips += [(name, view.toggled("licence", name)) for name in view.licences]
        for name in SPAN_NAMES:
            low, high = getattr(view, name)
            if (low, high) != (None, None):
                ends = [metres_text(end) if end is not None else "" for end in (low, high)]
                chips.append((f"{name} {ends[0]}–{ends[1]} m", view.spanned(name, (None, None))))
        self.active.clear()
        self.active.set_visibility(bool(chips))
        with self.active:
            for text, without in chips:
                with ui.element("button").props("type=button").on("click", lambda _, to=without: self._filter(to), []) as chip:
                    tag("span", text)
                    icon("o_close").style("font-size: 15px")
                chip._props["aria-label"] = f"Remove the filter {text}"
            if len(chips) > 1:
                clear = tag("button", "Clear all", "clear").props("type=button")
                clear.on("click", lambda _: self._filter(view.unfiltered()), [])

    def _show_message(self) -> None:
        self.message.clear()
        if self.entries:
            return
        with self.message, ui.element("div").classes("fw-empty"):
            if self.view.is_filtered:
                self._nothing_found()
            elif self.view.state != ANY_STATE:
                self._nothing_in_state()
            else:
                self._nothing_at_all()

    def _nothing_found(self) -> None:
        icon("o_search_off")
        tag("h2", "No asset matches")
        tag("p", "Take a filter away, or look in all review states.")
        with ui.element("div").classes("row-of"):
            button("Clear filters", lambda: self._filter(self.view.unfiltered()), classes="primary")
            if self.view.state != ANY_STATE:
                button("Search in all states", lambda: self.go(replace(self.view, state=ANY_STATE)))

    def _nothing_in_state(self) -> None:
        icon("o_done_all" if self.view.state == "pending" else "o_inbox")
        tag("h2", "Nothing waits for a decision" if self.view.state == "pending" else f"No asset is {self.view.state}")
        with ui.element("div").classes("row-of"):
            button("Show all assets", lambda: self.go(replace(self.view, state=ANY_STATE)), classes="primary")

    def _nothing_at_all(self) -> None:
        icon("o_view_in_ar")
        tag("h2", "The library is empty")
        tag("p", "Drop GLB, OBJ, PLY, STL or USD files here, or import a folder with the command line:")
        tag("code", "fullwell assets import models/ --class car --licence CC-BY-4.0", "fw-code")
        with ui.element("div").classes("row-of"):
            button(
                "Import models",
                self._choose_files,
                symbol="o_upload_file",
                classes="primary",
                refused=self.refusal(),
                js_handler="() => document.querySelector('input[aria-label=\"Models to upload\"]').click()",
            )
            button("Get the starter library", dialogs.explain_starter, symbol="o_auto_awesome")

    def _failed(self, error: FullwellError) -> None:
        self.entries, self._cursor = [], ""
        self.grid.show([], more=False)
        self.message.clear()
        with self.message, ui.element("div").classes("fw-empty").props('role="alert"'):
            icon("o_cloud_off")
            tag("h2", "The library cannot be reached")
            tag("p", error.message)
            with ui.element("div").classes("row-of"):
                button("Try again", self.refresh, symbol="o_refresh", classes="primary")

    def _theme(self, theme: str) -> None:
        words = {"auto": "as the system", "light": "light", "dark": "dark"}
        label = f"Theme: {words[theme]}"
        self.theme_button._props.update({"aria-label": label, "title": label})
        self.theme_button.clear()
        with self.theme_button:
            icon(THEME_ICONS[theme]).style("font-size: 20px")

    # -- filters ------------------------------------------------------------------------------------------------------

    async def _filter(self, view: View) -> None:
        self.search_box.set(view.text)
        await self.go(view)

    async def _search(self, text: str) -> None:
        if text.strip() != self.view.text:
            # Looking for something closes what is open.
            await self.go(replace(self.view.opened(""), text=text.strip()[:200]))

    async def _choose(self, key: str, name: str) -> None:
        await self.go(self.view.toggled(key, name))

    async def _span(self, key: str, low: float | None, high: float | None) -> None:
        if key not in SPAN_NAMES:
            return
        if low is not None and high is not None and low > high:
            ui.notify(f"{key}: the least ({low:g} m) is above the most ({high:g} m).", type="warning")
            return
        await self.go(self.view.spanned(key, (low, high)))

    async def _order(self, event: Any) -> None:
        await self.go(replace(self.view, order=str(event.args)))

    def _open_filters(self) -> None:
        self.side.classes("open")
        self.shade.set_visibility(True)

    def _close_filters(self) -> None:
        self.side.classes(remove="open")
        self.shade.set_visibility(False)

    def _choose_files(self) -> None:
        self.uploads.choose()

    # -- selection and keys -------------------------------------------------------------------------------------------

    def entry(self, asset: str) -> AssetEntry | None:
        """Return an entry of the grid."""
        return next((entry for entry in self.entries if entry.id == asset), None)

    def toggle(self, asset: str, to_last: bool = False) -> None:
        """Select an asset or take it out; `to_last` selects all up to the one before."""
        places = [entry.id for entry in self.entries]
        if asset not in places:
            return
        chosen = set(self.selected)
        if to_last and self._last_toggled in places:
            first, last = sorted((places.index(asset), places.index(self._last_toggled)))
            chosen |= set(places[first : last + 1])
        else:
            chosen ^= {asset}
        self._last_toggled, self.focus = asset, asset
        self._select([place for place in places if place in chosen])
        self._mark()

    def _select(self, assets: list[str]) -> None:
        changed = assets != self.selected
        self.selected = assets
        if changed:
            self._show_bulk()

    def clear_selection(self) -> None:
        """Select nothing."""
        self._select([])
        self._mark()

    def _mark(self, *, reveal: bool = False) -> None:
        self.grid.highlight(self.selected, self.focus, reveal=reveal)

    def _show_bulk(self) -> None:
        self.bulk_box.clear()
        if not self.selected or self.view.asset:
            return
        refusal = self.refusal()
        with self.bulk_box, ui.element("div").classes("fw-bulk").props('role="region" aria-label="Selected assets"'):
            tag("strong", f"{len(self.selected)} selected")
            button("Approve", self.decisions.approve, classes="good", key="a", symbol="o_check", refused=refusal)
            button("Reject", self.decisions.reject, classes="bad", key="r", symbol="o_block", refused=refusal)
            button("Edit", self.decisions.edit, key="e", symbol="o_edit", refused=refusal)
            icon_button("Clear the selection (Esc)", "o_close", self.clear_selection)

    async def open(self, asset: str) -> None:
        """Open an asset."""
        self.focus = asset
        await self.go(self.view.opened(asset))

    async def close(self) -> None:
        """Go back to the grid."""
        await self.go(self.view.opened(""))

    async def _show_asset(self) -> None:
        opened = bool(self.view.asset)
        self.frame.set_visibility(not opened)
        self.detail_box.set_visibility(opened)
        if opened:
            self.focus = self.view.asset
            self.shell.enter()
            self._show_bulk()
            await self.detail.show(self.view)
        else:
            self.detail.clear()
            if self._stale:
                await self.refresh()
            self.shell.leave()
            self._show_bulk()
            self._mark(reveal=True)

    async def step(self, by: int) -> None:
        """Go to the next or the previous asset of the result."""
        places = [entry.id for entry in self.entries]
        if not places:
            return
        start = 0 if by > 0 else len(places) - 1
        place = places.index(self.focus) + by if self.focus in places else start
        if place >= len(places) - 3 and self._cursor:
            await self.more()
            places = [entry.id for entry in self.entries]
        if not 0 <= place < len(places):
            ui.notify("That was the last one." if by > 0 else "That was the first one.", position="top", timeout=1200)
            return
        if self.view.asset:
            await self.leaf_to(places[place])
        else:
            self.focus = places[place]
            self._mark(reveal=True)

    async def leaf_to(self, asset: str) -> None:
        """Open another asset in place of the open one. Leafing is one step of the history: going back leads to the grid."""
        self.view = self.view.opened(asset)
        self.shell.replace(self._url())
        await self._show_asset()

    async def _key(self, key: str) -> None:
        if self.caller() is None:
            return
        steps = {"j": 1, "ArrowRight": 1, "k": -1, "ArrowLeft": -1}
        if key == "?":
            dialogs.show_help()
        elif key in steps:
            await self.step(steps[key])
        elif key == "Escape":
            await self._escape()
        elif key == "Enter" and self.focus and not self.view.asset:
            await self.open(self.focus)
        elif key == "x" and self.focus and not self.view.asset:
            self.toggle(self.focus)
        elif key == "c" and self.view.asset:
            await self.detail.toggle_compare()
        elif key in ("a", "r", "e"):
            await {"a": self.decisions.approve, "r": self.decisions.reject, "e": self.decisions.edit}[key]()

    async def _escape(self) -> None:
        if self.view.compare:
            await self.go(replace(self.view, compare=0))
        elif self.view.asset:
            await self.close()
        elif self.selected:
            self.clear_selection()
        elif self.view.is_filtered:
            await self._filter(self.view.unfiltered())


def _cards(entries: Sequence[AssetEntry]) -> list[dict[str, Any]]:
    return [card(entry) for entry in entries]


def _group(key: str, title: str, counts: dict[str, int], chosen: set[str], words: Callable[[str], str]) -> dict[str, Any]:
    # What is chosen stays to be seen, and to be taken back, even where it leaves nothing.
    names = [*sorted(name for name in chosen if name not in counts), *counts]
    options = [{"name": name, "label": words(name), "count": counts.get(name, 0), "on": name in chosen} for name in names]
    return {"key": key, "title": title, "options": options}
