"""What recipes need of an asset store, and a recipe's pins: which versions its draws choose among."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Protocol, runtime_checkable

from fullwell.assets.query import AssetQuery
from fullwell.assets.records import AssetManifest
from fullwell.core.errors import FieldError
from fullwell.schema.errors import RecipeError
from fullwell.schema.v1.geometry import AssetGeometry
from fullwell.schema.v1.recipe import RecipeDocument
from fullwell.schema.v1.traffic import TrafficDocument
from fullwell.schema.variation import extreme_values

__all__ = [
    "AssetSource",
    "StoredAssetFiles",
    "asks_for_assets",
    "candidates_of",
    "is_pinned",
    "no_candidate",
    "pin_assets",
    "pins_of",
    "query_of",
    "split_pin",
    "traffic_queries",
]

TRAFFIC_PATH = "scene.traffic"

STREET_CLASSES = (
    "barrier", "bench", "bicycle", "bike_rack", "billboard", "bin", "building", "bus", "bus_stop", "bush", "call_box", "car",
    "clutter", "cone", "cyclist", "deer", "dog", "emergency_vehicle", "grass", "lorry", "motorcycle", "pedestrian", "rock",
    "street_light", "traffic_light", "traffic_sign", "trailer", "tram", "tree", "van",
)  # fmt: skip
"""Asset classes that streets are made of; a class of which the store has nothing is left out of the scene."""

_PIN = re.compile(r"(?P<id>[a-z0-9._-]{1,80})@(?P<digest>[0-9a-f]{64})")


class StoredAssetFiles(Protocol):
    """Assets by the digest of their manifest."""

    def manifest(self, digest: str) -> AssetManifest:
        """Return a version's manifest. Raises NotFoundError or AssetError."""
        ...

    def level_file(self, manifest: AssetManifest, level: int) -> Path:
        """Return the local GLB file of a level of detail, 0 the finest; verified by its digest."""
        ...


@runtime_checkable
class AssetSource(StoredAssetFiles, Protocol):
    """An asset store that can be searched too."""

    def candidates(self, query: AssetQuery) -> Sequence[tuple[str, str]]:
        """Return (id, digest) of each asset that matches, by its newest matching version, sorted by id."""
        ...


def split_pin(pin: str, path: str) -> tuple[str, str]:
    """Return (id, digest) of "<id>@<digest>"; raises RecipeError for `path`."""
    match = _PIN.fullmatch(pin)
    if match is None:
        raise RecipeError(f"{path} is {pin[:120]!r}; must be <id>@<64 hexadecimal digits>.", path, pin)
    return match["id"], match["digest"]


def pins_of(document: RecipeDocument, query: AssetQuery) -> tuple[tuple[str, str], ...] | None:
    """Return the pins that a recipe holds for a query, None where it holds none."""
    pins = document.assets.get(query.key)
    return None if pins is None else tuple(split_pin(pin, f"assets[{query.key!r}]") for pin in pins)


def pin_assets(document: RecipeDocument, source: AssetSource) -> RecipeDocument:
    """Return the recipe with the present candidates of all its draws in `assets`.

    From then on it makes the same scenes whatever happens to the store's catalogue. Raises RecipeError where a draw has no
    candidate. A recipe that draws nothing is returned as it is; pins that it has are kept.
    """
    pins: dict[str, list[str]] = dict(document.assets)
    for path, query in _queries(document):
        if query.key not in pins:
            found = source.candidates(query)
            if not found and path != TRAFFIC_PATH:
                raise RecipeError(no_candidate(path, query), path)
            pins[query.key] = [f"{name}@{digest}" for name, digest in found]
    if pins == document.assets:
        return document
    pinned = document.model_copy(update={"assets": pins})
    pinned._base_dir = document.base_dir
    return pinned


def is_pinned(document: RecipeDocument) -> bool:
    """Return whether a recipe holds the candidates of all its draws."""
    return all(query.key in document.assets for _, query in _queries(document))


