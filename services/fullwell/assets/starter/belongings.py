"""Things that people carry or push."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from fullwell.assets.starter.bodies import SIDES, Body
from fullwell.assets.starter.building import BuiltPart
from fullwell.assets.starter.clothing import SOLE_M
from fullwell.assets.starter.implicit import Cut, Limb, blob, mesh
from fullwell.assets.starter.shapes import Shape, box, cylinder, joined, loft, revolution, tube

__all__ = ["belongings"]

Array = NDArray[np.float64]


def belongings(body: Body, what: str, colour: str) -> list[BuiltPart]:
    """Return a thing somebody carries: "backpack", "handbag", "shopping_bag", "phone", "cane", "umbrella" or "pram"."""
    return _BELONGINGS[what](body, colour)


def _backpack(body: Body, colour: str) -> list[BuiltPart]:
    k, chest = body.scale, body.frame("chest")

    def at(x: float, y: float, z: float) -> Array:
        return body.place("waist", "chest", (x * k, y * k, z * k))

    sack = Limb(
        at(-0.215, 0, 0.32),
        at(-0.225, 0, 0.02),
        chest[:, 0],
        (0, 0.3, 0.8, 1),
        _scaled((0.115, 0.140, 0.145, 0.135), k),
        _scaled((0.055, 0.080, 0.095, 0.085), k),
        cap_m=0.05 * k,
    )
    pocket = Limb(
        at(-0.315, 0, 0.16),
        at(-0.325, 0, 0.04),
        chest[:, 0],
        (0, 1),
        _scaled((0.095, 0.105), k),
        _scaled((0.025, 0.035), k),
        cap_m=0.03 * k,
    )
    straps = []
    for s in (1.0, -1.0):
        points = [
            (-0.15, 0.075, 0.335),
            (-0.07, 0.090, 0.375),
            (0.02, 0.098, 0.355),
            (0.105, 0.108, 0.28),
            (0.140, 0.120, 0.18),
            (0.115, 0.150, 0.08),
            (0.0, 0.178, 0.03),
            (-0.14, 0.13, 0.02),
        ]
        straps.append(_strap(np.array([at(x, s * y, z) for x, y, z in points]), 0.018 * k))
    bag = mesh([[sack, pocket]], cell_m=0.0125, blend_m=0.02)
    return [BuiltPart("bag", bag, colour), BuiltPart("bag_straps", joined(straps), "cloth/black")]


def _handbag(body: Body, colour: str) -> list[BuiltPart]:
    k, pelvis = body.scale, body.frame("pelvis")
    shoulder = body.joint("shoulder_right") + body.frame("chest") @ np.array([0.0, 0.045, 0.062]) * k
    middle = body.place("hips", "pelvis", (0.05 * k, -0.245 * k, 0.04 * k))
    sack = Limb(
        middle + pelvis[:, 2] * 0.085 * k,
        middle - pelvis[:, 2] * 0.075 * k,
        pelvis[:, 0],
        (0, 0.6, 1),
        _scaled((0.035, 0.052, 0.050), k),
        _scaled((0.125, 0.135, 0.138), k),
        cap_m=0.022 * k,
    )
    front = np.array(
        [shoulder, shoulder + np.array([0.085, 0.012, -0.12]) * k, middle + pelvis @ np.array([0.10, 0.012, 0.10]) * k]
    )
    back = np.array(
        [shoulder, shoulder + np.array([-0.085, 0.0, -0.12]) * k, middle + pelvis @ np.array([-0.10, 0.012, 0.10]) * k]
    )
    straps = joined([_strap(front, 0.010 * k), _strap(back, 0.010 * k)])
    return [BuiltPart("bag", mesh([[sack]], cell_m=0.010, blend_m=0.0), colour), BuiltPart("bag_straps", straps, colour)]


def _shopping_bag(body: Body, colour: str) -> list[BuiltPart]:
    k = body.scale
    grip = body.joint("grip_left") + np.array([0.0, 0.0, -0.01])
    top, low = grip - np.array([0.0, 0.0, 0.16]), grip - np.array([0.0, 0.0, 0.46 * min(k, 1.0)])
    sack = Limb(
        top,
        low,
        np.array([1.0, 0.0, 0.0]),
        (0, 0.5, 1),
        (0.045, 0.065, 0.075),
        (0.15, 0.165, 0.16),
        flat_start=True,
        cap_m=0.02,
    )
    handles = [
        tube(
            np.array(
                [
                    top + [x, s * 0.03, -0.01],
                    grip + [0.35 * x, s * 0.012, -0.03],
                    grip,
                    grip + [-0.35 * x, s * 0.012, -0.03],
                    top + [-x, s * 0.03, -0.01],
                ]
            ),
            0.005,
            sides=6,
        )
        for s in (1.0, -1.0)
        for x in (0.08,)
    ]
    return [
        BuiltPart("bag", mesh([[sack]], cell_m=0.0125, blend_m=0.0), colour),
        BuiltPart("bag_straps", joined(handles), colour),
    ]


def _phone(body: Body, colour: str) -> list[BuiltPart]:
    hand = body.frame("hand_right")
    middle = body.joint("wrist_right") + hand @ np.array([0.0, 0.030, -0.115])
    # Long side across the fingers, screen towards the face.
    face = body.head_point(0.08, 0.0, 0.11) - middle
    normal = face / np.linalg.norm(face)
    across = np.cross(np.array([0.0, 0.0, 1.0]), normal)
    across = across / np.linalg.norm(across)
    turn = np.stack([across, np.cross(normal, across), normal], axis=1)
    return [BuiltPart("phone", box((0.073, 0.150, 0.009)).transformed(turn).moved(*middle), colour)]


def _cane(body: Body, colour: str) -> list[BuiltPart]:
    grip = body.joint("grip_right")
    foot = np.array([grip[0] + 0.08, grip[1] - 0.02, _floor(body) + 0.004])
    handle = np.array([grip + [-0.055, 0, 0.012], grip + [0.0, 0, 0.018], grip + [0.035, 0, 0.012], grip + [0.05, 0, -0.02]])
    shaft = np.array([grip + [0.05, 0, -0.02], 0.5 * (grip + foot) + [0.02, 0, 0], foot])
    parts = joined([tube(handle, 0.012, sides=10), tube(shaft, 0.010, sides=10)])
    tip = tube(np.array([foot + (grip - foot) * 0.04, foot]), 0.015, sides=10)
    return [BuiltPart("cane", parts, colour), BuiltPart("cane_tip", tip, "rubber/tyre")]


def _umbrella(body: Body, colour: str) -> list[BuiltPart]:
    grip = body.joint("grip_right")
    top = grip + np.array([-0.02, 0.07, 0.70])
    shaft = tube(np.array([grip - (top - grip) * 0.16, grip, top]), 0.006, sides=8)
    handle = tube(np.array([grip - (top - grip) * 0.16, grip + (top - grip) * 0.02]), 0.012, sides=8)
    axis = (top - grip) / np.linalg.norm(top - grip)
    side = np.cross(axis, [1.0, 0.0, 0.0])
    side = side / np.linalg.norm(side)
    turn = np.stack([np.cross(side, axis), side, axis], axis=1)
    rib = np.arange(16) * np.pi / 8
    # Between ribs the cloth hangs in.
    slack = np.where(np.arange(16) % 2 == 0, 1.0, 0.955)
    rings = []
    for t in (0.02, 0.25, 0.5, 0.75, 1.0):
        radius, fall = 0.48 * np.sin(t * 1.15) / np.sin(1.15), 0.26 * (1 - np.cos(t * 1.15)) / (1 - np.cos(1.15))
        rings.append(np.stack([radius * slack**t * np.cos(rib), radius * slack**t * np.sin(rib), np.full(16, -fall)], axis=1))
    outer = np.array(rings)
    skin = np.concatenate([outer[::-1] - [0, 0, 0.004], outer[1:][::-1][::-1]])[::-1]
    return [
        BuiltPart("umbrella", _skin_of(skin).transformed(turn).moved(*(top - 0.02 * axis)), colour),
        BuiltPart("umbrella_shaft", shaft, "metal/aluminium"),
        BuiltPart("umbrella_handle", handle, "plastic/black"),
    ]


def _skin_of(rings: Array) -> Shape:
    """Close a canopy of rings: from the rim over the top, and back underneath."""
    return loft(rings, caps=False).smooth(30.0)


def _pram(body: Body, colour: str) -> list[BuiltPart]:
    grips = 0.5 * (body.joint("grip_left") + body.joint("grip_right"))
    x, z0 = grips[0], _floor(body)
    high = grips[2] - z0
    frame, wheels, hubs = [], [], []
    for y in (0.22, -0.22):
        frame.append(tube(np.array([[x, y, high], [x + 0.10, y, high - 0.06], [x + 0.62, y, 0.22]]), 0.012, sides=8))
        frame.append(tube(np.array([[x + 0.06, y, 0.16], [x + 0.38, y, 0.52]]), 0.012, sides=8))
        for wheel_x, radius in ((x + 0.06, 0.14), (x + 0.64, 0.11)):
            wheels.append(_wheel(radius).moved(wheel_x, y * 1.08, radius))
            hubs.append(cylinder(radius * 0.72, 0.018, sides=20, axis="y").moved(wheel_x, y * 1.08, radius))
    bar = tube(np.array([[x, -0.22, high], [x - 0.005, 0.0, high], [x, 0.22, high]]), 0.016, sides=8)
    axles = [
        tube(np.array([[wheel_x, -0.23, r], [wheel_x, 0.23, r]]), 0.010, sides=8)
        for wheel_x, r in ((x + 0.06, 0.14), (x + 0.64, 0.11))
    ]
    tub = Limb(
        np.array([x + 0.12, 0, 0.60]),
        np.array([x + 0.62, 0, 0.60]),
        np.array([0, 0, 1.0]),
        (0, 0.5, 1),
        (0.17, 0.19, 0.165),
        (0.13, 0.13, 0.12),
        cap_m=0.07,
    )
    inside = Limb(
        np.array([x + 0.12, 0, 0.68]),
        np.array([x + 0.62, 0, 0.68]),
        np.array([0, 0, 1.0]),
        (0, 0.5, 1),
        (0.14, 0.16, 0.14),
        (0.12, 0.12, 0.11),
        cap_m=0.05,
    )
    flat = Cut(np.array([0, 0, 0.68]), np.array([0, 0, 1.0]))
    bed = mesh([[tub]], cell_m=0.014, blend_m=0.0, carved=[inside], cuts=[flat])
    hood_solid = blob([x + 0.24, 0, 0.69], (0.22, 0.185, 0.24))
    hood = mesh(
        [[hood_solid]],
        cell_m=0.014,
        blend_m=0.0,
        carved=[hood_solid.grown(-0.028)],
        cuts=[
            Cut(np.array([0, 0, 0.66]), np.array([0, 0, -1.0])),
            Cut(np.array([x + 0.26, 0, 0.69]), np.array([1.0, 0, -0.35])),
        ],
    )
    blanket = mesh([[blob([x + 0.42, 0, 0.645], (0.20, 0.14, 0.05))]], cell_m=0.014, blend_m=0.0)
    lift = np.array([0.0, 0.0, z0])
    made = (
        ("pram_body", [bed, hood], colour),
        ("pram_blanket", [blanket], "cloth/white"),
        ("pram_frame", [*frame, bar, *axles], "metal/aluminium"),
        ("pram_wheels", wheels, "rubber/tyre"),
        ("pram_hubs", hubs, "plastic/grey"),
    )
    return [BuiltPart(name, joined(shapes).moved(*lift), material) for name, shapes, material in made]


def _wheel(radius_m: float) -> Shape:
    section = np.linspace(0, 2 * np.pi, 9)
    profile = np.column_stack([radius_m - 0.018 + 0.018 * np.cos(section - np.pi / 2), 0.018 * np.sin(section - np.pi / 2)])
    return revolution(profile, sides=28, crease_deg=70).turned("x", 90)


_BELONGINGS: Final[dict[str, Callable[[Body, str], list[BuiltPart]]]] = {
    "backpack": _backpack,
    "handbag": _handbag,
    "shopping_bag": _shopping_bag,
    "phone": _phone,
    "cane": _cane,
    "umbrella": _umbrella,
    "pram": _pram,
}


def _floor(body: Body) -> float:
    """Height of the lowest sole, where the ground will be."""
    lows = []
    for side in SIDES:
        drop, k = body.lengths["ankle_height"], body.lengths["foot"] / 0.266
        for joint, frame, x, down in (
            ("ankle", "foot", -0.20, drop),
            ("ankle", "foot", 0.46, drop),
            ("ball", "toes", 0.20, 0.4 * drop),
        ):
            offset = (x * body.lengths["foot"], 0.0, -down - SOLE_M * k)
            lows.append(body.place(f"{joint}_{side}", f"{frame}_{side}", offset)[2])
    return float(min(lows))


def _strap(path_m: Array, half_width_m: float) -> Shape:
    knots = np.arange(len(path_m))
    fine = CubicSpline(knots, path_m)(np.linspace(0, len(path_m) - 1, 6 * len(path_m)))
    return tube(fine, half_width_m * 0.6, sides=8)


def _scaled(values: Sequence[float], factor: float) -> tuple[float, ...]:
    return tuple(float(value) * factor for value in values)
