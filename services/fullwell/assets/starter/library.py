"""The starter library: every generated asset, and the models that an installed package carries, prepared for the store.

`python -m fullwell.assets.starter.library` compares what the generators make with the list in assets/catalogue.json; with
`--write` it makes the list anew, all of it or the assets of some ids.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, is_dataclass, replace
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any, Final

from fullwell.assets.ingest import IngestOptions, prepare_built, prepare_file
from fullwell.assets.packaged import SUMO_PREFIX, packaged_model, packaged_model_names
from fullwell.assets.records import AssetManifest, Check, LicenceRecord, PreparedAsset, SourceRecord
from fullwell.assets.starter.building import StarterEntry
from fullwell.assets.starter.built import BUILT
from fullwell.assets.starter.living import LIVING
from fullwell.assets.starter.vehicles import VEHICLES

__all__ = [
    "STARTER_LICENCE",
    "catalogue_row",
    "packaged_assets",
    "packaged_ids",
    "prepare_starter",
    "starter_entries",
    "starter_entry",
]

STARTER_LICENCE: Final = LicenceRecord(
    "Apache-2.0", attribution="The Fullwell developers", url="https://www.apache.org/licenses/LICENSE-2.0"
)
"""Generated assets have the licence of the code that makes them."""

_CATALOGUE: Final = Path("assets/catalogue.json")


def starter_entries() -> tuple[StarterEntry, ...]:
    """Return all generated assets: vehicles, all that lives, all that is built; their ids are unique."""
    return (*VEHICLES, *LIVING, *BUILT)


def starter_entry(asset_id: str) -> StarterEntry:
    """Return one generated asset by its id; KeyError where there is none of that name."""
    return {entry.id: entry for entry in starter_entries()}[asset_id]


def prepare_starter(entry: StarterEntry) -> PreparedAsset:
    """Return a generated asset ready for the store; the same bytes each time.

    Its source names the generator, its parameters and its seed. Buildings have one level of detail: they consist of sheets
    and boxes of which none can be simplified without being lost.
    """
    built = entry.build()
    source = SourceRecord(
        kind="generator",
        name=f"{entry.make.__module__}.{entry.make.__qualname__}",
        parameters={"parameters": _plain(entry.parameters), "seed": entry.seed},
    )
    options = IngestOptions(id=entry.id, level_ratios=()) if built.asset_class == "building" else None
    return prepare_built(built, id=entry.id, title=entry.title, licence=STARTER_LICENCE, source=source, options=options)


def _plain(value: Any) -> Any:
    """Parameters as a JSON document can hold them."""
    if is_dataclass(value) and not isinstance(value, type):
        return _plain(asdict(value))
    if isinstance(value, Mapping):
        return {str(key): _plain(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(entry) for entry in value]
    return value


# -- models of packages ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Packaged:
    """What a packaged model is: SUMO draws its models at any size, so that the length has to be said here.

    Attributes
    ----------
    length_m
        Of the real thing, along the forward axis; None where the file is in metres.
    forward_axis
        Of the file. SUMO's vehicles and people face +z with y up, its signal heads -x.
    """

    title: str
    asset_class: str
    tags: tuple[str, ...]
    length_m: float | None = None
    forward_axis: str = "z"


_PACKAGED: Final[Mapping[str, _Packaged]] = {
    # The cars are stubby: their lengths are such that widths come out at 1.7 to 2.0 m.
    "car-normal-citrus": _Packaged("Small car", "car", ("hatchback", "small"), 3.7),
    "car-microcargo-citrus": _Packaged("Small delivery van", "van", ("delivery", "small"), 3.9),
    "car-minibus-citrus": _Packaged("Minibus", "van", ("minibus",), 4.6),
    # 1.2 units wide for 2.4 m.
    "tram": _Packaged("Tram", "tram", ("articulated",), 21.1),
    "humanresting": _Packaged("Person, standing", "pedestrian", ("adult", "standing")),
    "polebase": _Packaged("Pole for a signal head, 1 m", "other", ("pole", "signal"), None, "x"),
    "tlg": _Packaged("Signal head, green", "other", ("signal", "head", "green"), None, "-x"),
    "tlr": _Packaged("Signal head, red", "other", ("signal", "head", "red"), None, "-x"),
    "tlu": _Packaged("Signal head, red and amber", "other", ("signal", "head", "red_amber"), None, "-x"),
    "tly": _Packaged("Signal head, amber", "other", ("signal", "head", "amber"), None, "-x"),
}


def packaged_ids() -> tuple[str, ...]:
    """Return the ids of the packaged models, "sumo-" and the file's name; empty where eclipse-sumo is not installed."""
    return tuple(_packaged_id(name) for name in packaged_model_names())


def packaged_assets(ids: Sequence[str] | None = None) -> Iterator[PreparedAsset]:
    """Yield the models that eclipse-sumo carries as assets, all or those with some ids, under the package's licence.

    Models that a newer version of the package adds are taken in as class "other" with the size that ingestion finds plausible.
    """
    for name in packaged_model_names():
        asset_id = _packaged_id(name)
        if ids is None or asset_id in ids:
            yield _prepare_packaged(name, asset_id)


