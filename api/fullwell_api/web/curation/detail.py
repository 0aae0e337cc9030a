"""One asset: its model, its parts and what they are made of, its checks, its versions and what was decided about them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

from nicegui import ui
from nicegui.element import Element

from fullwell.assets.classes import asset_class
from fullwell.assets.records import AssetManifest, Check, PartRecord
from fullwell.core import FullwellError
from fullwell.jobs.asset_library import AssetLibrary
from fullwell.jobs.asset_records import AssetEntry, AssetEvent
from fullwell_api.routes.assets import queue_previews
from fullwell_api.web.curation import dialogs
from fullwell_api.web.curation.addresses import View
from fullwell_api.web.curation.comparing import differences
from fullwell_api.web.curation.components import ModelViewer, Turntable, button, icon, icon_button, note, tag
from fullwell_api.web.curation.spectra import chart_options, curve_of, material_lines, material_title, swatch
from fullwell_api.web.curation.words import (
    CHECK_ICONS,
    ORIGINS,
    ago,
    bytes_text,
    check_order,
    class_text,
    is_made_up,
    metres_text,
    moment,
    picture,
    size_text,
    turntable_pictures,
)

if TYPE_CHECKING:
    from fullwell_api.web.curation.page import CurationPage

__all__ = ["AssetRecord", "DetailView", "load_asset"]

PREVIEW_POLL_S: Final = 2.0
VIEWS: Final = 8
EVENT_WORDS: Final = {
    "imported": "imported version {version}",
    "edited": "made version {version}",
    "approved": "approved version {version}",
    "rejected": "rejected version {version}",
    "pending": "put version {version} back to pending",
    "retired": "took it out of the catalogue",
    "restored": "put it back into the catalogue",
    "collected": "content of version {version} was removed",
}
EXTENTS: Final = (("Length", "length_m"), ("Width", "width_m"), ("Height", "height_m"))


@dataclass(frozen=True, slots=True)
class AssetRecord:
    """All that the store knows of an asset.

    Attributes
    ----------
    versions, events
        Newest first.
    looks
        {version: digest of its look}; versions that look alike share their previews.
    previews
        {digest of a look: names of its previews}.
    """

    versions: tuple[AssetEntry, ...]
    events: tuple[AssetEvent, ...]
    looks: Mapping[int, str]
    previews: Mapping[str, tuple[str, ...]]

    def version(self, number: int) -> AssetEntry | None:
        """Return a version by its number, for 0 the newest."""
        return next((entry for entry in self.versions if not number or entry.version == number), None)


def load_asset(library: AssetLibrary, asset: str) -> AssetRecord:
    """Return all of an asset; NotFoundError where there is none of that id."""
    versions = library.versions(asset)
    looks = {entry.version: entry.manifest.look_digest for entry in versions}
    # The colours of the parts are computed here too, once for each material: the page's own thread has no time for it.
    for part in versions[0].manifest.parts:
        swatch(part.material)
    previews = {look: library.preview_names(look) for look in set(looks.values())}
    return AssetRecord(versions, library.events(asset), looks, previews)


class DetailView:
    """What a page shows of the open asset."""

    def __init__(self, page: CurationPage, box: Element) -> None:
        self._page = page
        self._box = box.classes("fw-detail")
        self._round = 0
        self._record: AssetRecord | None = None
        self._part, self._lit, self._parts_of = "", "", ""
        self._tab = "model"
        self._missing: Callable[[], None] | None = None
        self._timer = ui.timer(PREVIEW_POLL_S, self._look_for_previews, active=False)

    @property
    def newest(self) -> AssetEntry | None:
        """The newest version of the open asset."""
        return self._record.versions[0] if self._record is not None else None

    def clear(self) -> None:
        """Show nothing."""
        self._round += 1
        self._record = None
        self._timer.active = False
        self._box.clear()

    async def show(self, view: View) -> None:
        """Show an asset as the address asks for it."""
        self._round += 1
        mine = self._round
        try:
            record = await self._page.run(load_asset, self._page.library, view.asset)
        except FullwellError as error:
            if mine == self._round:
                self._trouble(view.asset, error)
            return
        if mine != self._round:
            return
        self._record = record
        entry = record.version(view.version) or record.versions[0]
        if self._parts_of != entry.id:
            self._parts_of, self._part, self._lit = entry.id, "", ""
        self._box.clear()
        self._missing = None
        with self._box:
            self._head(entry)
            other = record.version(view.compare) if view.compare else None
            if other is not None and other.version != entry.version:
                self._comparison(other, entry)
            else:
                self._columns(entry)
        self._timer.active = self._missing is not None
        self._page.shell.opened(entry.manifest.title)

    def _trouble(self, asset: str, error: FullwellError) -> None:
        self._box.clear()
        with self._box, ui.element("div").classes("fw-empty").props('role="alert"'):
            icon("o_help_outline")
            tag("h2", f"“{asset}” cannot be shown")
            tag("p", error.message)
            with ui.element("div").classes("row-of"):
                button("Back to all assets", self._page.close, classes="primary")
                button("Try again", lambda: self.show(self._page.view))

    # -- head ---------------------------------------------------------------------------------------------------------

    def _head(self, entry: AssetEntry) -> None:
        page, manifest = self._page, entry.manifest
        refusal = page.refusal()
        with ui.element("div").classes("fw-detail-bar"):
            icon_button("Back to the assets (Esc)", "o_arrow_back", page.close)
            with ui.element("div").classes("fw-detail-name"):
                tag("h1", manifest.title).props('tabindex="-1"')
                with ui.element("div").classes("sub"):
                    tag("span", entry.state, f"fw-state {entry.state}")
                    tag("span", manifest.id, "fw-mono")
                    tag("span", f"version {entry.version}")
                    tag("span", ago(entry.created_at)).props(f'title="{moment(entry.created_at)}"')
            icon_button("Previous asset (k)", "o_chevron_left", lambda: page.step(-1))
            icon_button("Next asset (j)", "o_chevron_right", lambda: page.step(1))
            button("Edit", page.decisions.edit, symbol="o_edit", key="e", refused=refusal, classes="fw-only-wide")
            with ui.element("div").classes("fw-decision"):
                done = f"It is {self._newest_state()} already"
                rejected, approved = (
                    refusal or (done if self._newest_state() == state else "") for state in ("rejected", "approved")
                )
                button("Reject", page.decisions.reject, symbol="o_block", key="r", classes="bad", refused=rejected)
                button("Approve", page.decisions.approve, symbol="o_check", key="a", classes="good", refused=approved)

    def _newest_state(self) -> str:
        return self.newest.state if self.newest is not None else ""

    def _old_version_note(self, entry: AssetEntry) -> None:
        newest = self.newest
        if newest is None or newest.version == entry.version:
            return
        with ui.element("div").classes("fw-note info"):
            icon("o_history")
            tag("div", f"This is version {entry.version}. Decisions and edits are about version {newest.version}, the newest.")
            button("Show the newest", lambda: self._go(version=0), classes="small")

    async def _go(self, **changes: Any) -> None:
        await self._page.go(replace(self._page.view, **changes))

    # -- columns ------------------------------------------------------------------------------------------------------

    def _columns(self, entry: AssetEntry) -> None:
        with ui.element("div").classes("fw-columns"):
            with ui.element("div"):
                self._old_version_note(entry)
                self._pictures(entry)
                self._materials(entry)
                self._levels(entry)
            with ui.element("div"):
                self._checks(entry)
                self._size(entry.manifest)
                self._about(entry)
                self._versions(entry)
                self._history()

    def _pictures(self, entry: AssetEntry) -> None:
        tabs = {"model": "3D model", "turntable": "Turntable", "chart": "Spectral chart"}
        with ui.element("section").classes("fw-panel flush").props('aria-label="Pictures"'):
            with ui.element("div").classes("fw-panel-head"):
                with ui.element("div").classes("fw-tabs").props('role="tablist"'):
                    buttons = {name: tag("button", text).props('type=button role="tab"') for name, text in tabs.items()}
                ui.element("div").style("flex: 1")
                level_box = ui.element("div")
            stage = ui.element("div").style("margin-top: 10px")

        def choose(name: str) -> None:
            self._tab = name
            for other, element in buttons.items():
                element.props(f"aria-selected={'true' if other == name else 'false'}")
            stage.clear()
            level_box.clear()
            with stage:
                {"model": self._model, "turntable": self._turntable, "chart": self._chart}[name](entry, level_box)

        for name, element in buttons.items():
            element.on("click", lambda _, name=name: choose(name), [])
        choose(self._tab)

    def _model(self, entry: AssetEntry, level_box: Element) -> None:
        manifest = entry.manifest
        # The file holds the colours that it came with; what a curator has chosen since is painted over them.
        paints = {part.name: swatch(part.material) for part in manifest.parts if part.material.origin == "curator"}
        self._viewer = ModelViewer(
            _model_address(entry, 0),
            label=manifest.title,
            size_m=manifest.size_m,
            paints=paints,
            on_part=lambda names: self._picked(names, entry),
        )
        self._viewer.pick(self._lit)
        if len(manifest.levels) < 2:
            return
        with level_box, ui.element("select").classes("fw-select").props('aria-label="Level of detail"') as chosen:
            for number, level in enumerate(manifest.levels):
                tag("option", f"Level {number}: {level.triangles:,} triangles").props(f'value="{number}"')
        chosen.props('value="0"')

        def change(event: Any) -> None:
            chosen.props(f'value="{int(event.args)}"')
            self._viewer.show(_model_address(entry, int(event.args)))

        chosen.on("change", change, js_handler="(event) => emit(event.target.value)")

    def _turntable(self, entry: AssetEntry, _level_box: Element) -> None:
        pictures = self._views(entry)
        table = Turntable(pictures, label=entry.manifest.title, waiting=_waiting(entry))

        def fill() -> None:
            table._props["pictures"] = self._views(entry)

        if len(pictures) < VIEWS:
            self._missing = fill
            self._timer.active = True

    def _chart(self, entry: AssetEntry, _level_box: Element) -> None:
        box = ui.element("div").classes("fw-chartpicture")

        def fill() -> None:
            box.clear()
            there = "chart" in self._previews(entry)
            with box:
                if there:
                    shown = ui.element("img").props(f'src="{picture(self._look(entry), "chart")}"')
                    shown._props["alt"] = f"Spectra of the materials of {entry.manifest.title}"
                else:
                    with ui.element("span").classes("fw-nopreview"):
                        icon("o_hourglass_empty").style("font-size: 34px")
                        tag("span", _waiting(entry))

        fill()
        if "chart" not in self._previews(entry):
            self._missing = fill
            self._timer.active = True

    def _previews(self, entry: AssetEntry) -> Sequence[str]:
        return self._record.previews.get(self._look(entry), ()) if self._record is not None else ()

    def _look(self, entry: AssetEntry) -> str:
        return self._record.looks.get(entry.version, "") if self._record is not None else ""

    def _views(self, entry: AssetEntry) -> list[str]:
        return turntable_pictures(self._look(entry), self._previews(entry))

    async def _look_for_previews(self) -> None:
        """Ask whether the worker has made further pictures; done with, once all are there."""
        record, mine = self._record, self._round
        if record is None or self._missing is None:
            self._timer.active = False
            return
        looks = list(record.previews)
        try:
            found = await self._page.run(lambda: {look: self._page.library.preview_names(look) for look in looks})
        except FullwellError:
            return  # the next look may find the store again
        if mine != self._round or self._record is not record or self._missing is None:
            return
        if dict(found) != dict(record.previews):
            self._record = replace(record, previews=found)
            self._missing()
        entry = self._record.version(self._page.view.version)
        self._timer.active = entry is not None and "chart" not in self._previews(entry)

    # -- parts and materials ------------------------------------------------------------------------------------------

    def _materials(self, entry: AssetEntry) -> None:
        parts = entry.manifest.parts
        if self._part not in {part.name for part in parts}:
            self._part = max(parts, key=lambda part: part.area_m2).name if parts else ""
        with ui.element("section").classes("fw-panel"):
            with ui.element("div").classes("fw-panel-head"):
                tag("h2", "Parts and materials")
                tag(
                    "span",
                    f"{len(parts)} parts, {sum(part.triangles for part in parts):,} triangles",
                    "fw-soft fw-small fw-num",
                )
            if not parts:
                tag("p", "This asset has no parts.", "fw-soft")
                return
            self._rows: dict[str, Element] = {}
            with ui.element("div").classes("fw-scroll"), ui.element("table").classes("fw-table"):
                with ui.element("thead"), ui.element("tr"):
                    for text, classes in (("Part", ""), ("Material", ""), ("Triangles", "r"), ("Area", "r fw-only-wide")):
                        tag("th", text, classes).props('scope="col"')
                with ui.element("tbody"):
                    for part in parts:
                        self._row(part, entry)
            self._plot_box = ui.element("div").style("margin-top: 12px")
        self._choose_part(self._part, entry, light=False)

    def _row(self, part: PartRecord, entry: AssetEntry) -> None:
        with ui.element("tr").classes("pick") as row:
            with ui.element("td"), ui.element("button").classes("fw-part").props("type=button") as name:
                made_up = " made-up" if is_made_up(part.material) else ""
                tag("span", "", f"fw-swatch{made_up}").style(f"background-color: {swatch(part.material)}")
                tag("span", part.name)
            name._props["aria-label"] = f"Show the spectrum of {part.name}"
            with ui.element("td"):
                tag("span", material_title(part.material))
                if is_made_up(part.material):
                    tag("div", "spectrum made up from sRGB", "fw-flag")
            tag("td", f"{part.triangles:,}", "r")
            tag("td", f"{part.area_m2:.3g} m²", "r fw-only-wide")
        row.on("click", lambda _: self._choose_part(part.name, entry), [])
        self._rows[part.name] = row

    def _picked(self, names: list[str], entry: AssetEntry) -> None:
        """Choose the part that was clicked in the model."""
        known = next((name for name in names if name in self._rows), None)
        if known is not None:
            self._choose_part(known, entry)

    def _choose_part(self, name: str, entry: AssetEntry, *, light: bool = True) -> None:
        self._part = name
        self._lit = name if light else self._lit
        for other, row in self._rows.items():
            row.classes(add="on" if other == name else None, remove=None if other == name else "on")
        part = next(part for part in entry.manifest.parts if part.name == name)
        if self._tab == "model":
            self._viewer.pick(self._lit)
        self._plot_box.clear()
        with self._plot_box:
            with ui.element("div").classes("fw-panel-head"):
                with ui.element("div").style("flex: 1; min-width: 0"):
                    tag("h2", material_title(part.material)).style("font-size: 15px; font-weight: 650")
                    name_of = f"{part.material.name} · " if part.material.name else ""
                    tag("div", f"{part.name} · {name_of}{ORIGINS[part.material.origin]}", "fw-soft fw-small")
                is_newest = self.newest is not None and self.newest.version == entry.version
                refusal = self._page.refusal() or ("" if is_newest else "Only the newest version can be edited")
                button("Change", lambda: self._reassign(part), symbol="o_palette", classes="small", refused=refusal)
            plot = ui.echart(chart_options([curve_of(part.material)]), renderer="svg").classes("fw-spectrum")
            plot.props('role="img"')._props["aria-label"] = f"Spectrum of {material_title(part.material)}, 380 to 1000 nm"

    async def _reassign(self, part: PartRecord) -> None:
        # Colours of the whole catalogue take a second to compute, once.
        await self._page.run(material_lines)
        chosen = await dialogs.ask_material(part)
        newest, page = self.newest, self._page
        if chosen is None or chosen == part.material.name or newest is None:
            return
        caller = page.caller()
        entries = await page.attempt(
            page.library.edit,
            [newest.id],
            who=caller.name if caller is not None else "",
            part_materials={part.name: chosen},
            expected_version=newest.version,
        )
        if entries is not None:
            ui.notify(f"Version {entries[0].version}: {part.name} is {chosen}", type="info")
            await page.attempt(self._new_pictures, entries[0], self._look(newest))
            await page.decisions.after(entries)

    def _new_pictures(self, entry: AssetEntry, old_look: str) -> None:
        """Have a look's previews rendered where it is another than before, and has none yet."""
        page, look = self._page, entry.manifest.look_digest
        if look != old_look and not page.library.preview_names(look):
            queue_previews(page.curation.services, entry, entry.created_by)

    # -- facts --------------------------------------------------------------------------------------------------------

    def _checks(self, entry: AssetEntry) -> None:
        checks = sorted(entry.manifest.checks, key=check_order)
        with ui.element("section").classes("fw-panel"):
            with ui.element("div").classes("fw-panel-head"):
                tag("h2", "Checks")
                tag("span", _summary(checks), "fw-soft fw-small")
            if entry.manifest.needs_decision and entry.state == "pending":
                note("A person must decide: approving needs a reason.", symbol="o_priority_high").style("margin-bottom: 8px")
            fine = [check for check in checks if check.state == "ok"]
            _check_list([check for check in checks if check.state != "ok"])
            if fine:
                with ui.element("details").classes("fw-fine"):
                    with ui.element("summary"):
                        icon(CHECK_ICONS["ok"])
                        tag("span", f"{len(fine)} {'check is' if len(fine) == 1 else 'checks are'} fine")
                    _check_list(fine)

    def _size(self, manifest: AssetManifest) -> None:
        kind = asset_class(manifest.asset_class)
        with ui.element("section").classes("fw-panel"):
            tag("h2", "Dimensions")
            with ui.element("div").classes("fw-scroll"), ui.element("table").classes("fw-table"), ui.element("tbody"):
                for (word, field), extent_m in zip(EXTENTS, manifest.size_m, strict=True):
                    low, high = getattr(kind, field)
                    fits = low <= extent_m <= high
                    with ui.element("tr"):
                        tag("td", word)
                        tag("td", f"{metres_text(extent_m)} m", "r").style("font-weight: 600")
                        usual = f"{class_text(kind.name)}: {low:g} to {high:g} m"
                        tag("td", usual if fits else f"unusual, {usual}", "r " + ("fw-soft" if fits else "fw-flag"))

    def _about(self, entry: AssetEntry) -> None:
        manifest = entry.manifest
        source = manifest.source
        read = f"1 unit = {source.unit_m:g} m, up {source.up_axis}, forward {source.forward_axis}"
        facts: list[tuple[str, str]] = [
            ("Licence", manifest.licence.spdx),
            ("Attribution", manifest.licence.attribution),
            ("Source", f"{source.kind}: {source.name}"),
            ("Read as", read if source.kind == "upload" else ""),
            *(_attribute(name, value) for name, value in manifest.attributes.items()),
            ("Digest", entry.digest),
        ]
        with ui.element("section").classes("fw-panel"):
            tag("h2", "About")
            with ui.element("dl").classes("fw-facts"):
                tag("dt", "Class")
                tag("dd", class_text(manifest.asset_class))
                tag("dt", "Tags")
                with ui.element("dd").classes("fw-tags"):
                    for word in manifest.tags:
                        tag("span", word, "fw-chip")
                    if not manifest.tags:
                        tag("span", "none", "fw-soft")
                for name, value in facts:
                    if value:
                        tag("dt", name)
                        tag("dd", value, "fw-mono" if name == "Digest" else "")
                if manifest.licence.url.startswith(("https://", "http://")):
                    tag("dt", "Terms")
                    with ui.element("dd"):
                        link = tag("a", manifest.licence.url).props('target="_blank" rel="noopener noreferrer"')
                        link._props["href"] = manifest.licence.url

    def _levels(self, entry: AssetEntry) -> None:
        with ui.element("section").classes("fw-panel"):
            tag("h2", "Levels of detail")
            with ui.element("div").classes("fw-scroll"), ui.element("table").classes("fw-table"), ui.element("tbody"):
                for number, level in enumerate(entry.manifest.levels):
                    with ui.element("tr"):
                        tag("td", f"Level {number}")
                        tag("td", f"{level.triangles:,} triangles", "r")
                        tag("td", bytes_text(level.bytes), "r")
                        tag("td", f"± {1000 * level.error_m:.3g} mm" if level.error_m else "exact", "r fw-soft fw-only-wide")
                        with ui.element("td").classes("r"):
                            address = f"{_model_address(entry, number)}?download=1"
                            icon_button(f"Download level {number} as GLB", "o_download", href=address)

    def _versions(self, entry: AssetEntry) -> None:
        if self._record is None:
            return
        versions = self._record.versions
        with ui.element("section").classes("fw-panel"):
            tag("h2", "Versions")
            with ui.element("ul").classes("fw-versions"):
                for version in versions:
                    with ui.element("li"):
                        opened = version.version == entry.version
                        link = tag("button", f"Version {version.version}", "fw-link").props("type=button")
                        if opened:
                            link.props('aria-current="true"').style("color: inherit")
                        number = 0 if version is versions[0] else version.version
                        link.on("click", lambda _, number=number: self._go(version=number, compare=0), [])
                        tag("span", f"{version.created_by or 'unknown'}, {ago(version.created_at)}", "grow")
                        tag("span", version.state, f"fw-state {version.state}")
                        if not opened:
                            button("Compare", lambda number=version.version: self._go(compare=number), classes="small")
            if len(versions) == 1:
                tag("p", "An edit or another import makes the next version; then two can be compared.", "fw-soft fw-small")

    def _history(self) -> None:
        if self._record is None:
            return
        with ui.element("section").classes("fw-panel"):
            tag("h2", "History")
            with ui.element("ul").classes("fw-events"):
                for event in self._record.events:
                    with ui.element("li").classes(event.kind), ui.element("div"):
                        tag("strong", event.who or "unknown")
                        tag("span", f" {EVENT_WORDS[event.kind].format(version=event.version)} ")
                        tag("time", ago(event.when)).props(f'title="{moment(event.when)}"')
                        if event.detail:
                            tag("span", event.detail, "reason")

    # -- comparison ---------------------------------------------------------------------------------------------------

    async def toggle_compare(self) -> None:
        """Compare with the version before, or stop comparing."""
        view, record = self._page.view, self._record
        if view.compare:
            await self._go(compare=0)
            return
        entry = record.version(view.version) if record is not None else None
        older = [] if record is None or entry is None else [one for one in record.versions if one.version < entry.version]
        if older:
            await self._go(compare=older[0].version)
        else:
            ui.notify("There is no version before this one.", position="top", timeout=1500)

    def _comparison(self, first: AssetEntry, second: AssetEntry) -> None:
        lines = differences(first, second)
        changed = sum(line.differs for line in lines)
        with ui.element("div").classes("fw-panel-head"):
            tag(
                "h2",
                f"Version {first.version} beside version {second.version}: {changed} difference{'' if changed == 1 else 's'}",
            )
            button("Stop comparing", lambda: self._go(compare=0), symbol="o_close", classes="small")
        tables: list[Turntable] = []
        with ui.element("div").classes("fw-compare"):
            for place, entry in enumerate((first, second)):
                with ui.element("section").classes("fw-panel flush"):
                    with ui.element("div").classes("fw-panel-head").style("padding-bottom: 10px"):
                        tag("h2", f"Version {entry.version}")
                        tag("span", size_text(entry.manifest.size_m), "fw-soft fw-small fw-num fw-only-wide")
                        tag("span", entry.state, f"fw-state {entry.state}")
                    tables.append(
                        Turntable(
                            self._views(entry),
                            label=f"Version {entry.version}",
                            waiting=_waiting(entry),
                            on_turned=lambda view, place=place: tables[1 - place].set_view(view),
                        )
                    )
        with ui.element("section").classes("fw-panel"), ui.element("table").classes("fw-table fw-diff"):
            with ui.element("thead"), ui.element("tr"):
                for text in ("", f"Version {first.version}", f"Version {second.version}"):
                    tag("th", text).props('scope="col"')
            with ui.element("tbody"):
                for line in sorted(lines, key=lambda line: not line.differs):
                    with ui.element("tr").classes("differs" if line.differs else ""):
                        tag("td", line.field)
                        tag("td", line.first)
                        tag("td", line.second)


