"""Six scenes on which error against CPU time is measured: each a function that returns a recipe and writes its meshes."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmarks.scenes.car_park import car_park
from benchmarks.scenes.small import colorchecker, cornell_box, tabletop_glass
from benchmarks.scenes.street import street_day, street_night

if TYPE_CHECKING:
    from fullwell.schema.frame import FrameDescription

__all__ = ["DEFAULT_SIZE", "SCENES", "build_frame", "write_recipe"]

SceneFunction = Callable[[tuple[int, int], Path], dict[str, Any]]

DEFAULT_SIZE = (640, 480)
"""Columns and rows."""

SCENES: dict[str, SceneFunction] = {
    "cornell_box": cornell_box,
    "colorchecker": colorchecker,
    "tabletop_glass": tabletop_glass,
    "street_day": street_day,
    "street_night": street_night,
    "car_park": car_park,
}


def write_recipe(
    name: str, folder: Path, *, size: tuple[int, int] = DEFAULT_SIZE, samples_per_pixel: int | None = None
) -> Path:
    """Write a scene's meshes and its recipe.json into `folder` and return the recipe's path."""
    folder.mkdir(parents=True, exist_ok=True)
    document = SCENES[name](size, folder)
    if samples_per_pixel is not None:
        document["quality"]["samples_per_pixel"] = samples_per_pixel
    path = folder / "recipe.json"
    path.write_text(json.dumps(document))
    return path


def build_frame(name: str, folder: Path, *, size: tuple[int, int] = DEFAULT_SIZE) -> FrameDescription:
    """Return the scene's only frame, resolved; its meshes go to `folder`."""
    from fullwell.schema import RecipeBuilder, load_recipe  # noqa: PLC0415 - the list of scenes alone needs no schema

    return RecipeBuilder(load_recipe(write_recipe(name, folder, size=size))).frame(0)
