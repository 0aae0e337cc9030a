"""Demand by name: how much of each kind comes in at each way into a network."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Final

from fullwell.traffic.trajectories import TrafficKind

__all__ = ["JUNCTION_SHARES", "LEVELS", "PRESETS", "preset"]

LEVELS: Final[Mapping[str, float]] = MappingProxyType({"low": 0.5, "medium": 1.0, "high": 1.5})
"""Factors on the rates of a preset, as in ISETAuto."""

PRESETS: Final[Mapping[str, Mapping[TrafficKind, float]]] = MappingProxyType(
    {
        "city": MappingProxyType(
            {"car": 0.44, "van": 0.05, "motorcycle": 0.01, "bus": 0.05, "lorry": 0.05, "cyclist": 0.05, "pedestrian": 0.1}
        ),
        "suburb": MappingProxyType(
            {"car": 0.088, "van": 0.01, "motorcycle": 0.002, "bus": 0.01, "lorry": 0.01, "cyclist": 0.03, "pedestrian": 0.05}
        ),
        "rural": MappingProxyType(
            {"car": 0.06, "van": 0.008, "motorcycle": 0.002, "bus": 0.002, "lorry": 0.008, "cyclist": 0.004, "pedestrian": 0.01}
        ),
        "motorway": MappingProxyType({"car": 0.5, "van": 0.06, "motorcycle": 0.006, "bus": 0.006, "lorry": 0.12}),
    }
)
"""New ones per second at each way into a network, at the level medium.

City and suburb are ISETAuto's, its cars split into cars, vans and motorcycles (88, 10 and 2 %). There they hold for each pair
of a way in and a way out; on one road, with two pairs, both are the same.
Rural (about 300 vehicles per hour and direction) and motorway (2500 on each carriageway) are chosen here.
"""


JUNCTION_SHARES: Final[Mapping[str, float]] = MappingProxyType({"city": 0.15})
"""Share of the vehicles of a preset (1 where it is not named) in networks whose roads meet.

A lane carries about 0.5 vehicles per second, and at a junction with lights or a roundabout less than half of that: with all
of the city at each way in, three by three blocks stand still within a minute at any level. (So: cars go at 4.6, 2.3
and 1.8 m/s on average at low, medium and high, after a minute.)
"""


def preset(name: str, level: str, *, without: Sequence[str] = ()) -> dict[TrafficKind, float]:
    """Return {kind: new ones per second at each way in} of a preset, without some kinds."""
    return {kind: LEVELS[level] * rate for kind, rate in PRESETS[name].items() if kind not in without}