def _check_list(checks: Sequence[Check]) -> None:
    with ui.element("ul").classes("fw-checks"):
        for check in checks:
            with ui.element("li").classes(check.state):
                icon(CHECK_ICONS[check.state])
                with ui.element("div"):
                    tag("span", check.name.replace("_", " "), "name")
                    tag("span", f" · {check.state}", "fw-soft")
                    tag("div", check.message)


def _summary(checks: Sequence[Check]) -> str:
    wrong = sum(check.state in ("decide", "failed") for check in checks)
    warned = sum(check.state == "warning" for check in checks)
    if not checks:
        return "none made"
    if wrong:
        return f"{wrong} to decide"
    return f"{warned} warning{'' if warned == 1 else 's'}" if warned else "all well"


def _attribute(name: str, value: float | str) -> tuple[str, str]:
    """Return an attribute's name and value for people: ("wheelbase", "2.71 m")."""
    number = f"{value:g}" if isinstance(value, float | int) else value
    if name.endswith("_m"):
        return name.removesuffix("_m").replace("_", " "), f"{number} m"
    return name.replace("_", " "), str(number)


def _model_address(entry: AssetEntry, level: int) -> str:
    return f"models/{entry.id}/{entry.version}/{level}.glb"


def _waiting(entry: AssetEntry) -> str:
    return "The worker has not rendered its previews yet" if entry.manifest.levels else "no model"
