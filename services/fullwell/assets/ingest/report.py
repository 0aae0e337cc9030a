"""Findings of ingestion as sentences with numbers."""

from __future__ import annotations

from collections.abc import Sequence

from fullwell.assets.ingest.mending import Mended, edges_of
from fullwell.assets.ingest.options import IngestOptions
from fullwell.assets.model import LoadedModel, LoadedPart
from fullwell.assets.records import Check

__all__ = ["file_checks", "mending_checks", "watertight_check"]

_MAX_NOTES = 20


def file_checks(model: LoadedModel, options: IngestOptions, *, kept: int) -> tuple[Check, ...]:
    """Return what reading found: "parts", "variants", "subdivision" where there are any, and "reader" for each warning."""
    count = model.triangle_count
    checks = [Check("parts", "ok", f"{kept} parts with {count} triangles.", {"parts": kept, "triangles": count})]
    if model.variants:
        checks.append(_variants_check(model, options))
    if model.subdivision_meshes:
        checks.append(_subdivision_check(model, options))
    # What the poses and mending say better is left out.
    said = ("the format states neither", "have no area", "that is not meant, set unit_m", "states no metersPerUnit")
    notes = [note for note in model.warnings if not any(text in note for text in said)]
    checks += [Check("reader", "warning", note) for note in notes[:_MAX_NOTES]]
    if len(notes) > _MAX_NOTES:
        checks.append(Check("reader", "warning", f"{len(notes) - _MAX_NOTES} further notes of the reader are left out."))
    return tuple(checks)


def _variants_check(model: LoadedModel, options: IngestOptions) -> Check:
    shown = [
        f"{entry.prim}{{{entry.name}}} is {entry.selected or 'unset'!r} of {', '.join(map(repr, entry.choices))}"
        for entry in model.variants[:_MAX_NOTES]
    ]
    text = f"{len(model.variants)} variant sets: {'; '.join(shown)}."
    given = " Chosen as given." if options.variants else " The stage's own choices were read; give variants for others."
    numbers = {"variant_sets": float(len(model.variants))}
    return Check("variants", "ok" if options.variants else "warning", text + given, numbers)


def _subdivision_check(model: LoadedModel, options: IngestOptions) -> Check:
    numbers = {"meshes": float(model.subdivision_meshes), "levels": float(options.subdivide or 0)}
    if options.subdivide is None:
        message = (
            f"{model.subdivision_meshes} meshes are control meshes of subdivision surfaces and were read as they are. Give "
            "subdivide: 1 or 2 levels to refine them, 0 to keep them."
        )
        return Check("subdivision", "decide", message, numbers)
    message = f"{model.subdivision_meshes} subdivision surfaces, refined by {options.subdivide} levels, as given."
    return Check("subdivision", "ok", message, numbers)


def mending_checks(mended: Sequence[Mended], *, removed_on_reading: int) -> tuple[Check, ...]:
    """Return the checks "triangles", "winding", "normals" and "uv"."""
    parts = [entry.part for entry in mended]
    return (_triangles_check(mended, removed_on_reading), _winding_check(mended), _normals_check(mended), _uv_check(parts))


def _triangles_check(mended: Sequence[Mended], removed_on_reading: int) -> Check:
    slivers = sum(entry.slivers for entry in mended) + removed_on_reading
    doubles = sum(entry.doubles for entry in mended)
    sides = sum(entry.one_sided for entry in mended)
    numbers = {"degenerate": float(slivers), "duplicate": float(doubles), "back_to_back": float(sides)}
    if not slivers and not doubles:
        return Check("triangles", "ok", "No triangle is degenerate or there twice.", numbers)
    back = f" {sides} of them lay back to back; their parts are two-sided now." if sides else ""
    message = f"{slivers} triangles without an area and {doubles} that were there twice were removed.{back}"
    return Check("triangles", "mended", message, numbers)


def _winding_check(mended: Sequence[Mended]) -> Check:
    turned = sum(entry.turned for entry in mended)
    bodies = sum(entry.bodies_turned for entry in mended)
    numbers = {"turned": float(turned), "bodies_turned": float(bodies)}
    if not turned:
        return Check("winding", "ok", "Neighbouring triangles are wound alike, and no closed body is inside out.", numbers)
    names = ", ".join(repr(entry.part.name) for entry in mended if entry.turned)[:200]
    inside = f"; {bodies} closed bodies were inside out" if bodies else ""
    return Check("winding", "mended", f"{turned} triangles were turned over in {names}{inside}.", numbers)


def _normals_check(mended: Sequence[Mended]) -> Check:
    made = sum(entry.normals_made for entry in mended)
    flat = sum(entry.part.normals is None for entry in mended)
    numbers = {"made": float(made), "flat": float(flat)}
    if made:
        return Check("normals", "mended", f"Normals of {made} of {len(mended)} parts were made, sharp at creases.", numbers)
    message = f"{flat} of {len(mended)} parts are shaded flat." if flat else "Every part has normals."
    return Check("normals", "ok", message, numbers)


def _uv_check(parts: Sequence[LoadedPart]) -> Check:
    with_uv = sum(part.uv is not None for part in parts)
    numbers = {"parts_with_uv": float(with_uv), "parts": float(len(parts))}
    return Check("uv", "ok", f"{with_uv} of {len(parts)} parts have texture coordinates.", numbers)


def watertight_check(parts: Sequence[LoadedPart]) -> Check:
    """Return the check "watertight": which parts enclose a volume, and whether all of them together do."""
    edges = [edges_of([part]) for part in parts]
    opened = [part.name for part, found in zip(parts, edges, strict=True) if not found.closed]
    whole = edges_of(parts)
    numbers = {
        "open_parts": float(len(opened)),
        "open_edges": float(sum(found.open for found in edges)),
        "branched_edges": float(sum(found.branched for found in edges)),
        "open_edges_together": float(whole.open),
    }
    if not opened:
        return Check("watertight", "ok", "Every part encloses a volume.", numbers)
    if whole.closed:
        return Check("watertight", "ok", "The parts together enclose a volume.", numbers)
    shown = ", ".join(map(repr, opened[:4])) + (", ..." if len(opened) > 4 else "")
    message = (
        f"{len(opened)} of {len(parts)} parts do not enclose a volume ({shown}): fine for opaque surfaces, but light passes "
        "wrongly through clear ones."
    )
    return Check("watertight", "warning", message, numbers)
