"""People on motorcycles: hips on the seat, hands on the grips, feet on the pegs, in full-face helmets."""

from __future__ import annotations

from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from fullwell.assets.starter.belongings import belongings
from fullwell.assets.starter.bodies import Body, Build
from fullwell.assets.starter.building import BuiltAsset, BuiltPart, StarterEntry
from fullwell.assets.starter.clothing import Outfit, dressed
from fullwell.assets.starter.implicit import Cut, blob, mesh
from fullwell.assets.starter.people import settled
from fullwell.assets.starter.riding import Contacts, seated
from fullwell.assets.starter.two_wheelers import motorcycle

__all__ = ["MOTORCYCLISTS", "motorcyclist"]


def motorcyclist(
    rng: np.random.Generator,
    *,
    stature_m: float,
    sex: Literal["f", "m"],
    kind: str,
    paint: str,
    skin: str,
    helmet: str,
    outfit: dict[str, Any],
    carries: str = "",
    carries_colour: str = "cloth/black",
    look_deg: float = 0.0,
    tags: tuple[str, ...] = (),
) -> BuiltAsset:
    """Return a motorcycle with its rider, of class "motorcycle" with the tag "ridden"; the machine's parts keep their names.

    Parameters
    ----------
    kind, paint
        As for `two_wheelers.motorcycle`.
    helmet
        Material of its shell.
    outfit
        Fields of `Outfit`.
    carries
        "backpack" or nothing.

    Others as for `people.pedestrian`.
    """
    machine = motorcycle(rng, kind=kind, paint=paint)
    parts = [part for part in machine.parts if part.name != "stand"]
    contacts = Contacts(
        _place(machine, "saddle"),
        (_place(machine, "grip_left"), _place(machine, "grip_right")),
        (_place(machine, "peg_left"), _place(machine, "peg_right")),
    )
    body = Body(
        Build(stature_m, sex, False), seated(Build(stature_m, sex, False), contacts, look_deg=look_deg, toes_down_deg=4.0)
    )
    rider = dressed(body, Outfit(**outfit), (f"skin/{skin}", "hair/brown"), (72.0, 72.0), rng)
    rider += _full_face_helmet(body, helmet)
    if carries:
        rider += belongings(body, carries, carries_colour)
    eye = float(body.head_point(0.09, 0.0, 0.1125)[2])
    numbers: dict[str, float | str] = {**machine.attributes, "stature_m": stature_m}
    who = {"f": "woman", "m": "man"}[sex]
    return settled("motorcycle", ("ridden", kind, who, *tags), [*rider, *parts], numbers, eye_m=eye)


def _place(machine: BuiltAsset, name: str) -> NDArray[np.float64]:
    return np.array([float(machine.attributes[f"{name}_{axis}_m"]) for axis in "xyz"])


def _full_face_helmet(body: Body, colour: str) -> list[BuiltPart]:
    """A shell of 3.5 cm around the head with a chin bar, 26 cm wide, and a dark visor before the eyes."""
    unit, turn, at = body.head_unit(), body.frame("head"), body.head_point
    size = np.array([0.148, 0.127, 0.143]) * unit
    middle = at(0.004, 0.0, 0.118)
    chin = blob(at(0.055, 0.0, 0.048), np.array([0.100, 0.088, 0.058]) * unit, turn)
    rim = Cut(at(0.0, 0.0, 0.0), turn @ np.array([0.15, 0.0, -1.0]))
    shell = mesh([[blob(middle, size, turn), chin]], cell_m=0.0065, blend_m=0.03, cuts=[rim])
    slices = [
        Cut(at(0.0, 0.0, 0.172), turn @ np.array([0.0, 0.0, 1.0])),
        Cut(at(0.0, 0.0, 0.088), turn @ np.array([0.0, 0.0, -1.0])),
        Cut(at(0.030, 0.0, 0.0), turn @ np.array([-1.0, 0.0, 0.0])),
    ]
    visor = mesh([[blob(middle, size + 0.003, turn)]], cell_m=0.0065, blend_m=0.0, cuts=slices)
    return [BuiltPart("helmet", shell, colour), BuiltPart("helmet_visor", visor, "paint/black")]


def _entry(name: str, title: str, seed: int, **parameters: object) -> StarterEntry:
    return StarterEntry(name, title, motorcyclist, parameters, seed)


_LEATHERS: Final = {
    "top": "jacket",
    "top_colour": "leather/black",
    "bottom": "slim",
    "bottom_colour": "leather/black",
    "shoes": "boots",
    "shoes_colour": "leather/black",
}

MOTORCYCLISTS: Final = (
    _entry(
        "motorcyclist-01",
        "Man on a naked motorcycle, black leathers",
        151,
        stature_m=1.79,
        sex="m",
        kind="naked",
        paint="paint/blue",
        skin="light",
        helmet="paint/white",
        outfit=_LEATHERS,
    ),
    _entry(
        "motorcyclist-02",
        "Woman on a touring motorcycle, hi-vis vest",
        152,
        stature_m=1.70,
        sex="f",
        kind="tourer",
        paint="paint/silver",
        skin="medium",
        helmet="paint/red",
        outfit=_LEATHERS | {"top_colour": "cloth/grey", "bottom_colour": "cloth/black", "vest": "cloth/hi_vis_yellow"},
    ),
    _entry(
        "motorcyclist-03",
        "Courier on a scooter with a backpack",
        153,
        stature_m=1.74,
        sex="m",
        kind="scooter",
        paint="paint/red",
        skin="dark",
        helmet="paint/grey",
        carries="backpack",
        carries_colour="cloth/hi_vis_orange",
        outfit={
            "top": "jacket",
            "top_colour": "cloth/navy",
            "bottom": "straight",
            "bottom_colour": "cloth/denim",
            "shoes": "trainers",
            "shoes_colour": "cloth/black",
            "sole_colour": "plastic/white",
        },
        tags=("courier",),
    ),
)
"""Motorcyclists of the starter library."""
