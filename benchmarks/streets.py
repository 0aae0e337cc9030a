"""Streets: how long one takes to assemble, and whether many seeds all assemble without an error or an overlap.

Run: python -m benchmarks.streets [--seeds 1000] [--write]; takes the assets of this machine's store
(fullwell assets starter --approve --no-previews). --write fills docs/benchmarks/streets.md.
"""

from __future__ import annotations

import argparse
import statistics
import time
from collections import Counter

import numpy as np
import shapely

from benchmarks.results import DOCS, fill_page, markdown_table, number
from fullwell.assets.query import AssetQuery
from fullwell.core.settings import load_settings
from fullwell.pipeline.assets import assets_of_settings
from fullwell.schema.assets import STREET_CLASSES
from fullwell.traffic.dressing import pivot_of_pole
from fullwell.traffic.networks import NetworkSpec
from fullwell.traffic.placement import AssetShelf, PlacedAsset, footprint
from fullwell.traffic.simulation import TrafficDemand
from fullwell.traffic.street import Street, StreetSpec
from fullwell.traffic.templates import CrossSection

CITY = CrossSection(parking_width_m=2.2, sidewalk_width_m=3.5)
DEMAND = TrafficDemand({"car": 0.4, "van": 0.06, "bus": 0.04, "cyclist": 0.08, "pedestrian": 0.5}, {"car": 6.0})
MOTORWAY = TrafficDemand({"car": 0.8, "lorry": 0.15, "van": 0.1})
KINDS = (
    ("blocks", "city", 270.0, CITY, DEMAND),
    ("cross", "city", 180.0, CITY, DEMAND),
    ("tee", "suburb", 180.0, CITY, DEMAND),
    ("roundabout", "suburb", 180.0, CrossSection(), DEMAND),
    ("curve", "rural", 300.0, CrossSection(sidewalk_width_m=0.0), TrafficDemand({"car": 0.2, "cyclist": 0.05}, {"car": 5.0})),
    ("motorway", "motorway", 500.0, CrossSection(lanes=3), MOTORWAY),
)


def shelf() -> AssetShelf:
    """Return the approved assets of this machine's store."""
    assets = assets_of_settings(load_settings())
    return AssetShelf(
        {
            name: [assets.manifest(digest) for _, digest in assets.candidates(AssetQuery(asset_class=name))]
            for name in STREET_CLASSES
        }
    )


def overlaps(items: list[PlacedAsset]) -> int:
    """Return how many pairs overlap by more than 10 cm on the ground; poles and trunks count by themselves."""
    outlines = [_ground(item).buffer(-0.1) for item in items if item.asset.asset_class != "pedestrian"]
    first, second = shapely.STRtree(outlines).query(outlines, predicate="intersects")
    return int(np.count_nonzero(first < second))


def _ground(item: PlacedAsset) -> shapely.Polygon:
    if item.role in ("light", "signal"):
        return footprint(pivot_of_pole(item.asset, item.position_m, item.yaw_rad, back=True), item.yaw_rad, (0.3, 0.3))
    if item.asset.asset_class == "tree":
        return footprint(item.position_m, item.yaw_rad, (0.3, 0.3))
    return item.outline()


def main() -> None:
    """Assemble, count, report."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=60, help="of all kinds together")
    parser.add_argument("--write", action="store_true")
    arguments = parser.parse_args()
    on_shelf = shelf()
    times: dict[str, list[float]] = {}
    counts: dict[str, list[int]] = {}
    found: Counter[str] = Counter()
    for seed in range(arguments.seeds):
        layout, style, length_m, section, demand = KINDS[seed % len(KINDS)]
        spec = StreetSpec(
            NetworkSpec(layout, section=section, length_m=length_m), demand, style=style, times_s=(40.0,), seed=seed
        )
        started = time.process_time()
        try:
            street = Street(spec, on_shelf)
            moment = street.moment(0)
            _ = street.surfaces
        except Exception as error:
            found[f"{layout}, {style}: errors"] += 1
            print(f"seed {seed}: {error}", flush=True)
            continue
        key = f"{layout}, {style}"
        times.setdefault(key, []).append(time.process_time() - started)
        counts.setdefault(key, []).append(len(moment.assets))
        pairs = overlaps(list(moment.assets))
        found[f"{key}: overlaps"] += pairs
        if pairs:
            print(f"seed {seed}: {pairs} overlaps", flush=True)
    rows = [
        [
            f"`{key}`",
            str(len(values)),
            number(statistics.mean(counts[key])),
            number(statistics.median(values)),
            number(max(values)),
            str(found[f"{key}: overlaps"]),
            str(found[f"{key}: errors"]),
        ]
        for key, values in times.items()
    ]
    header = ["Layout, style", "seeds", "objects", "CPU-s, median", "CPU-s, most", "overlaps", "errors"]
    table = markdown_table(header, rows)
    print(table)
    if arguments.write:
        fill_page(
            DOCS / "streets.md",
            "results",
            f"```sh\npython -m benchmarks.streets --seeds {arguments.seeds} --write\n```\n\n{table}",
        )


if __name__ == "__main__":
    main()
