"""Everything that asks a person: keys, reasons, changes, materials, what an upload is."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Final

from nicegui import ui
from nicegui.elements.dialog import Dialog

from fullwell.assets.classes import ASSET_CLASSES
from fullwell.assets.records import LicenceRecord, PartRecord
from fullwell.jobs.asset_records import AssetEntry
from fullwell_api.web.curation.components import Shell, button, note, tag
from fullwell_api.web.curation.spectra import MaterialLine, material_lines, material_title
from fullwell_api.web.curation.words import bytes_text, class_text

__all__ = ["UploadTerms", "ask_changes", "ask_material", "ask_reason", "ask_upload", "explain_starter", "show_help", "sign_in"]

LICENCES: Final = ("CC0-1.0", "CC-BY-4.0", "CC-BY-SA-4.0", "MIT", "Apache-2.0", "BSD-3-Clause", "EPL-2.0", "GPL-2.0-or-later")
AXES: Final = ("", "x", "-x", "y", "-y", "z", "-z")
KEYS: Final = (
    (("/",), "search"),
    (("j", "→"), "next asset"),
    (("k", "←"), "previous asset"),
    (("Enter",), "open the asset in focus"),
    (("x",), "select it; with Shift and the mouse, a range"),
    (("a",), "approve"),
    (("r",), "reject, with a reason"),
    (("e",), "edit class, tags, licence"),
    (("c",), "compare with the version before"),
    (("Esc",), "back: close, clear the selection, clear the filters"),
    (("?",), "this list"),
)
UNITS: Final = {
    0.0: "as the file says",
    1.0: "metres",
    0.01: "centimetres",
    0.001: "millimetres",
    0.0254: "inches",
    0.3048: "feet",
}


@contextmanager
def _dialog(title: str, *, wide: bool = False) -> Iterator[Dialog]:
    classes = "fw-dialog wide" if wide else "fw-dialog"
    with ui.dialog() as dialog, ui.element("div").classes(classes).props('role="dialog" aria-modal="true"') as body:
        body._props["aria-label"] = title
        tag("h2", title)
        yield dialog
    # A closed dialog is of no more use, and pages stay open for days.
    dialog.on("hide", lambda _: dialog.delete(), [])


@contextmanager
def _field(label: str, hint: str = "") -> Iterator[None]:
    with ui.element("div").classes("fw-field"):
        tag("span", label, "label").props('aria-hidden="true"')
        yield
        if hint:
            tag("span", hint, "hint")


def _class_select(value: str | None, *, empty: str | None = None) -> ui.select:
    options: dict[str, str] = {} if empty is None else {"": empty}
    options |= {name: class_text(name) for name in ASSET_CLASSES}
    chosen = ui.select(options, value=value, with_input=True)
    return chosen.props('outlined dense options-dense aria-label="Class" behavior=menu')


def _tag_select(label: str, options: Sequence[str], value: Sequence[str], *, new: bool) -> ui.select:
    words = sorted({*options, *value})
    chosen = ui.select(words, value=list(value), multiple=True, with_input=True, new_value_mode="add-unique" if new else None)
    chosen.props(
        f'outlined dense options-dense use-chips hide-dropdown-icon input-debounce=0 aria-label="{label}" behavior=menu'
    )
    return chosen


def _licence_select(value: str | None, *, options: Sequence[str] = LICENCES) -> ui.select:
    words = list(dict.fromkeys([*options, *([value] if value else [])]))
    chosen = ui.select(words, value=value, with_input=True, new_value_mode="add-unique")
    return chosen.props('outlined dense options-dense aria-label="Licence" behavior=menu')


def _line(label: str, value: str = "", placeholder: str = "") -> ui.input:
    return ui.input(value=value, placeholder=placeholder).props(f'outlined dense aria-label="{label}"')


def show_help() -> None:
    """Show the keyboard shortcuts."""
    with _dialog("Keyboard") as dialog:
        with ui.element("dl").classes("fw-keys"):
            for keys, meaning in KEYS:
                with ui.element("dt"):
                    for key in keys:
                        tag("kbd", key)
                tag("dd", meaning)
        with ui.element("div").classes("foot"):
            button("Close", dialog.close)
    dialog.open()


def explain_starter() -> None:
    """Say how the starter library comes into the store."""
    with _dialog("The starter library") as dialog:
        tag(
            "p",
            "Fullwell brings parametric cars, people, trees, buildings and street furniture, made by its own code and "
            "free to use. One command makes them, renders their previews and puts them into this library, approved:",
        )
        tag("code", "fullwell assets starter", "fw-code")
        tag("p", "It takes some minutes. What is there already is not made again.", "fw-soft fw-small")
        with ui.element("div").classes("foot"):
            button("Close", dialog.close)
    dialog.open()


def sign_in(shell: Shell) -> None:
    """Ask for a key and begin a session with it."""
    with _dialog("Sign in") as dialog:
        tag("p", "A curator key may change assets; any other key of this service may look.", "fw-soft")
        with _field("Key", "It stays in the service's memory for twelve hours; this browser gets a cookie only."):
            key = _line("Key").props("type=password autocomplete=off autofocus")
        answer = ui.element("div")

        async def send() -> None:
            answer.clear()
            refused = await shell.sign_in(key.value) if key.value.strip() else "Enter a key."
            if refused:
                with answer:
                    note(f"{refused[:1].upper()}{refused[1:]}", kind="bad", symbol="o_error_outline").props('role="alert"')

        key.on("keydown.enter", send, [])
        with ui.element("div").classes("foot"):
            button("Cancel", dialog.close)
            button("Sign in", send, classes="primary")
    dialog.open()


async def ask_reason(title: str, verb: str, *, questions: Sequence[tuple[str, str]], good: bool) -> str | None:
    """Ask why; return the reason, None where the person thinks better of it. `questions` are (asset, what is to be decided)."""
    with _dialog(title) as dialog:
        for asset, question in questions[:6]:
            note(f"{asset}: {question}", symbol="o_help_outline")
        if len(questions) > 6:
            tag("p", f"and {len(questions) - 6} more", "fw-soft fw-small")
        with _field("Reason", "It stands in the history, under your name."):
            reason = ui.textarea(placeholder="What decided it").props(
                'outlined dense autofocus aria-label="Reason" maxlength=2000'
            )

        def send() -> None:
            if reason.value.strip():
                dialog.submit(reason.value.strip())
            else:
                reason.props('error error-message="A reason is needed."')

        reason.on("keydown.ctrl.enter", send, [])
        reason.on("keydown.meta.enter", send, [])
        with ui.element("div").classes("foot"):
            button("Cancel", dialog.close)
            button(verb, send, classes="good" if good else "bad")
    answer: str | None = await dialog
    return answer


async def ask_changes(entries: Sequence[AssetEntry]) -> dict[str, Any]:
    """Ask what to change of assets; return keyword arguments of `AssetLibrary.edit`, empty where nothing is to be changed."""
    single = entries[0].manifest if len(entries) == 1 else None
    classes = {entry.manifest.asset_class for entry in entries}
    licences = {entry.manifest.licence.spdx for entry in entries}
    every = sorted({word for entry in entries for word in entry.manifest.tags})
    common = sorted(set.intersection(*({*entry.manifest.tags} for entry in entries)))
    title = f"Edit “{single.title}”" if single else f"Edit {len(entries)} assets"
    with _dialog(title) as dialog:
        name = None
        if single is not None:
            with _field("Title"):
                name = _line("Title", single.title)
        with _field("Class"):
            kind = _class_select(
                next(iter(classes)) if len(classes) == 1 else "", empty=None if len(classes) == 1 else "as they are"
            )
        if single is not None:
            with _field("Tags", "Type a word and press Enter."):
                tags = _tag_select("Tags", every, common, new=True)
            removed = None
        else:
            with _field("Tags to add", "Type a word and press Enter."):
                tags = _tag_select("Tags to add", every, [], new=True)
            with _field("Tags to remove"):
                removed = _tag_select("Tags to remove", every, [], new=False)
        with ui.element("div").classes("fw-pair"):
            with _field("Licence (SPDX)", "" if len(licences) == 1 else "Left empty, each keeps its own."):
                licence = _licence_select(next(iter(licences)) if len(licences) == 1 else None)
            with _field("Attribution"):
                attribution = _line("Attribution", single.licence.attribution if single else "", "whom to name")
        with ui.element("div").classes("foot"):
            button("Cancel", dialog.close)
            button("Save as new version" if single else "Save new versions", lambda: dialog.submit(True), classes="primary")
    if not await dialog:
        return {}
    changes: dict[str, Any] = {}
    if name is not None and single is not None and name.value.strip() != single.title:
        changes["title"] = name.value
    if kind.value and {kind.value} != classes:
        changes["asset_class"] = kind.value
    chosen = {str(word).strip().lower() for word in tags.value or []} - {""}
    added = chosen - (set(common) if single else set())
    gone = set(common) - chosen if single else {str(word) for word in (removed.value if removed else None) or []}
    changes |= ({"add_tags": sorted(added)} if added else {}) | ({"remove_tags": sorted(gone)} if gone else {})
    return changes | _licence_change(entries, licence.value, attribution.value)


def _licence_change(entries: Sequence[AssetEntry], spdx: str | None, attribution: str) -> dict[str, Any]:
    old = {entry.manifest.licence for entry in entries}
    if not spdx or not str(spdx).strip():
        return {}
    first = entries[0].manifest.licence
    kept = attribution.strip() if attribution.strip() or len(entries) == 1 else first.attribution
    same = {licence.spdx for licence in old} == {spdx} and (len(entries) > 1 and not attribution.strip())
    wanted = LicenceRecord(str(spdx).strip(), kept, first.url if first.spdx == spdx else "")
    return {} if same or old == {wanted} else {"licence": wanted}


async def ask_material(part: PartRecord) -> str | None:
    """Ask for another material of a part; return its name, None where it stays."""
    with _dialog(f"Material of “{part.name}”", wide=True) as dialog:
        tag("p", f"Now: {material_title(part.material)}", "fw-soft fw-small")
        with _field("Find"):
            needle = _line("Find a material", placeholder="paint, glass, asphalt, leaf …").props("autofocus clearable")
        shown = ui.element("div").classes("fw-materials").props('role="listbox" aria-label="Materials"')

        def fill() -> None:
            words = str(needle.value or "").casefold().split()
            shown.clear()
            with shown:
                found = [line for line in material_lines() if all(word in line.words for word in words)]
                for line in found:
                    _material_button(line, dialog, chosen=line.name == part.material.name)
                if not found:
                    tag("p", "No material of the catalogue is called that.", "fw-soft").style("padding: 12px 8px")

        needle.on_value_change(fill)
        fill()
        with ui.element("div").classes("foot"):
            button("Cancel", dialog.close)
    answer: str | None = await dialog
    return answer


def _material_button(line: MaterialLine, dialog: Dialog, *, chosen: bool) -> None:
    element = ui.element("button").props('type="button" role="option"').classes("on" if chosen else "")
    element._props["aria-selected"] = "true" if chosen else "false"
    element.on("click", lambda _: dialog.submit(line.name), [])
    with element:
        tag("span", "", "fw-swatch").style(f"background-color: {line.colour}")
        with ui.element("span").classes("name"):
            tag("span", line.title)
            tag("small", line.about)
        tag("span", line.name, "fw-mono fw-soft fw-small")


@dataclass(frozen=True, slots=True)
class UploadTerms:
    """What a person says of the files that are about to be imported. Empty axes and no unit: to be detected."""

    asset_class: str
    licence: LicenceRecord
    tags: tuple[str, ...] = ()
    up_axis: str = ""
    forward_axis: str = ""
    unit_m: float | None = None


async def ask_upload(models: Sequence[dict[str, Any]], last: UploadTerms | None) -> UploadTerms | None:
    """Ask what files are, under what licence; return it, None where nothing is to be sent."""
    title = f"Import {models[0]['name'].rpartition('/')[2]}" if len(models) == 1 else f"Import {len(models)} models"
    with _dialog(title) as dialog:
        if len(models) > 1:
            names = ", ".join(str(model["name"]).rpartition("/")[2] for model in models[:5])
            total = bytes_text(sum(int(model["bytes"]) for model in models))
            more = f" and {len(models) - 5} more" if len(models) > 5 else ""
            tag("p", f"{names}{more}; {total} in all. What you say here holds for each.", "fw-soft fw-small")
        with ui.element("div").classes("fw-pair"):
            with _field("Class"):
                kind = _class_select(last.asset_class if last else None)
            with _field("Licence (SPDX)"):
                licence = _licence_select(last.licence.spdx if last else None)
        with _field("Attribution", "Whom the licence asks to name; it stands in every frame that shows the asset."):
            attribution = _line("Attribution", last.licence.attribution if last else "", "author, source")
        with _field("Tags", "Type a word and press Enter."):
            tags = _tag_select("Tags", (), last.tags if last else (), new=True)
        with ui.element("details"):
            tag("summary", "Units and axes").style("cursor: pointer; font-size: 14px; font-weight: 600")
            with ui.element("div").classes("fw-pair").style("margin-top: 10px"):
                with _field("One unit of the file is"):
                    unit = ui.select(UNITS, value=0.0).props('outlined dense options-dense aria-label="Unit" behavior=menu')
                with _field("Up"):
                    up = _axis_select("Up axis")
                with _field("Forward", "The front of a car looks this way."):
                    forward = _axis_select("Forward axis")
        answer = ui.element("div")

        def send() -> None:
            answer.clear()
            missing = [word for word, value in (("a class", kind.value), ("a licence", licence.value)) if not value]
            if not missing:
                dialog.submit(True)
                return
            with answer:
                note(f"Choose {' and '.join(missing)}.", kind="bad", symbol="o_error_outline").props('role="alert"')

        with ui.element("div").classes("foot"):
            button("Cancel", dialog.close)
            button("Import", send, classes="primary", symbol="o_upload_file")
    if not await dialog:
        return None
    return UploadTerms(
        asset_class=str(kind.value),
        licence=LicenceRecord(str(licence.value).strip(), attribution.value.strip()),
        tags=tuple(sorted({str(word).strip().lower() for word in tags.value or []} - {""})),
        up_axis=str(up.value),
        forward_axis=str(forward.value),
        unit_m=float(unit.value) or None,
    )


def _axis_select(label: str) -> ui.select:
    options = {axis: axis or "detect" for axis in AXES}
    return ui.select(options, value="").props(f'outlined dense options-dense aria-label="{label}" behavior=menu')
