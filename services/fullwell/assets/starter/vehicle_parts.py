"""Parts of a vehicle under construction: names, materials, and left halves that become wholes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fullwell.assets.starter.building import BuiltAsset, BuiltPart
from fullwell.assets.starter.lofts import Panels, both_sides
from fullwell.assets.starter.shapes import Shape, joined
from fullwell.assets.starter.wheels import WheelParts

__all__ = ["LAMP_MATERIALS", "PartList"]

LAMP_MATERIALS = {
    "headlight": "lamp/headlight_led",
    "drl": "lamp/daytime_running",
    "taillight": "lamp/tail",
    "brakelight": "lamp/brake",
    "indicator_front": "lamp/indicator",
    "indicator_rear": "lamp/indicator",
    "reverselight": "lamp/reverse",
}
"""Material of a lit part by the beginning of its name."""


@dataclass(slots=True)
class PartList:
    """Named shapes with materials; a name that comes again is joined to what it holds."""

    shapes: dict[str, list[Shape]] = field(default_factory=dict)
    materials: dict[str, str] = field(default_factory=dict)
    paintable: set[str] = field(default_factory=set)

    def add(self, name: str, material: str, *shapes: Shape | None, paintable: bool = False) -> None:
        """Add shapes to a part."""
        if self.materials.setdefault(name, material) != material:
            raise ValueError(f"part {name!r} is of {self.materials[name]!r}; it cannot be of {material!r} as well")
        self.shapes.setdefault(name, []).extend(shape for shape in shapes if shape is not None and len(shape.faces))
        if paintable:
            self.paintable.add(name)

    def add_both(self, name: str, material: str, *halves: Shape | None, paintable: bool = False) -> None:
        """Add left halves and their mirror images to one part."""
        self.add(name, material, *(both_sides(half) for half in halves if half is not None), paintable=paintable)

    def add_pair(self, name: str, material: str, *halves: Shape | None) -> None:
        """Add left halves to `name`_left and their mirror images to `name`_right."""
        for half in halves:
            if half is not None:
                self.add(f"{name}_left", material, half)
                self.add(f"{name}_right", material, half.mirrored())

    def add_wheel(self, place: str, wheel: WheelParts, *, rim_material: str = "metal/rim_alloy") -> None:
        """Add a left wheel and its mirror image: tyre_`place`_left, rim_..., and what is behind in `brakes`."""
        self.add_pair(f"tyre_{place}", "rubber/tyre", wheel.tyre)
        self.add_pair(f"rim_{place}", rim_material, wheel.rim)
        self.add_both("brakes", "metal/cast_iron", wheel.brake)

    def add_panels(
        self, panels: Panels, materials: Mapping[str, str], pairs: tuple[str, ...], paintable: tuple[str, ...]
    ) -> None:
        """Add all panels of a left half: lamps and what `pairs` names as left and right parts, the rest as wholes."""
        for name in panels.names():
            half = panels.left(name)
            if name in LAMP_MATERIALS:
                self.add_pair(name, materials.get(name, LAMP_MATERIALS[name]), half)
            elif name in pairs:
                self.add_pair(name, materials[name], half)
            else:
                self.add_both(name, materials[name], half, paintable=name in paintable)

    def built(
        self, asset_class: str, tags: tuple[str, ...], attributes: Mapping[str, float | str], *, shift_x_m: float = 0.0
    ) -> BuiltAsset:
        """Return the asset, moved along x."""
        parts = tuple(
            BuiltPart(name, joined(shapes).moved(shift_x_m), self.materials[name], name in self.paintable)
            for name, shapes in self.shapes.items()
            if shapes
        )
        return BuiltAsset(asset_class, tags, parts, {key: _plain(value) for key, value in attributes.items()})


def _plain(value: float | str) -> float | str:
    return value if isinstance(value, str) else round(float(np.asarray(value)), 4)
