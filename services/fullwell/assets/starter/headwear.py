"""Hair and hats, cut to a head."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fullwell.assets.starter.bodies import Body
from fullwell.assets.starter.building import BuiltPart
from fullwell.assets.starter.clothing import folds_of, wrinkled
from fullwell.assets.starter.implicit import Clipped, Cut, Limb, Solid, ball, blob, mesh, ruffled
from fullwell.assets.starter.shapes import Shape, joined, revolution, tube

__all__ = ["headwear"]

Array = NDArray[np.float64]


def headwear(body: Body, style: str, colour: str, rng: np.random.Generator) -> list[BuiltPart]:
    """Return hair or a hat in one colour of the catalogue.

    `style` is "crop", "short", "bob", "long", "ponytail", "bun", "curly" or "fringe" (bald on top); or "beanie", "cap",
    "sun_hat", "helmet" or "headscarf".
    """
    if style in _HATS:
        return _HATS[style](body, colour, rng)
    return [BuiltPart("hair", _hair(body, style, rng), colour)]


def _hair(body: Body, style: str, rng: np.random.Generator) -> Shape:
    unit, turn, at = body.head_unit(), body.frame("head"), body.head_point
    thick = {"crop": 0.004, "short": 0.010, "fringe": 0.006, "curly": 0.030}.get(style, 0.012)
    cap = blob(at(-0.008, 0, 0.150), (np.array([0.099, 0.077, 0.086]) + thick) * unit, turn)
    solids: list[Solid] = [cap]
    nape = blob(at(-0.050, 0, 0.095), (np.array([0.044, 0.060, 0.055]) + 0.5 * thick) * unit, turn)
    solids.append(nape)
    long: list[Solid] = []

    def lock(start: tuple[float, ...], end: tuple[float, ...], wide: tuple[float, ...], deep: tuple[float, ...]) -> Limb:
        at_stations = tuple(np.linspace(0, 1, len(wide)))
        return Limb(at(*start), at(*end), turn[:, 0], at_stations, _scaled(wide, unit), _scaled(deep, unit))

    if style in ("bob", "long"):
        low = 0.02 if style == "bob" else -0.12
        long.append(
            lock(
                (-0.045, 0, 0.13), (-0.070 if style == "bob" else -0.095, 0, low), (0.082, 0.086, 0.078), (0.055, 0.040, 0.028)
            )
        )
        for s in (1.0, -1.0):
            long.append(
                lock((-0.010, s * 0.070, 0.15), (-0.012, s * 0.080, low + 0.03), (0.022, 0.022, 0.018), (0.045, 0.042, 0.026))
            )
    if style == "ponytail":
        long.append(lock((-0.095, 0, 0.165), (-0.150, 0, 0.02), (0.020, 0.030, 0.028, 0.010), (0.020, 0.028, 0.026, 0.010)))
    if style == "bun":
        long.append(ball(at(-0.105, 0, 0.185), 0.038 * unit))
    face = [
        blob(at(0.105, 0, 0.080), np.array([0.092, 0.100, 0.108 if style != "fringe" else 0.15]) * unit, turn),
        blob(at(0.035, 0, 0.060), np.array([0.050, 0.110, 0.085]) * unit, turn),
    ]
    cuts = [Cut(at(-0.05, 0, 0.050), turn @ np.array([0.35, 0.0, -1.0]))]
    if style in ("bob", "long"):
        face = [blob(at(0.105, 0, 0.075), np.array([0.088, 0.070, 0.112]) * unit, turn)]
        cuts = []
    if style == "fringe":  # bald on top
        face.append(blob(at(0.02, 0, 0.225), np.array([0.105, 0.066, 0.055]) * unit, turn))
    shape = mesh([[*solids, *long]], cell_m=0.0088 * unit, blend_m=0.02, carved=face, carve_blend_m=0.012, cuts=cuts)
    local = (shape.vertices_m - at(0, 0, 0.14)) @ turn / unit
    if style == "curly":
        bumps = np.prod([np.sin(local[:, k] * 260 + rng.uniform(0, 6)) for k in range(3)], axis=0)
        return ruffled(shape, 0.007 * bumps)
    comb = np.sin(90 * np.arctan2(local[:, 1], local[:, 2] + 0.02) * 0.35 + 6 * np.sin(18 * local[:, 0] + rng.uniform(0, 6)))
    return ruffled(shape, 0.0009 * comb)


def _beanie(body: Body, colour: str, rng: np.random.Generator) -> list[BuiltPart]:
    unit, turn, at = body.head_unit(), body.frame("head"), body.head_point
    cap = blob(at(-0.010, 0, 0.155), np.array([0.113, 0.092, 0.100]) * unit, turn)
    down = turn @ np.array([0.25, 0.0, -1.0])
    dome = Clipped(cap, (Cut(at(0.0, 0, 0.135), down),))
    brim = Clipped(cap.grown(0.007), (Cut(at(0.0, 0, 0.128), down), Cut(at(0.0, 0, 0.170), -down)))
    shape = mesh([[dome, brim]], cell_m=0.0075, blend_m=0.006)
    ribs = 0.0012 * np.sin(60 * np.arctan2(*((shape.vertices_m - at(0, 0, 0.15)) @ turn).T[1::-1]))
    return [BuiltPart("hat", ruffled(shape, ribs), colour), BuiltPart("hair", _hair(body, "crop", rng), "hair/brown")]


def _cap(body: Body, colour: str, rng: np.random.Generator) -> list[BuiltPart]:
    unit, turn, at = body.head_unit(), body.frame("head"), body.head_point
    dome = Clipped(
        blob(at(-0.006, 0, 0.158), np.array([0.110, 0.089, 0.090]) * unit, turn), (Cut(at(0, 0, 0.160), -turn[:, 2]),)
    )
    peak = Limb(
        at(0.065, 0, 0.166),
        at(0.165, 0, 0.150),
        turn[:, 2],
        (0, 0.6, 1),
        _scaled((0.075, 0.075, 0.050), unit),
        (0.006,) * 3,
        cap_m=0.015,
    )
    shape = mesh([[dome, peak]], cell_m=0.0062, blend_m=0.008)
    return [BuiltPart("hat", shape, colour), BuiltPart("hair", _hair(body, "short", rng), "hair/brown")]


def _sun_hat(body: Body, colour: str, rng: np.random.Generator) -> list[BuiltPart]:
    unit, turn, at = body.head_unit(), body.frame("head"), body.head_point
    profile = [(0.0, 0.118), (0.06, 0.112), (0.088, 0.085), (0.100, 0.030), (0.118, 0.018), (0.185, 0.0)]
    profile = [(0.185, -0.004), *profile[::-1]]
    crown = revolution(profile, sides=32, crease_deg=60).scaled(unit).transformed(turn @ _tilt(8)).moved(*at(-0.006, 0, 0.150))
    return [BuiltPart("hat", crown, colour), BuiltPart("hair", _hair(body, "bob", rng), "hair/grey")]


def _helmet(body: Body, colour: str, rng: np.random.Generator) -> list[BuiltPart]:
    unit, turn, at = body.head_unit(), body.frame("head"), body.head_point
    shell = blob(at(-0.008, 0, 0.168), np.array([0.140, 0.105, 0.100]) * unit, turn)
    vents = [
        Limb(
            at(0.115, y, 0.235),
            at(-0.12, 0.8 * y, 0.245),
            turn[:, 2],
            (0, 0.5, 1),
            _scaled((0.008, 0.013, 0.006), unit),
            _scaled((0.03, 0.024, 0.03), unit),
        )
        for y in (-0.055, 0.0, 0.055)
    ]
    inner = blob(at(-0.008, 0, 0.150), np.array([0.112, 0.090, 0.096]) * unit, turn)
    low = Cut(at(0.0, 0, 0.158), turn @ np.array([0.12, 0, -1.0]))
    shape = mesh([[shell]], cell_m=0.0062, blend_m=0.0, carved=[*vents, inner], carve_blend_m=0.006, cuts=[low])
    straps = []
    for s in (1.0, -1.0):
        path = [at(0.03, s * 0.088, 0.165), at(0.024, s * 0.078, 0.09), at(0.045, s * 0.045, 0.012), at(0.058, 0.0, -0.004)]
        straps.append(tube(np.array(path), 0.005, sides=6))
    return [
        BuiltPart("helmet", shape, colour),
        BuiltPart("helmet_strap", joined(straps), "cloth/black"),
        BuiltPart("hair", _hair(body, "crop", rng), "hair/brown"),
    ]


def _headscarf(body: Body, colour: str, rng: np.random.Generator) -> list[BuiltPart]:
    unit, turn, at = body.head_unit(), body.frame("head"), body.head_point
    chest, k = body.frame("chest"), body.scale
    hood = blob(at(-0.008, 0, 0.135), np.array([0.116, 0.096, 0.110]) * unit, turn)
    throat = Limb(
        at(0.0, 0, 0.09),
        body.place("neck", "chest", (0.01 * k, 0, -0.01 * k)),
        turn[:, 0],
        (0, 0.5, 1),
        _scaled((0.088, 0.082, 0.100), unit),
        _scaled((0.085, 0.080, 0.095), unit),
    )
    cape = blob(body.place("neck", "chest", (0.01 * k, 0, -0.035 * k)), np.array([0.135, 0.165, 0.075]) * k, chest)
    face = blob(at(0.115, 0, 0.090), np.array([0.075, 0.056, 0.086]) * unit, turn)
    shape = mesh([[hood, throat, cape]], cell_m=0.0085, blend_m=0.05, carved=[face], carve_blend_m=0.012)
    return [BuiltPart("headscarf", wrinkled(shape, folds_of(rng, 0.004, upright=0.4)), colour)]


_HATS: Final[dict[str, Callable[[Body, str, np.random.Generator], list[BuiltPart]]]] = {
    "beanie": _beanie,
    "cap": _cap,
    "sun_hat": _sun_hat,
    "helmet": _helmet,
    "headscarf": _headscarf,
}


def _tilt(angle_deg: float) -> Array:
    cosine, sine = np.cos(np.deg2rad(angle_deg)), np.sin(np.deg2rad(angle_deg))
    return np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])


def _scaled(values: Sequence[float], factor: float) -> tuple[float, ...]:
    return tuple(float(value) * factor for value in values)
