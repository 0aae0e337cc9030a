"""Things on and beside roads: which asset, where, turned how; and footprints that must not overlap."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, field
from typing import Any, Final, Literal

import numpy as np
import shapely
from numpy.typing import NDArray

from fullwell.assets.records import AssetManifest
from fullwell.traffic.trajectories import Mover

__all__ = ["AssetShelf", "Footprints", "PlacedAsset", "Role", "footprint"]

Array = NDArray[np.float64]
Role = Literal["mover", "parked", "furniture", "light", "signal", "vegetation", "building"]

_CELL_M: Final = 12.0
_EPSILON_M: Final = 1e-3
_PLANTS: Final = frozenset({"tree", "bush", "grass"})


@dataclass(frozen=True, slots=True, eq=False)
class PlacedAsset:
    """An asset in the world.

    Attributes
    ----------
    id
        Unique in the scene and stable: SUMO's for movers.
    position_m
        (3,) [m] of its pivot, on the ground below its middle.
    yaw_rad, slope_rad
        Of its forward axis +x: counter-clockwise from east, and upwards.
    lit
        Patterns of part names that emit.
    paint
        Material of its paintable parts, "" for the asset's own.
    velocity_m_s
        (3,) [m s^-1].
    mover
        What SUMO says of it; None for what stands.
    """

    id: str
    asset: AssetManifest
    role: Role
    position_m: Array
    yaw_rad: float
    slope_rad: float = 0.0
    lit: tuple[str, ...] = ()
    paint: str = ""
    velocity_m_s: Array = field(default_factory=lambda: np.zeros(3))
    mover: Mover | None = None

    def to_world(self) -> Array:
        """(4, 4) transform of the asset into the world."""
        cosine, sine = math.cos(self.yaw_rad), math.sin(self.yaw_rad)
        level, climb = math.cos(self.slope_rad), math.sin(self.slope_rad)
        matrix = np.eye(4)
        matrix[:3, 0] = [level * cosine, level * sine, climb]
        matrix[:3, 1] = [-sine, cosine, 0.0]
        matrix[:3, 2] = [-climb * cosine, -climb * sine, level]
        matrix[:3, 3] = self.position_m
        return matrix

    def outline(self, margin_m: float = 0.0) -> Any:
        """Return its footprint (a shapely polygon)."""
        return footprint(self.position_m, self.yaw_rad, self.asset.size_m, margin_m)


def footprint(position_m: Array, yaw_rad: float, size_m: Sequence[float], margin_m: float = 0.0) -> Any:
    """Return the rectangle (a shapely polygon) that a thing of a size (x forward, y left, ...) [m] covers, and a margin."""
    half = np.array([size_m[0] / 2 + margin_m, size_m[1] / 2 + margin_m])
    corners = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * half
    cosine, sine = math.cos(yaw_rad), math.sin(yaw_rad)
    turned = corners @ np.array([[cosine, sine], [-sine, cosine]])
    return shapely.Polygon(turned + np.asarray(position_m, dtype=np.float64)[:2])


class Footprints:
    """Taken ground: rectangles in a grid of cells, so that a question looks at neighbours only."""

    def __init__(self) -> None:
        self._cells: dict[tuple[int, int], list[Any]] = {}

    def is_free(self, outline: Any) -> bool:
        """Return whether an outline overlaps nothing; touching is no overlap."""
        seen: set[int] = set()
        shrunk = outline.buffer(-_EPSILON_M, join_style="mitre")
        for cell in self._covered(outline):
            for other in self._cells.get(cell, ()):
                if id(other) not in seen and other.intersects(shrunk):
                    return False
                seen.add(id(other))
        return True

    def take(self, outline: Any) -> None:
        """Mark an outline as taken."""
        for cell in self._covered(outline):
            self._cells.setdefault(cell, []).append(outline)

    def claim(self, outline: Any) -> bool:
        """Take an outline where it is free, and return whether it was."""
        free = self.is_free(outline)
        if free:
            self.take(outline)
        return free

    @staticmethod
    def _covered(outline: Any) -> Iterable[tuple[int, int]]:
        west, south, east, north = outline.bounds
        columns = range(math.floor(west / _CELL_M), math.floor(east / _CELL_M) + 1)
        rows = range(math.floor(south / _CELL_M), math.floor(north / _CELL_M) + 1)
        return [(column, row) for column in columns for row in rows]


class AssetShelf:
    """Assets to choose from, by class; draws never give the same asset twice in a row where there are two.

    Parameters
    ----------
    by_class
        Candidates of each class; their order decides draws, so it must be stable (by id).
    """

    def __init__(self, by_class: Mapping[str, Sequence[AssetManifest]]) -> None:
        self._by_class = {name: tuple(assets) for name, assets in by_class.items() if assets}
        self._last: dict[str, str] = {}

    def has(self, asset_class: str, *, tag: str = "") -> bool:
        """Return whether a class (with a tag) has an asset."""
        return bool(self.all(asset_class, tag=tag))

    def all(self, asset_class: str, *, tag: str = "", without: str = "") -> tuple[AssetManifest, ...]:
        """Return the assets of a class, with one tag and without another where they are given."""
        found = self._by_class.get(asset_class, ())
        return tuple(asset for asset in found if (not tag or tag in asset.tags) and (not without or without not in asset.tags))

    def without(self, tags: Set[str]) -> AssetShelf:
        """Return a shelf that lacks plants (trees, bushes, grass) with any of some tags; others are as they are."""
        return AssetShelf(
            {
                name: [asset for asset in assets if name not in _PLANTS or not tags & set(asset.tags)]
                for name, assets in self._by_class.items()
            }
        )

    def draw(
        self,
        rng: np.random.Generator,
        asset_class: str,
        *,
        tag: str = "",
        largest_m: tuple[float, float] = (math.inf, math.inf),
        weights: Mapping[str, float] | None = None,
    ) -> AssetManifest | None:
        """Return an asset of a class that fits into `largest_m` (along x and y) [m], None where there is none."""
        candidates = self.all(asset_class, tag=tag)
        fitting = [asset for asset in candidates if asset.size_m[0] <= largest_m[0] and asset.size_m[1] <= largest_m[1]]
        key = f"{asset_class} {tag}"
        fresh = [asset for asset in fitting if asset.id != self._last.get(key)] or fitting
        if not fresh:
            return None
        weight = np.array([_weight(asset, weights) for asset in fresh])
        if not weight.sum() > 0:
            return None
        chosen = fresh[int(rng.choice(len(fresh), p=weight / weight.sum()))]
        self._last[key] = chosen.id
        return chosen


def _weight(asset: AssetManifest, weights: Mapping[str, float] | None) -> float:
    if not weights:
        return 1.0
    return float(np.prod([weights.get(name, 1.0) for name in (asset.id, *asset.tags)]))