def asks_for_assets(document: RecipeDocument) -> bool:
    """Return whether a recipe has assets, or `vary` may give it some."""
    geometries = [item.geometry for item in document.scene.objects]
    geometries += [part.geometry for item in document.scene.objects for part in item.parts or []]
    if document.scene.traffic is not None:
        return True
    if any(isinstance(geometry, AssetGeometry) for geometry in geometries):
        return True
    return document.vary is not None and '"asset"' in document.vary.model_dump_json()


def no_candidate(path: str, query: AssetQuery) -> str:
    """Return the sentence of a draw without candidates."""
    wanted = [f"{name} {value!r}" for name, value in _told(query).items()]
    states = " or ".join(query.states) or "any state"
    return (
        f"{path} finds no asset ({states}) with {', '.join(wanted) or 'no conditions'}. `fullwell assets list` shows what is "
        "there; relax a condition, approve an asset, or name another state."
    )


def _told(query: AssetQuery) -> Mapping[str, object]:
    told: dict[str, object] = {"class": query.asset_class, "tags": query.tags, "without_tags": query.without_tags}
    told |= {"licence": query.licences, "text": query.text, "id": query.ids}
    told |= {name: span for name in ("length_m", "width_m", "height_m") if (span := getattr(query, name)) != (None, None)}
    return {name: value for name, value in told.items() if value}


def _queries(document: RecipeDocument) -> Iterator[tuple[str, AssetQuery]]:
    from fullwell.schema.building import varied_document  # noqa: PLC0415 - building uses this module

    yield from _queries_in(document)
    if document.vary is not None:
        for _, path, value in extreme_values(document.vary):
            if path.startswith(("scene.objects", "scene.traffic")):
                yield from _queries_in(varied_document(document, {path: value}))


def traffic_queries(document: TrafficDocument) -> tuple[AssetQuery, ...]:
    """Return what a traffic scene may draw: everything of the classes that move, or stand beside roads."""
    return tuple(
        AssetQuery(asset_class=name, licences=tuple(sorted(document.licence)), states=tuple(sorted(set(document.state))))
        for name in STREET_CLASSES
    )


def candidates_of(
    document: RecipeDocument | None, assets: StoredAssetFiles, query: AssetQuery, path: str
) -> tuple[tuple[str, str], ...]:
    """Return (id, digest) of what a draw chooses among: the recipe's pins, or what the catalogue holds now.

    Raises RecipeError for `path` where there are neither pins nor a catalogue.
    """
    pins = None if document is None else pins_of(document, query)
    if pins is not None:
        return pins
    if not isinstance(assets, AssetSource):
        sentence = "draws assets, but the recipe holds no pins and no catalogue is at hand here. Submit it to a service."
        raise RecipeError(f"{path} {sentence}", path)
    return tuple(assets.candidates(query))


def _queries_in(document: RecipeDocument) -> Iterator[tuple[str, AssetQuery]]:
    if document.scene.traffic is not None:
        yield from ((TRAFFIC_PATH, query) for query in traffic_queries(document.scene.traffic))
    for index, item in enumerate(document.scene.objects):
        path = f"scene.objects[{index}]"
        geometries = [(f"{path}.geometry", item.geometry)]
        geometries += [(f"{path}.parts[{number}].geometry", part.geometry) for number, part in enumerate(item.parts or [])]
        for where, geometry in geometries:
            if isinstance(geometry, AssetGeometry) and "@" not in (geometry.id or ""):
                yield where, query_of(geometry, where)


def query_of(geometry: AssetGeometry, path: str) -> AssetQuery:
    """Return what an asset geometry asks for; raises RecipeError for `path`."""
    try:
        return AssetQuery(
            asset_class=geometry.asset_class or "",
            tags=tuple(geometry.tags),
            without_tags=tuple(geometry.without_tags),
            licences=tuple(sorted(geometry.licence)),
            states=tuple(sorted(set(geometry.state))),
            text=geometry.text or "",
            length_m=geometry.length_m or (None, None),
            width_m=geometry.width_m or (None, None),
            height_m=geometry.height_m or (None, None),
            ids=() if geometry.id is None else (geometry.id,),
        )
    except FieldError as error:
        raise RecipeError(f"{path}: {error.message}", path, error.value) from error
