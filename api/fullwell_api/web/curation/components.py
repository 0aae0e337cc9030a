"""Parts of the page that run in the browser, and the plain elements that the rest is made of."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import nicegui.elements.scene  # noqa: F401 - makes Three.js known under the name that model_viewer.js imports
from nicegui import ui
from nicegui.element import Element
from nicegui.elements.mixins.text_element import TextElement
from nicegui.events import GenericEventArguments

__all__ = [
    "FILES",
    "AssetGrid",
    "Facets",
    "Handler",
    "ModelViewer",
    "SearchBox",
    "Shell",
    "Turntable",
    "Uploader",
    "button",
    "icon",
    "icon_button",
    "note",
    "tag",
]

FILES: Final = Path(__file__).parent / "files"

Handler = Callable[..., Any]


class Shell(Element, component=FILES / "shell.js"):
    """Keyboard, address bar and theme."""

    def __init__(self, *, on_key: Handler, on_address: Handler, on_theme: Handler, on_undo: Handler) -> None:
        super().__init__()
        self.on("undo", lambda _: on_undo())
        self.on("key", lambda event: on_key(event.args))
        self.on("address", lambda event: on_address(event.args))
        self.on("theme", lambda event: on_theme(event.args))

    def push(self, address: str) -> None:
        """Show an address as a new step of the browser's history."""
        self.run_method("push", address)

    def replace(self, address: str) -> None:
        """Show an address in place of the present one."""
        self.run_method("replace", address)

    def enter(self) -> None:
        """Remember how far the page is scrolled, and scroll to its top."""
        self.run_method("enter")

    def opened(self, title: str) -> None:
        """Name the browser's tab after what is open, and let screen readers and keys begin there."""
        self.run_method("opened", title)

    def leave(self) -> None:
        """Scroll back to what `enter` remembered."""
        self.run_method("leave")

    def tell_undoable(self, message: str, *, kind: str, shown_s: float) -> None:
        """Show a notice with a button that takes back what was done; `kind` is "positive" or "info"."""
        self.run_method("tellUndoable", message, kind, round(1000 * shown_s))

    def cycle_theme(self) -> None:
        """Go on to the next theme: the system's, light, dark."""
        self.run_method("cycleTheme")

    async def sign_in(self, key: str) -> str:
        """Begin a session in this browser; return why it was refused, or nothing while the page loads anew."""
        return str(await self.run_method("signIn", key, timeout=20.0) or "")

    def sign_out(self) -> None:
        """End this browser's session and load the page anew."""
        self.run_method("signOut")


class SearchBox(Element, component=FILES / "search_box.js"):
    """The search field."""

    def __init__(self, text: str, *, on_search: Handler) -> None:
        super().__init__()
        self._props["start"] = text
        self.on("search", lambda event: on_search(event.args))

    def set(self, text: str) -> None:
        """Show another text."""
        self.run_method("set", text)


class AssetGrid(Element, component=FILES / "asset_grid.js"):
    """Cards of assets."""

    def __init__(self, *, on_open: Handler, on_toggle: Handler, on_more: Handler) -> None:
        super().__init__()
        self.on("open", lambda event: on_open(event.args))
        self.on("toggle", lambda event: on_toggle(event.args["id"], event.args["range"]))
        self.on("more", lambda _: on_more())

    def wait(self) -> None:
        """Tell that what is shown is about to change."""
        self.run_method("wait")

    def show(self, cards: Sequence[dict[str, Any]], *, more: bool) -> None:
        """Show these cards and no others; `more` are to be had."""
        self.run_method("show", list(cards), more)

    def take_away(self, assets: Sequence[str]) -> None:
        """Take cards away."""
        self.run_method("remove", list(assets))

    def append(self, cards: Sequence[dict[str, Any]], *, more: bool) -> None:
        """Show further cards."""
        self.run_method("append", list(cards), more)

    def change(self, cards: Sequence[dict[str, Any]]) -> None:
        """Show cards anew that are shown already."""
        self.run_method("change", list(cards))

    def highlight(self, selected: Sequence[str], focus: str, *, reveal: bool = False) -> None:
        """Mark the selected cards and the one that keys act on; `reveal` scrolls to it."""
        self.run_method("mark", list(selected), focus, reveal)


class Facets(Element, component=FILES / "facets.js"):
    """The filter panel."""

    def __init__(self, *, on_choose: Handler, on_span: Handler) -> None:
        super().__init__()
        self.on("choose", lambda event: on_choose(event.args["key"], event.args["name"]))
        self.on("span", lambda event: on_span(event.args["key"], event.args["low"], event.args["high"]))

    def show(self, groups: Sequence[dict[str, Any]], sizes: dict[str, Any]) -> None:
        """Show groups of options with their counts, and ranges of sizes [m]."""
        self.run_method("show", list(groups), sizes)


