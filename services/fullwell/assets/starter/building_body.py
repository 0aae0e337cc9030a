"""The rectangular body that buildings begin with: four facades around the origin, and what all kinds of buildings share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Literal

import numpy as np

from fullwell.assets.starter.assembly import Assembly, boxes
from fullwell.assets.starter.building import BuiltAsset
from fullwell.assets.starter.facades import Facade, Opening, PaneLots, WindowLook, moulding
from fullwell.assets.starter.shapes import cylinder

__all__ = [
    "PARTY_SIDES",
    "SIDES",
    "STEP_M",
    "TURN_DEG",
    "Body",
    "Side",
    "bay_centres",
    "opening_at",
    "oriel",
    "plain_look",
    "rear",
]

Side = Literal["front", "left", "back", "right"]
SIDES: tuple[Side, ...] = ("front", "left", "back", "right")
PARTY_SIDES: tuple[Side, ...] = ("left", "right")
TURN_DEG: Mapping[Side, float] = MappingProxyType({"front": 0.0, "left": 90.0, "back": 180.0, "right": -90.0})
"""By how much a facade that faces +x is turned to become each side."""

STEP_M = 0.15
"""Ground floors of dwellings lie one step above the pavement."""


@dataclass(eq=False)
class Body:
    """A rectangular body under construction: four facades around the origin."""

    width_m: float
    depth_m: float
    look: WindowLook
    rng: np.random.Generator
    wall_material: str
    panes: PaneLots
    assembly: Assembly = field(default_factory=Assembly)

    def side(self, side: Side, look: WindowLook | None = None) -> Facade:
        """Return an empty facade of the length of a side."""
        width = self.width_m if side in ("front", "back") else self.depth_m
        return Facade(width, look or self.look, self.panes, self.rng, "walls", self.wall_material)

    def put(self, side: Side, facade: Facade) -> None:
        """Place a finished facade."""
        x = {"front": self.depth_m / 2, "back": -self.depth_m / 2}.get(side, 0.0)
        y = {"left": self.width_m / 2, "right": -self.width_m / 2}.get(side, 0.0)
        self.assembly.place(facade.assembly, turn_deg=TURN_DEG[side], x_m=x, y_m=y)

    def band(self, part: str, material: str, profile_m: Sequence[tuple[float, float]]) -> None:
        """Draw a moulding around the body."""
        self.assembly.add(part, material, moulding(self.width_m, self.depth_m, profile_m))

    def downpipes(self, top_m: float) -> None:
        """Draw a rain pipe near the end of both long sides."""
        for x, y in ((self.depth_m / 2 + 0.06, self.width_m / 2 - 0.25), (-self.depth_m / 2 - 0.06, -self.width_m / 2 + 0.25)):
            self.assembly.add("gutters", "metal/steel_galvanised", cylinder(0.045, top_m, sides=10).moved(x, y, top_m / 2))

    def finish(self, tags: tuple[str, ...], **attributes: float | str) -> BuiltAsset:
        """Return the building with what stands out of its street facade in its attributes."""
        parts = self.assembly.parts(paintable=("walls", "doors", "shutters", "garage_doors", "balcony_panels"))
        reach = max(float(part.shape.vertices_m[:, 0].max()) for part in parts)
        behind = max(float(-part.shape.vertices_m[:, 0].min()) for part in parts)
        facts: dict[str, float | str] = {
            "body_width_m": self.width_m,
            "body_depth_m": self.depth_m,
            "front_projection_m": round(reach - self.depth_m / 2, 3),
            "back_projection_m": round(behind - self.depth_m / 2, 3),
            **attributes,
        }
        return BuiltAsset("building", tags, parts, facts)


def bay_centres(width_m: float, pitch_m: float) -> list[float]:
    """Centres of equal bays of about the pitch, symmetric about the middle."""
    count = max(int(width_m / pitch_m), 1)
    return [float(y) for y in (np.arange(count) - (count - 1) / 2) * (width_m / count)]


def opening_at(centre_m: float, width_m: float, bottom_m: float, height_m: float) -> Opening:
    return Opening(centre_m - width_m / 2, centre_m + width_m / 2, bottom_m, bottom_m + height_m)


def plain_look(look: WindowLook) -> WindowLook:
    return replace(look, head="none", surround_m=0.0, shutters="none")


def rear(facade: Facade, floors: int, ground_m: float, storey_m: float, *, pitch_m: float, door: bool) -> None:
    """A side or back as landlords leave it: fewer, plainer windows, a service door."""
    bays = bay_centres(facade.width_m - 1.6, pitch_m) if facade.width_m > 4.5 else []
    gate = len(bays) // 2
    for floor in range(floors):
        low = 0.0 if floor == 0 else ground_m + (floor - 1) * storey_m
        tall = min(1.45, (ground_m if floor == 0 else storey_m) - 1.5)
        for number, y in enumerate(bays):
            if floor == 0 and door and number == gate:
                facade.door(opening_at(y, 1.1, STEP_M, 2.25), material="coating/grey", fanlight_m=0.0)
            elif floor > 0 or facade.rng.random() < 0.6:
                narrow = facade.rng.random() < 0.2 and not door
                facade.window(opening_at(y, 0.65 if narrow else 1.1, low + 1.0, tall))
    facade.close(0.0, ground_m + (floors - 1) * storey_m)


def oriel(face: Facade, wide: float, tall: float) -> None:
    half = wide / 2 + 0.09
    sides = boxes(
        [(-0.1, -half, -0.09), (-0.1, wide / 2, -0.09), (-0.1, -half - 0.06, tall), (-0.1, -half - 0.06, -0.16)],
        [(0.16, -wide / 2, tall), (0.16, half, tall), (0.24, half + 0.06, tall + 0.08), (0.2, half + 0.06, -0.09)],
    )
    face.assembly.add("oriels", "wood/painted_white", sides)
    part, material = face.panes.draw()
    bars = boxes([(0.0, -0.04, -0.09), (0.0, -wide / 2, tall - 0.06)], [(0.1, 0.04, tall), (0.095, wide / 2, tall)])
    face.assembly.add("window_frames", face.look.frame_material, bars)
    face.assembly.add(part, material, face.glass(np.array([[-wide / 2, 0, -0.09, tall], [0, wide / 2, -0.09, tall]]), 0.05))