def _packaged_id(name: str) -> str:
    path = name.removeprefix(SUMO_PREFIX).rpartition(".")[0].lower()
    return "sumo-" + "".join(letter if letter.isalnum() or letter in "._-" else "-" for letter in path)


def _prepare_packaged(name: str, asset_id: str) -> PreparedAsset:
    model = packaged_model(name)
    facts = _PACKAGED.get(asset_id.removeprefix("sumo-"))
    options = IngestOptions(
        id=asset_id,
        asset_class=facts.asset_class if facts else "other",
        title=facts.title if facts else model.path.stem,
        tags=("sumo", *(facts.tags if facts else ())),
        licence=LicenceRecord(model.licence, attribution=model.source.partition(",")[0], url="https://eclipse.dev/sumo"),
        source_kind="package",
        source_name=model.source,
        up_axis="y",
    )
    if facts:
        options = options.with_changes(
            forward_axis=facts.forward_axis, **({"length_m": facts.length_m} if facts.length_m else {"unit_m": 1.0})
        )
    return _in_named_materials(prepare_file(model.path.parent, model.path.name, options))


_PART_MATERIALS: Final[Mapping[str, str]] = {
    "Red": "lamp/traffic_red",
    "Yellow": "lamp/traffic_amber",
    "Green": "lamp/traffic_green",
    "None": "plastic/black",
    "Gray": "metal/steel_galvanised",
}
"""Of signal heads and poles, whose parts are named by colour: no rule that holds for other files too would find these."""


def _in_named_materials(asset: PreparedAsset) -> PreparedAsset:
    manifest = asset.manifest
    if manifest.asset_class != "other" or not all(part.name in _PART_MATERIALS for part in manifest.parts):
        return asset
    parts = tuple(
        replace(part, material=replace(part.material, origin="rule", name=_PART_MATERIALS[part.name]))
        for part in manifest.parts
    )
    found = Check(
        "materials", "ok", "Every part has a material of the catalogue.", {"parts": float(len(parts)), "fallback": 0.0}
    )
    checks = tuple(found if check.name == "materials" else check for check in manifest.checks)
    return PreparedAsset(manifest.with_changes(parts=parts, checks=checks), asset.blobs)


# -- the list -------------------------------------------------------------------------------------------------------------


def catalogue_row(manifest: AssetManifest) -> dict[str, Any]:
    """Return what assets/catalogue.json says of an asset."""
    return {
        "id": manifest.id,
        "title": manifest.title,
        "class": manifest.asset_class,
        "tags": list(manifest.tags),
        "size_m": [round(side, 3) for side in manifest.size_m],
        "triangles": [level.triangles for level in manifest.levels],
        "licence": manifest.licence.spdx,
        "digest": manifest.digest,
    }


def _chosen_rows(patterns: Sequence[str]) -> Iterator[dict[str, Any]]:
    def wanted(asset_id: str) -> bool:
        return any(fnmatchcase(asset_id, pattern) for pattern in patterns)

    for entry in starter_entries():
        if wanted(entry.id):
            yield catalogue_row(prepare_starter(entry).manifest)
    for asset in packaged_assets([asset_id for asset_id in packaged_ids() if wanted(asset_id)]):
        yield catalogue_row(asset.manifest)


def _read(file: Path) -> dict[str, dict[str, Any]]:
    return {row["id"]: row for row in json.loads(file.read_text(encoding="utf-8"))} if file.exists() else {}


def _write(file: Path, rows: Mapping[str, Mapping[str, Any]]) -> None:
    """Write the list in the order of the library; what is no longer in it is dropped."""
    order = [*(entry.id for entry in starter_entries()), *packaged_ids()]
    lines = ",\n".join("  " + json.dumps(rows[asset_id], ensure_ascii=False) for asset_id in order if asset_id in rows)
    written = file.with_name(file.name + ".new")
    written.write_text(f"[\n{lines}\n]\n", encoding="utf-8")
    written.replace(file)


def _main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description="Compare the starter library with its list, or write the list.")
    parser.add_argument("ids", nargs="*", default=["*"], help="patterns of ids, such as 'sign-*' (default: all)")
    parser.add_argument("--write", action="store_true", help="write the list, after each asset; other rows stay")
    parser.add_argument("--missing", action="store_true", help="only assets that are not in the list")
    parser.add_argument("--file", type=Path, default=_CATALOGUE, help="the list (default: %(default)s)")
    chosen = parser.parse_args(arguments)
    listed = _read(chosen.file)
    patterns = chosen.ids
    if chosen.missing:
        everything = [*(entry.id for entry in starter_entries()), *packaged_ids()]
        patterns = [name for name in everything if name not in listed and any(fnmatchcase(name, p) for p in chosen.ids)]
    different = []
    for row in _chosen_rows(patterns):
        print(f"{row['id']:36} {row['class']:18} {row['triangles'][0]:7d} triangles", file=sys.stderr, flush=True)
        if listed.get(row["id"]) != row:
            different.append(row["id"])
        if chosen.write:
            listed[row["id"]] = row
            _write(chosen.file, listed)
    if chosen.write:
        return 0
    print("\n".join(f"differs: {name}" for name in different) or "as listed")
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(_main())
