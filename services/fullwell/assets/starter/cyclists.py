"""People on bicycles: the rider's hips on the saddle, hands on the grips, feet on level pedals."""

from __future__ import annotations

from typing import Any, Final, Literal

import numpy as np

from fullwell.assets.starter.belongings import belongings
from fullwell.assets.starter.bodies import Body, Build
from fullwell.assets.starter.building import BuiltAsset, StarterEntry
from fullwell.assets.starter.clothing import Outfit, dressed
from fullwell.assets.starter.headwear import headwear
from fullwell.assets.starter.people import settled
from fullwell.assets.starter.riding import Contacts, seated
from fullwell.assets.starter.two_wheelers import BicycleKind, bicycle_shape

__all__ = ["CYCLISTS", "cyclist"]


def cyclist(
    rng: np.random.Generator,
    *,
    stature_m: float,
    sex: Literal["f", "m"],
    bicycle: BicycleKind,
    paint: str,
    skin: str,
    head: str,
    head_colour: str,
    outfit: dict[str, Any],
    child: bool = False,
    carries: str = "",
    carries_colour: str = "cloth/black",
    look_deg: float = 0.0,
    tags: tuple[str, ...] = (),
) -> BuiltAsset:
    """Return a rider on a bicycle.

    Parameters
    ----------
    bicycle, paint
        Kind of the bicycle, and its paint.
    outfit
        Fields of `Outfit`.
    carries
        "backpack" or nothing.

    Others as for `people.pedestrian`.
    """
    build = Build(stature_m, sex, child)
    machine = bicycle_shape(bicycle, paint=paint)
    grips, pedals = (tuple(np.array(place) for place in pair) for pair in (machine.grips_m, machine.pedals_m))
    contacts = Contacts(np.array(machine.saddle_m), (grips[0], grips[1]), (pedals[0], pedals[1]))
    body = Body(build, seated(build, contacts, look_deg=look_deg))
    brows = head_colour if head_colour.startswith("hair/") else "hair/brown"
    parts = dressed(body, Outfit(**outfit), (f"skin/{skin}", brows), (72.0, 72.0), rng)
    parts += headwear(body, head, head_colour, rng)
    if carries:
        parts += belongings(body, carries, carries_colour)
    parts += machine.parts
    eye = float(body.head_point(0.09, 0.0, 0.1125)[2])
    numbers: dict[str, float | str] = {"stature_m": stature_m, "bicycle": bicycle}
    who = ("child" if child else "adult", {"f": "woman", "m": "man"}[sex] if not child else {"f": "girl", "m": "boy"}[sex])
    return settled("cyclist", (*who, bicycle, *tags), parts, numbers, eye_m=eye)


def _entry(name: str, title: str, seed: int, **parameters: object) -> StarterEntry:
    return StarterEntry(name, title, cyclist, parameters, seed)


CYCLISTS: Final = (
    _entry(
        "cyclist-sport-01",
        "Man on a sports bicycle, sweater and helmet",
        141,
        stature_m=1.76,
        sex="m",
        bicycle="sport",
        paint="paint/black",
        skin="light",
        head="helmet",
        head_colour="plastic/white",
        outfit={"top": "sweater", "top_colour": "cloth/grey", "bottom": "slim", "bottom_colour": "cloth/denim"},
    ),
    _entry(
        "cyclist-city-01",
        "Woman on a city bicycle, yellow jacket",
        142,
        stature_m=1.67,
        sex="f",
        bicycle="city",
        paint="paint/red",
        skin="medium",
        head="ponytail",
        head_colour="hair/brown",
        look_deg=12.0,
        outfit={
            "top": "jacket",
            "top_colour": "cloth/hi_vis_yellow",
            "collar": True,
            "bottom": "slim",
            "bottom_colour": "cloth/black",
            "shoes": "trainers",
            "shoes_colour": "cloth/white",
            "sole_colour": "plastic/white",
        },
    ),
    _entry(
        "cyclist-mountain-01",
        "Courier on a mountain bicycle with a backpack",
        143,
        stature_m=1.78,
        sex="m",
        bicycle="mountain",
        paint="paint/blue",
        skin="dark",
        head="helmet",
        head_colour="plastic/red",
        carries="backpack",
        carries_colour="cloth/hi_vis_orange",
        outfit={
            "top": "tshirt",
            "top_colour": "cloth/navy",
            "bottom": "shorts",
            "bottom_colour": "cloth/black",
            "shoes": "trainers",
            "shoes_colour": "cloth/red",
            "sole_colour": "plastic/white",
        },
        tags=("courier",),
    ),
)
"""Cyclists of the starter library."""
