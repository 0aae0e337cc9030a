"""What generators of the starter library return, and how they are registered."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fullwell.assets.classes import asset_class
from fullwell.assets.starter.shapes import Shape

__all__ = ["BuiltAsset", "BuiltLevel", "BuiltPart", "StarterEntry"]


@dataclass(frozen=True, slots=True, eq=False)
class BuiltPart:
    """Triangles with one material of the catalogue. `paintable`: a recipe may give it another paint."""

    name: str
    shape: Shape
    material: str
    paintable: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class BuiltLevel:
    """A coarser level of detail. `grain_m` is half the size of the pieces that many small ones became."""

    parts: tuple[BuiltPart, ...]
    grain_m: float


@dataclass(frozen=True, slots=True, eq=False)
class BuiltAsset:
    """A generated thing: metres, z up, facing +x, standing on z = 0; preparing centres it over its pivot.

    Attributes
    ----------
    parts
        With unique names, by function: body, window_front, wheel_front_left, headlight_left, taillight_left, brakelight_left,
        indicator_front_left, plate_rear, ...
    attributes
        Numbers and words of its class: front_overhang_m, wheelbase_m, mast_height_m, ...
    coarser
        Levels of detail, finest first, where the generator makes them itself; their parts have names of `parts`, maybe fewer.
    """

    asset_class: str
    tags: tuple[str, ...]
    parts: tuple[BuiltPart, ...]
    attributes: Mapping[str, float | str] = field(default_factory=dict)
    coarser: tuple[BuiltLevel, ...] = ()

    def __post_init__(self) -> None:
        asset_class(self.asset_class)
        names = [part.name for part in self.parts]
        if len(set(names)) < len(names):
            raise ValueError(f"part names are not unique: {sorted({name for name in names if names.count(name) > 1})}")


@dataclass(frozen=True, slots=True)
class StarterEntry:
    """One asset of the starter library: a generator with its parameters. `seed` feeds the generator's own stream."""

    id: str
    title: str
    make: Callable[..., BuiltAsset]
    parameters: Mapping[str, Any] = field(default_factory=dict)
    seed: int = 0

    def build(self) -> BuiltAsset:
        """Return the asset; the same bytes each time."""
        return self.make(np.random.Generator(np.random.Philox(self.seed)), **self.parameters)
