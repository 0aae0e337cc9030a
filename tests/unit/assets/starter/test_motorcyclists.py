"""Motorcyclists: a rider in touch with seat, grips and pegs of the machine below."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fullwell.assets.starter.building import BuiltAsset
from fullwell.assets.starter.motorcyclists import MOTORCYCLISTS

REACH_M = 0.09
"""From the middle of a grip or peg to skin or sole: half a hand, or the height of an ankle's front."""


@pytest.fixture(scope="module")
def rider() -> BuiltAsset:
    return MOTORCYCLISTS[0].build()


def points_of(asset: BuiltAsset, *names: str) -> NDArray[np.float64]:
    return np.concatenate([part.shape.vertices_m for part in asset.parts if part.name.startswith(names)])


def place(asset: BuiltAsset, name: str) -> NDArray[np.float64]:
    return np.array([float(asset.attributes[f"{name}_{axis}_m"]) for axis in "xyz"])


def test_hands_feet_and_hips_touch_the_machine(rider: BuiltAsset) -> None:
    for parts, names in ((("skin",), ("grip_left", "grip_right")), (("shoes", "sole"), ("peg_left", "peg_right"))):
        tree = cKDTree(points_of(rider, *parts))
        for name in names:
            assert tree.query(place(rider, name))[0] < REACH_M, name
    trousers = points_of(rider, "trousers", "bottom")
    saddle = place(rider, "saddle")
    between = trousers[(np.abs(trousers[:, 0] - saddle[0]) < 0.12) & (np.abs(trousers[:, 1]) < 0.025)]
    assert abs(between[:, 2].min() - saddle[2]) < 0.07


def test_a_helmet_with_a_dark_visor_sits_where_the_eyes_are(rider: BuiltAsset) -> None:
    visor = points_of(rider, "helmet_visor")
    eye_m = float(rider.attributes["eye_height_m"])
    assert visor[:, 2].min() < eye_m < visor[:, 2].max()
    helmet = points_of(rider, "helmet")
    assert 0.22 < np.ptp(helmet[:, 1]) < 0.32
    assert not any(part.name == "hair" for part in rider.parts)


def test_a_ridden_machine_keeps_its_lamps_and_has_no_stand_down(rider: BuiltAsset) -> None:
    names = {part.name for part in rider.parts}
    assert {"headlight", "taillight", "brakelight", "indicator_front_left"} <= names
    assert "stand" not in names
    assert rider.asset_class == "motorcycle"
    assert "ridden" in rider.tags