class Turntable(Element, component=FILES / "turntable.js"):
    """Pictures of a model from all sides."""

    def __init__(
        self, pictures: Sequence[str], *, label: str, waiting: str, start: int = 0, on_turned: Handler | None = None
    ) -> None:
        super().__init__()
        self._props.update(pictures=list(pictures), label=label, waiting=waiting, start=start)
        if on_turned is not None:
            self.on("turned", lambda event: on_turned(event.args))

    def set_view(self, view: int) -> None:
        """Turn to a picture by its number from 0."""
        self.run_method("set", view)


class ModelViewer(Element, component=FILES / "model_viewer.js"):
    """A GLB file to turn; `size_m` are the asset's extents (x forward, y left, z up) [m], `paints` colours [CSS] of parts."""

    def __init__(
        self, source: str, *, label: str, size_m: Sequence[float], paints: Mapping[str, str], on_part: Handler
    ) -> None:
        super().__init__()
        self._props.update(source=source, label=label, size=list(size_m), paints=dict(paints), picked="")
        self.on("part", lambda event: on_part(event.args))

    def show(self, source: str) -> None:
        """Show another file of the same model."""
        self._props["source"] = source

    def pick(self, part: str) -> None:
        """Light up a part; none for an empty name."""
        self._props["picked"] = part


class Uploader(Element, component=FILES / "uploader.js"):
    """Drop anywhere; a list of what was sent and what became of it."""

    def __init__(self, *, allowed: bool, address: str, most_bytes: int) -> None:
        super().__init__()
        self._props.update(allowed=allowed, address=address, most=most_bytes)

    def when(self, event: str, handler: Handler) -> None:
        """Call a handler with what an event of the browser carries."""

        def call(arguments: GenericEventArguments) -> Any:
            return handler(arguments.args)

        self.on(event, call)

    def choose(self) -> None:
        """Open the browser's choice of files. Browsers allow it in answer to a click or key only."""
        self.run_method("choose")

    def start(self, note: Any) -> None:
        """Send the files that were dropped or chosen last; `note` comes back with each."""
        self.run_method("start", note)

    def follow(self, changes: Sequence[dict[str, Any]]) -> None:
        """Change rows of the list."""
        self.run_method("follow", list(changes))

    def adopt(self, rows: Sequence[dict[str, Any]]) -> None:
        """Add rows for work that other pages began."""
        self.run_method("adopt", list(rows))


def tag(name: str, text: str = "", classes: str = "") -> Element:
    """Return an element of HTML with a text, which is never taken for markup."""
    element = TextElement(tag=name, text=text)
    return element.classes(classes) if classes else element


def icon(name: str) -> Element:
    """Return a picture that says nothing to screen readers."""
    return ui.icon(name).props('aria-hidden="true"')


def button(
    text: str,
    handler: Handler,
    *,
    symbol: str = "",
    classes: str = "",
    key: str = "",
    refused: str = "",
    title: str = "",
    js_handler: str | None = None,
) -> Element:
    """Return a button. `key` is its keyboard shortcut; `refused` says why it cannot be used, empty where it can."""
    element = ui.element("button").classes(f"fw-button {classes}").props("type=button")
    with element:
        if symbol:
            icon(symbol)
        tag("span", text)
        if key:
            tag("kbd", key).props('aria-hidden="true"')
    return _clickable(element, handler, refused=refused, title=title, js_handler=js_handler)


def icon_button(
    label: str, symbol: str, handler: Handler | None = None, *, refused: str = "", classes: str = "", href: str = ""
) -> Element:
    """Return a button, or with `href` a link, that shows a picture only; its label is what it is called."""
    element = ui.element("a" if href else "button").classes(f"fw-icon {classes}")
    element._props["aria-label"] = label
    if href:
        element._props["href"] = href
    else:
        element._props["type"] = "button"
    with element:
        icon(symbol).style("font-size: 20px")
    return _clickable(element, handler, refused=refused, title=label, js_handler=None)


def _clickable(element: Element, handler: Handler | None, *, refused: str, title: str, js_handler: str | None) -> Element:
    if refused or title:
        element._props["title"] = refused or title
    if refused:
        element._props["disabled"] = True
    elif js_handler is not None:
        element.on("click", js_handler=js_handler)
    elif handler is not None:
        element.on("click", lambda _: handler(), [])
    return element


def note(text: str, *, kind: str = "", symbol: str = "o_info") -> Element:
    """Return a box with a message; `kind` is "", "bad" or "info"."""
    with ui.element("div").classes(f"fw-note {kind}") as box:
        icon(symbol)
        tag("div", text)
    return box
