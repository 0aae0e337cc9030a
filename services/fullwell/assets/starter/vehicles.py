"""The vehicles of the starter library."""

from __future__ import annotations

from typing import Final

from fullwell.assets.starter.building import StarterEntry
from fullwell.assets.starter.cars import car
from fullwell.assets.starter.heavy_vehicles import BusSpec, LorrySpec, bus, caravan, cargo_trailer, lorry, semi_trailer, tram
from fullwell.assets.starter.two_wheelers import bicycle, motorcycle
from fullwell.assets.starter.vehicle_models import CAR_MODELS

__all__ = ["VEHICLES"]

_CITY_BUS: Final = BusSpec(
    tags=("city-bus", "low-floor", "modern"),
    length_m=12.0,
    height_m=3.02,
    axles_d_m=(2.70, 8.60),
    rows_m=((1.05, 2.35),),
    windscreens_m=((0.98, 2.55),),
    doors_d_m=((0.85, 2.05), (5.1, 6.4)),
    paint="paint/red",
    route="18",
)

_COACH: Final = BusSpec(
    tags=("coach", "long-distance", "modern"),
    length_m=12.3,
    height_m=3.58,
    axles_d_m=(2.75, 8.85),
    rows_m=((1.70, 2.95),),
    windscreens_m=((1.15, 3.0),),
    doors_d_m=((0.80, 1.75),),
    paint="paint/white",
    skirt="paint/blue",
    skirt_z_m=1.15,
    display_m=(3.03, 3.2),
    route="207",
    pane_m=1.9,
    wheel_radius_m=0.51,
)

_DOUBLE_DECKER: Final = BusSpec(
    tags=("double-decker", "city-bus", "modern"),
    length_m=10.9,
    height_m=4.32,
    axles_d_m=(2.62, 8.10),
    rows_m=((1.05, 1.98), (2.85, 3.75)),
    windscreens_m=((0.98, 2.12), (2.80, 3.85)),
    doors_d_m=((0.85, 2.05), (4.9, 6.1)),
    paint="paint/red",
    display_m=(2.25, 2.62),
    route="73",
    roof_units=False,
)

_BOX_LORRY: Final = LorrySpec(
    tags=("rigid", "box", "delivery"),
    length_m=8.4,
    cab=(1.75, 2.75, 0.42),
    axles=((1.28, "single"), (5.75, "double")),
    load="box",
    load_m=(1.90, 8.4, 1.02, 3.50),
    paint="paint/white",
    width_m=2.45,
    wheel=(0.42, 0.25),
)

_FLATBED: Final = LorrySpec(
    tags=("rigid", "flatbed", "construction"),
    length_m=8.9,
    cab=(1.80, 2.85, 0.48),
    axles=((1.35, "single"), (6.1, "double")),
    load="flat",
    load_m=(2.05, 8.9, 1.12, 2.35),
    paint="paint/blue",
    load_paint="coating/grey",
)

_TIPPER: Final = LorrySpec(
    tags=("rigid", "tipper", "construction"),
    length_m=8.3,
    cab=(1.85, 2.95, 0.52),
    axles=((1.42, "single"), (5.0, "double"), (6.37, "double")),
    load="tipper",
    load_m=(2.25, 8.0, 1.18, 2.55),
    paint="paint/orange",
    load_paint="coating/grey",
)

_ARTICULATED: Final = LorrySpec(
    tags=("articulated", "tractor-trailer", "long-distance"),
    length_m=16.5,
    cab=(2.25, 3.72, 0.48),
    axles=((1.38, "single"), (5.05, "double")),
    load="semi",
    load_m=(2.90, 16.5, 1.26, 4.0),
    paint="paint/red",
    load_paint="coating/blue",
)

_HEAVY: Final = (
    StarterEntry("lorry-01", "Box lorry of 12 tonnes", lorry, {"spec": _BOX_LORRY}, 41),
    StarterEntry("lorry-02", "Flatbed lorry with timber", lorry, {"spec": _FLATBED}, 42),
    StarterEntry("lorry-03", "Articulated lorry, 16.5 m", lorry, {"spec": _ARTICULATED}, 43),
    StarterEntry("lorry-04", "Three-axle tipper", lorry, {"spec": _TIPPER}, 44),
    StarterEntry("trailer-01", "Touring caravan", caravan, {}, 51),
    StarterEntry("trailer-02", "Small cargo trailer with cover", cargo_trailer, {}, 52),
    StarterEntry(
        "trailer-03", "Parked curtain-sided semi-trailer", semi_trailer, {"kind": "curtain", "paint": "coating/green"}, 53
    ),
    StarterEntry(
        "trailer-04", "Container of 40 feet on its trailer", semi_trailer, {"kind": "container", "paint": "coating/orange"}, 54
    ),
    StarterEntry("trailer-05", "Open cargo trailer", cargo_trailer, {"length_m": 2.5, "cover": ""}, 55),
    StarterEntry("bus-01", "City bus, 12 m", bus, {"spec": _CITY_BUS}, 61),
    StarterEntry("bus-02", "Coach, 12.3 m", bus, {"spec": _COACH}, 62),
    StarterEntry("bus-03", "Double-decker", bus, {"spec": _DOUBLE_DECKER}, 63),
    StarterEntry("tram-01", "Low-floor tram, 30 m", tram, {}, 71),
    StarterEntry(
        "tram-02", "Low-floor tram, 30 m, yellow", tram, {"paint": "paint/yellow", "band": "paint/black", "route": "11"}, 72
    ),
)

_TWO_WHEELERS: Final = (
    StarterEntry("motorcycle-01", "Naked motorcycle", motorcycle, {"kind": "naked", "paint": "paint/red"}, 81),
    StarterEntry("motorcycle-02", "Touring motorcycle with cases", motorcycle, {"kind": "tourer", "paint": "paint/grey"}, 82),
    StarterEntry("motorcycle-03", "Scooter", motorcycle, {"kind": "scooter", "paint": "paint/white"}, 83),
    StarterEntry("bicycle-01", "City bicycle", bicycle, {"kind": "city", "paint": "paint/green"}, 91),
    StarterEntry("bicycle-02", "Racing bicycle", bicycle, {"kind": "sport", "paint": "paint/red"}, 92),
    StarterEntry("bicycle-03", "Mountain bicycle", bicycle, {"kind": "mountain", "paint": "paint/orange"}, 93),
)

VEHICLES: Final[tuple[StarterEntry, ...]] = (
    *(StarterEntry(name, title, car, {"spec": spec}, seed) for seed, (name, title, spec) in enumerate(CAR_MODELS, start=1)),
    *_HEAVY,
    *_TWO_WHEELERS,
)
"""All entries."""
