"""Buildings: city blocks, slabs and towers, offices, houses, terraces, warehouses and shops, free-standing on four sides.

The street facade faces +x. Storey heights, window sizes, railings (1.05 m), door leaves (0.9 to 1.1 m by 2.0 to 2.1 m) and
tiles follow common European practice (Neufert, Architects' Data, 4th ed., chapters on windows, doors, roofs, stairs).
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from fullwell.assets.starter.building import BuiltAsset, StarterEntry
from fullwell.assets.starter.city_blocks import city_block
from fullwell.assets.starter.flats import slab
from fullwell.assets.starter.houses import detached_house
from fullwell.assets.starter.offices import office
from fullwell.assets.starter.terraces import terraced_house
from fullwell.assets.starter.warehouses import warehouse

__all__ = ["BUILDINGS"]


def _entry(name: str, title: str, make: Callable[..., BuiltAsset], seed: int, **parameters: Any) -> StarterEntry:
    return StarterEntry(f"building-{name}", title, make, parameters, seed)


BUILDINGS: tuple[StarterEntry, ...] = (
    _entry(
        "city-limestone",
        "City block, cream plaster, mansard roof",
        city_block,
        11,
        style="limestone",
        width_m=19.0,
        depth_m=13.0,
        floors=5,
    ),
    _entry(
        "city-brick",
        "City block, red brick, flat roof",
        city_block,
        12,
        style="red_brick",
        width_m=14.0,
        depth_m=12.0,
        floors=4,
        ground_m=4.0,
        storey_m=3.3,
    ),
    _entry(
        "city-ochre",
        "City block, ochre plaster, tiled roof, balconies",
        city_block,
        13,
        style="ochre",
        width_m=22.0,
        depth_m=13.0,
        floors=5,
        storey_m=3.5,
    ),
    _entry(
        "city-rose",
        "Town house, rose plaster, shutters",
        city_block,
        14,
        style="rose",
        width_m=11.0,
        depth_m=10.0,
        floors=3,
        ground_m=3.7,
        storey_m=3.1,
    ),
    _entry(
        "city-corner",
        "Corner block, sandstone, mansard roof, shops on two streets",
        city_block,
        15,
        style="sandstone",
        width_m=17.0,
        depth_m=15.0,
        floors=6,
        corner=True,
    ),
    _entry(
        "corner-shop",
        "Corner shop, yellow brick",
        city_block,
        16,
        style="corner_shop",
        width_m=9.0,
        depth_m=8.0,
        floors=2,
        corner=True,
        ground_m=3.6,
        storey_m=3.0,
        tags=("suburb",),
    ),
    _entry(
        "slab",
        "Slab of flats, eight floors, blue balconies",
        slab,
        21,
        style="white_blue",
        width_m=30.0,
        depth_m=11.5,
        floors=8,
    ),
    _entry(
        "tower",
        "Tower of flats, twelve floors",
        slab,
        22,
        style="concrete_orange",
        width_m=20.0,
        depth_m=17.0,
        floors=12,
        storey_m=2.8,
    ),
    _entry("flats", "Flats of the fifties, tiled roof", slab, 23, style="fifties", width_m=24.0, depth_m=10.0, floors=4),
    _entry("office-curtain", "Office, curtain wall, ten floors", office, 31, width_m=27.0, depth_m=18.0, floors=10),
    _entry(
        "office-ribbon",
        "Office, ribbon windows, six floors",
        office,
        32,
        width_m=30.0,
        depth_m=15.0,
        floors=6,
        curtain_wall=False,
        frame_material="coating/black",
    ),
    _entry("house-brick", "Detached house, red brick, garage", detached_house, 41, style="brick"),
    _entry(
        "house-hip",
        "Detached house, white plaster, hipped roof",
        detached_house,
        42,
        style="white_hip",
        width_m=10.4,
        depth_m=9.0,
    ),
    _entry("house-dormers", "House with dormers, cream plaster", detached_house, 43, style="dormers", garage=False),
    _entry(
        "house-gable",
        "House, gable to the street, yellow brick",
        detached_house,
        44,
        style="gable",
        width_m=8.6,
        depth_m=10.0,
        garage=False,
    ),
    _entry("terrace-yellow", "Terraced house, yellow brick, bay window", terraced_house, 51, style="yellow_bay", tags=("uk",)),
    _entry("terrace-red", "Terraced house, red brick, three floors", terraced_house, 52, style="red", floors=3, width_m=6.4),
    _entry(
        "terrace-gable",
        "Gabled house, dark brick, stepped gable",
        terraced_house,
        53,
        style="stepped",
        floors=3,
        width_m=6.6,
        depth_m=10.0,
    ),
    _entry("warehouse", "Warehouse, metal cladding, three docks", warehouse, 61, tags=("modern",)),
    _entry(
        "mill",
        "Mill, dark brick, four floors",
        city_block,
        62,
        style="mill",
        width_m=24.0,
        depth_m=14.0,
        floors=4,
        shops=False,
        storey_m=3.6,
        ground_m=4.0,
        tags=("industrial", "warehouse"),
    ),
)
"""All buildings of the starter library."""
