"""Asset classes: what a thing may be called, and how large it can plausibly be."""

from __future__ import annotations

from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from fullwell.core.errors import FieldError, unknown_name_message

__all__ = ["ASSET_CLASSES", "AssetClass", "asset_class", "size_problems"]

Range = tuple[float, float]


@dataclass(frozen=True, slots=True)
class AssetClass:
    """A class of assets.

    Attributes
    ----------
    name, group
        The class, which labels carry, and what it belongs to: vehicle, person, animal, vegetation, building, furniture, other.
    length_m, width_m, height_m
        Plausible extents along x (forward), y (left) and z [m], smallest and largest.
    subclasses
        Tags with a narrower length [m]: a sedan is 3.5 to 5.5 m long.
    """

    name: str
    group: str
    length_m: Range
    width_m: Range
    height_m: Range
    subclasses: tuple[tuple[str, Range], ...] = ()


_CAR_LENGTHS: Final = (
    ("sedan", (3.5, 5.5)),
    ("hatchback", (2.5, 4.7)),
    ("estate", (3.8, 5.3)),
    ("suv", (3.5, 5.6)),
)

_CLASSES: Final = (
    AssetClass("car", "vehicle", (2.4, 6.0), (1.3, 2.4), (1.0, 2.4), _CAR_LENGTHS),
    AssetClass("van", "vehicle", (3.8, 7.5), (1.6, 2.5), (1.6, 3.2)),
    AssetClass("emergency_vehicle", "vehicle", (3.5, 12.5), (1.5, 2.6), (1.2, 4.0)),
    AssetClass("lorry", "vehicle", (4.5, 19.0), (1.8, 2.7), (2.0, 4.3)),
    AssetClass("bus", "vehicle", (5.5, 20.0), (1.9, 2.7), (2.4, 4.5)),
    AssetClass("tram", "vehicle", (10.0, 60.0), (2.1, 2.8), (2.8, 4.5)),
    AssetClass("trailer", "vehicle", (2.0, 14.0), (1.2, 2.7), (0.5, 4.3)),
    AssetClass("motorcycle", "vehicle", (1.5, 2.8), (0.4, 1.2), (0.8, 2.1)),
    AssetClass("bicycle", "vehicle", (1.0, 2.8), (0.3, 1.0), (0.7, 1.5)),
    AssetClass("cyclist", "vehicle", (1.0, 2.8), (0.3, 1.0), (1.2, 2.2)),
    AssetClass("pedestrian", "person", (0.15, 1.6), (0.2, 1.8), (0.7, 2.2)),
    AssetClass("deer", "animal", (0.8, 2.8), (0.2, 1.2), (0.6, 2.3)),
    AssetClass("dog", "animal", (0.3, 1.4), (0.1, 0.5), (0.2, 1.0)),
    AssetClass("tree", "vegetation", (0.5, 30.0), (0.5, 30.0), (1.5, 45.0)),
    AssetClass("bush", "vegetation", (0.2, 8.0), (0.2, 8.0), (0.15, 4.0)),
    AssetClass("grass", "vegetation", (0.1, 12.0), (0.1, 12.0), (0.02, 1.5)),
    AssetClass("rock", "vegetation", (0.1, 6.0), (0.1, 6.0), (0.05, 4.0)),
    AssetClass("building", "building", (2.0, 150.0), (2.0, 150.0), (2.2, 200.0)),
    AssetClass("street_light", "furniture", (0.1, 6.0), (0.1, 4.0), (2.5, 16.0)),
    AssetClass("traffic_light", "furniture", (0.1, 8.0), (0.1, 8.0), (1.5, 9.0)),
    AssetClass("traffic_sign", "furniture", (0.02, 1.0), (0.2, 4.0), (1.0, 6.0)),
    AssetClass("bin", "furniture", (0.2, 2.5), (0.2, 2.5), (0.4, 2.2)),
    AssetClass("bench", "furniture", (0.3, 1.2), (0.8, 4.0), (0.4, 1.4)),
    AssetClass("bike_rack", "furniture", (0.05, 4.0), (0.2, 6.0), (0.4, 1.5)),
    AssetClass("bus_stop", "furniture", (0.1, 4.0), (0.2, 8.0), (2.0, 4.0)),
    AssetClass("call_box", "furniture", (0.3, 1.6), (0.3, 1.6), (1.0, 3.0)),
    AssetClass("billboard", "furniture", (0.05, 3.0), (0.8, 14.0), (1.2, 12.0)),
    AssetClass("cone", "furniture", (0.1, 0.8), (0.1, 0.8), (0.2, 1.3)),
    AssetClass("barrier", "furniture", (0.03, 2.5), (0.4, 6.0), (0.3, 2.5)),
    AssetClass("clutter", "furniture", (0.05, 4.0), (0.05, 4.0), (0.03, 3.0)),
    AssetClass("road", "other", (0.5, 500.0), (0.5, 500.0), (0.0, 12.0)),
    AssetClass("other", "other", (0.005, 500.0), (0.005, 500.0), (0.0, 500.0)),
)

ASSET_CLASSES: Final = MappingProxyType({entry.name: entry for entry in _CLASSES})
"""All classes by name."""


def asset_class(name: str, *, path: str = "asset_class") -> AssetClass:
    """Return a class; an unknown name raises FieldError with the nearest."""
    if name not in ASSET_CLASSES:
        raise FieldError(f"{path}: {unknown_name_message('asset class', name, ASSET_CLASSES)}", path=path, value=name)
    return ASSET_CLASSES[name]


def size_problems(name: str, tags: tuple[str, ...], size_m: tuple[float, float, float]) -> tuple[str, ...]:
    """Return a sentence for each extent (x forward, y left, z) [m] that is implausible for the class and its tags."""
    kind = asset_class(name)
    length = next((span for tag, span in kind.subclasses if tag in tags), kind.length_m)
    told = next((tag for tag, _ in kind.subclasses if tag in tags), kind.name)
    spans = (("length", length), ("width", kind.width_m), ("height", kind.height_m))
    return tuple(
        f"the {what} is {value:.3g} m; a {told} is {low:g} to {high:g} m"
        for value, (what, (low, high)) in zip(size_m, spans, strict=True)
        if not low <= value <= high
    )
