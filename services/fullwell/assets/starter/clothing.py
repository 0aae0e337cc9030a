"""Clothes cut to a body in its pose: each a closed surface a little outside of the flesh, smooth folds pressed in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fullwell.assets.starter.bodies import SIDES, Body, Side
from fullwell.assets.starter.building import BuiltPart
from fullwell.assets.starter.implicit import Blob, Clipped, Cut, Limb, Solid, blob, mesh, ruffled
from fullwell.assets.starter.shapes import Shape, joined

__all__ = ["SOLE_M", "Folds", "Outfit", "dressed", "folds_of", "wrinkled"]

Array = NDArray[np.float64]

SOLE_M: Final = 0.022
"""Thickness of an adult's soles [m]."""
_CELL_M: Final = 0.0150

_LEG_CUTS: Final = {
    # Growth over the flesh [m] at the stations of thigh and shank.
    "slim": ((0.007,) * 5, (0.007, 0.008, 0.007, 0.010, 0.016, 0.014)),
    "straight": ((0.012, 0.012, 0.014, 0.019, 0.022), (0.022, 0.027, 0.024, 0.031, 0.038, 0.036)),
    "wide": ((0.014, 0.018, 0.030, 0.044, 0.050), (0.050, 0.056, 0.056, 0.066, 0.076, 0.076)),
    "tights": ((0.003,) * 5, (0.003,) * 6),
}

_THICKNESS_M: Final = {"tshirt": 0.010, "shirt": 0.011, "sweater": 0.016, "jacket": 0.021, "coat": 0.024, "dress": 0.009}


@dataclass(frozen=True, slots=True)
class Outfit:
    """What somebody wears. Colours are catalogue names such as "cloth/navy".

    Attributes
    ----------
    top
        "tshirt", "shirt", "sweater", "jacket", "coat" or "dress" (which is top and skirt in one).
    bottom
        "slim", "straight", "wide", "tights", "shorts", "skirt" or "none" (under a dress, with bare legs).
    skirt_m
        Length of skirt, dress or coat below the hips, as a fraction of the leg.
    shoes
        "trainers", "shoes" or "boots".
    vest
        A vest of that colour over the top, or empty.
    collar, hood
        Of the top.
    """

    top: str
    top_colour: str
    bottom: str
    bottom_colour: str
    shoes: str = "shoes"
    shoes_colour: str = "leather/black"
    sole_colour: str = "rubber/tyre"
    skirt: float = 0.5
    vest: str = ""
    collar: bool = False
    hood: bool = False
    scarf: str = ""


def dressed(
    body: Body, outfit: Outfit, skin: tuple[str, str], curls_deg: tuple[float, float], rng: np.random.Generator
) -> list[BuiltPart]:
    """Return the parts of a dressed person without hair and belongings, feet wherever the skeleton has them.

    `skin` names the materials of skin and eyebrows, `curls_deg` is how far the fingers of either hand are bent.
    """
    parts = [_skin(body, outfit, skin[0], curls_deg)]
    parts += _face(body, skin[1])
    if outfit.top != "dress":
        parts += _bottom(body, outfit, rng)
    elif outfit.bottom == "tights":
        parts.append(BuiltPart("tights", _legs(body, "tights", 1.0, rng, 0.0), outfit.bottom_colour))
    folds = folds_of(rng, 0.003 if outfit.top in ("tshirt", "shirt", "dress") else 0.004, upright=0.5)
    parts.append(BuiltPart("top", _top(body, outfit, folds), outfit.top_colour))
    if outfit.top in ("jacket", "coat") or (outfit.top == "shirt" and outfit.collar):
        parts.append(
            BuiltPart("closure", _closure(body, outfit, folds), outfit.top_colour if outfit.top == "shirt" else "cloth/black")
        )
    if outfit.vest:
        parts += _vest(body, outfit.vest)
    if outfit.scarf:
        parts.append(BuiltPart("scarf", _scarf(body, rng), outfit.scarf))
    for side in SIDES:
        parts += _shoe(body, outfit, side)
    return parts


def _skin(body: Body, outfit: Outfit, skin: str, curls_deg: tuple[float, float]) -> BuiltPart:
    head, sockets = body.head()
    fine = 0.0074 * max(body.head_unit(), 0.9)
    shapes = [
        mesh(
            [[*head, body.neck()], body.ears()],
            cell_m=fine,
            blend_m=0.016,
            between_m=0.008,
            carved=sockets,
            carve_blend_m=0.012,
        )
    ]
    bare_arms = outfit.top == "tshirt" or (outfit.top == "dress" and not outfit.collar)
    for side, curl in zip(SIDES, curls_deg, strict=True):
        forearm, upper = body.forearm(side), body.upper_arm(side)
        arm = (
            [upper.upto(1.0, start=0.35, flat_end=False), forearm]
            if bare_arms
            else [forearm.upto(1.0, start=0.75, flat_end=False)]
        )
        hand = body.hand(side, curl)
        if bare_arms:
            shapes.append(mesh([arm], cell_m=0.011, blend_m=0.02))
            arm = [forearm.upto(1.0, start=0.8, flat_end=False)]
        shapes.append(mesh([[*hand[0], *arm], *hand[1:]], cell_m=0.0064, blend_m=0.012, between_m=0.0))
    if outfit.bottom in ("shorts", "skirt", "none"):
        shapes += [_bare_leg(body, outfit, side) for side in SIDES]
    return BuiltPart("skin", joined(shapes), skin)


def _bare_leg(body: Body, outfit: Outfit, side: Side) -> Shape:
    """The leg from somewhere under the hem downwards."""
    lengths = body.lengths
    hem = 0.35 if outfit.bottom == "shorts" else outfit.skirt * (lengths["thigh"] + lengths["shank"]) / lengths["thigh"] - 0.35
    bones: list[Solid] = [body.shank(side) if hem < 1.0 else body.shank(side).upto(1.0, start=hem - 1.0, flat_end=False)]
    if hem < 1.0:
        bones.append(body.thigh(side).upto(1.0, start=max(hem, 0.1), flat_end=False))
    return mesh([bones], cell_m=0.013, blend_m=0.025)


def _face(body: Body, brows: str) -> list[BuiltPart]:
    eyes = joined([mesh([[eye]], cell_m=0.0035, blend_m=0.0) for eye in body.eyes()])
    lines = joined([mesh([[brow]], cell_m=0.0035, blend_m=0.0) for brow in body.brows()])
    return [BuiltPart("eyes", eyes, "hair/black"), BuiltPart("brows", lines, brows)]


def _bottom(body: Body, outfit: Outfit, rng: np.random.Generator) -> list[BuiltPart]:
    if outfit.bottom == "skirt":
        return [BuiltPart("skirt", _skirt_shape(body, outfit.skirt, rng, loose_m=0.02), outfit.bottom_colour)]
    if outfit.bottom == "shorts":
        return [BuiltPart("shorts", _legs(body, "straight", 0.0, rng, 0.003), outfit.bottom_colour)]
    return [BuiltPart("trousers", _legs(body, outfit.bottom, 1.0, rng, 0.004), outfit.bottom_colour)]


def _legs(body: Body, cut: str, shank: float, rng: np.random.Generator, folds_m: float) -> Shape:
    """Trousers to the ankle (`shank` 1) or above the knee (0)."""
    thigh_grow, shank_grow = _LEG_CUTS[cut]
    k = body.scale
    low, _, *rest = body.trunk()
    seat: list[Solid] = [low.grown(0.010 * k), *(solid.grown(0.008 * k) for solid in rest[:2])]
    groups: list[list[Solid]] = []
    for side in SIDES:
        thigh = body.thigh(side).grown(np.multiply(thigh_grow, k).tolist())
        if shank > 0:
            long = body.shank(side).grown(np.multiply(shank_grow, k).tolist()).upto(1.03 if cut != "tights" else 1.0)
            groups.append([*seat, thigh, long])
        else:
            wide = thigh.grown(np.array([0.0, 0.004, 0.014, 0.018, 0.018]) * k).upto(0.80)
            groups.append([*seat, wide])
    waist = Cut(body.place("waist", "pelvis", (0.0, 0.0, 0.02 * k)), body.frame("pelvis")[:, 2])
    shape = mesh(groups, cell_m=_CELL_M, blend_m=0.035, between_m=0.012, cuts=[waist])
    # Smooth where another layer lies over it.
    covered = np.clip((body.joint("hips")[2] - 0.06 - shape.vertices_m[:, 2]) / 0.1, 0.0, 1.0)
    return ruffled(shape, covered * folds_of(rng, folds_m, upright=0.35)(shape.vertices_m))


def _closure(body: Body, outfit: Outfit, folds: Folds) -> Shape:
    """The strip of zip or buttons down the front."""
    k = body.scale
    solids, cuts = _top_trunk(body, outfit, 0.006)
    chest = body.frame("chest")
    middle = body.joint("waist") + 0.05 * k * chest[:, 0]
    half = 0.008 if outfit.top != "shirt" else 0.014
    cuts = [*cuts, Cut(middle, -chest[:, 0])]
    reach = np.array([0.6, 0.6, 1.2]) * k
    reach[np.argmin(np.abs(chest[:, 0][:2]))] = 0.2 * k  # across: the strip is narrow, whichever way the chest is turned
    cuts += [Cut(middle + s * half * chest[:, 1], s * chest[:, 1]) for s in (1.0, -1.0)]
    strip = mesh([solids], cell_m=0.0098, blend_m=0.03, cuts=cuts, within_m=np.stack([middle - reach, middle + reach]))
    return replace(strip, vertices_m=strip.vertices_m + folds(strip.vertices_m)[:, None] * chest[:, 0])


def _top_trunk(body: Body, outfit: Outfit, more_m: float = 0.0) -> tuple[list[Solid], list[Cut]]:
    """What covers the trunk, and the plane of its hem."""
    k = body.scale
    kind = outfit.top
    thick = _THICKNESS_M[kind] * k + more_m
    low, high, *rest = body.trunk()
    seat = [solid.grown(thick + 0.008 * k) for solid in rest[:2]]  # over the seat of the trousers
    trunk: list[Solid] = [low.grown(thick), high.grown(thick), *seat, *(solid.grown(thick) for solid in rest[2:])]
    if kind != "dress":
        trunk.append(_drape(body, thick))
    cuts = []
    if kind in ("coat", "dress"):
        trunk.append(_skirt(body, outfit.skirt, thick + 0.012 * k))
    else:
        if outfit.bottom == "skirt":
            trunk.append(_skirt(body, outfit.skirt, 0.02 + 0.012).upto(0.5))
        if outfit.bottom in _LEG_CUTS:
            grow = np.multiply(_LEG_CUTS[outfit.bottom][0], k) + 0.5 * thick + 0.010
            trunk += [body.thigh(side).grown(grow.tolist()).upto(0.45) for side in SIDES]
        hem = {"tshirt": -0.03, "shirt": -0.04, "sweater": -0.03, "jacket": -0.09}[kind]
        cuts.append(Cut(body.place("hips", "pelvis", (0.0, 0.0, hem * k)), -body.frame("pelvis")[:, 2]))
    if outfit.collar:
        trunk.append(_collar(body, thick))
    return trunk, cuts


def _top(body: Body, outfit: Outfit, folds: Folds) -> Shape:
    k = body.scale
    kind = outfit.top
    thick = _THICKNESS_M[kind] * k
    rest = body.trunk()[2:]
    trunk, cuts = _top_trunk(body, outfit)
    carved = []
    if kind in ("coat", "dress"):
        carved.append(_skirt(body, outfit.skirt, thick + 0.012 * k).grown(-0.030).upto(1.0, start=0.88, flat_end=False))
    if outfit.hood:
        trunk.append(
            blob(body.place("neck", "chest", (-0.075 * k, 0, 0.03 * k)), np.array([0.055, 0.10, 0.07]) * k, body.frame("chest"))
        )
    groups = [trunk, *(_sleeve(body, outfit, side, thick, rest) for side in SIDES)]
    shape = mesh(groups, cell_m=_CELL_M, blend_m=0.03, between_m=0.014, cuts=cuts, carved=carved)
    return wrinkled(shape, folds)


def _sleeve(body: Body, outfit: Outfit, side: Side, thick: float, rest: Sequence[Limb | Blob]) -> list[Solid]:
    k = body.scale
    slope = rest[2 + SIDES.index(side)]
    upper, forearm = body.upper_arm(side), body.forearm(side)
    shoulder = slope.grown(thick)
    if outfit.top == "tshirt" or (outfit.top == "dress" and not outfit.collar):
        return [shoulder, upper.grown(np.array([0.009, 0.011, 0.015, 0.022, 0.022]) * k).upto(0.56)]
    loose = np.array([0.0, 0.1, 0.3, 0.5, 0.6]) * 0.010 * k + thick * 0.75
    cuff = np.array([0.75, 0.75, 0.7, 0.55]) * thick + np.array([0.006, 0.005, 0.004, 0.004]) * k
    return [shoulder, upper.grown(loose.tolist()), forearm.grown(cuff.tolist()).upto(1.0)]


def _drape(body: Body, thick: float) -> Limb:
    """Cloth that hangs from the chest instead of following the waist."""
    k = body.scale * body.build.girth
    womanly = body.build.sex == "f" and not body.build.child
    start = body.place("waist", "chest", (0.0, 0.0, 0.12 * k))
    end = body.place("hips", "pelvis", (0.0, 0.0, -0.11 * k))
    belly = 0.075 * body.build.belly
    width = np.array([0.138, 0.146, 0.166] if womanly else [0.162, 0.162, 0.164]) * k + 0.7 * thick
    depth = np.array([0.108, 0.108 + belly, 0.118 + 0.5 * belly]) * k + 0.7 * thick
    offset = np.array([0.004, belly, -0.014]) * k
    front = body.frame("chest")[:, 0]
    return Limb(start, end, front, (0, 0.5, 1), tuple(width), tuple(depth), tuple(offset), cap_m=0.03)


def _skirt(body: Body, length: float, thick: float) -> Limb:
    """A skirt from the waist, wide enough for the legs in their pose."""
    k = body.scale * body.build.girth
    top = body.place("waist", "pelvis", (0.0, 0.0, -0.01))
    hips = body.joint("hips")
    leg = body.build.lengths_m()["hip_height"] - body.build.lengths_m()["ankle_height"]
    end = hips + np.array([0.0, 0.0, -length * leg])
    at = (0.0, 0.22, 0.4, 0.6, 0.8, 1.0)
    fore = body.frame("pelvis")[:, 0] * np.array([1.0, 1.0, 0.0])
    fore = fore / np.linalg.norm(fore)
    left = np.array([-fore[1], fore[0], 0.0])
    base_width = np.interp(at, (0, 0.4, 1), (0.138 * k, 0.172 * k, 0.178 * k)) + thick
    base_depth = np.interp(at, (0, 0.4, 1), (0.104 * k, 0.122 * k, 0.128 * k)) + thick
    width, depth, offset = [], [], []
    for t, least_width, least_depth in zip(at, base_width, base_depth, strict=True):
        legs, round_m = _legs_at(body, top + t * (end - top), fore, left)
        reach = round_m + thick + 0.008
        low = min([-0.008 * k - float(least_depth), *(ahead - reach for ahead, _ in legs)])
        high = max([-0.008 * k + float(least_depth), *(ahead + reach for ahead, _ in legs)])
        half, middle = (high - low) / 2, (high + low) / 2
        wide = max([float(least_width), *(abs(aside) + reach for _, aside in legs)])
        # A leg ahead and aside at once would leave the ellipse at its corner.
        corner = max([1.0, *(np.hypot((ahead - middle) / (half - reach), aside / (wide - reach)) for ahead, aside in legs)])
        width.append(float(reach + (wide - reach) * corner))
        depth.append(float(reach + (half - reach) * corner))
        offset.append(middle)
    return Limb(top, end, fore, at, tuple(width), tuple(depth), tuple(offset), flat_end=True, cap_m=0.02)


def _legs_at(body: Body, centre: Array, fore: Array, left: Array) -> tuple[list[tuple[float, float]], float]:
    """Return how far both legs are ahead and aside of a point, at its height, and how thick they are there [m]."""
    found = []
    for side in SIDES:
        chain = np.array([body.joint(f"{name}_{side}") for name in ("hip", "knee", "ankle")])
        for bone in range(2):
            if chain[bone, 2] >= centre[2] >= chain[bone + 1, 2]:
                t = (chain[bone, 2] - centre[2]) / max(chain[bone, 2] - chain[bone + 1, 2], 0.02)
                offset = chain[bone] + t * (chain[bone + 1] - chain[bone]) - centre
                found.append((float(offset @ fore), float(offset @ left)))
    drop = (body.joint("hips")[2] - centre[2]) / body.build.stature_m
    return found, float(np.interp(drop, (0.0, 0.25, 0.49), (0.085, 0.062, 0.045))) * body.scale * body.build.girth


def _skirt_shape(body: Body, length: float, rng: np.random.Generator, loose_m: float) -> Shape:
    k = body.scale
    skirt = _skirt(body, length, loose_m)
    low, _, *rest = body.trunk()
    seat: list[Solid] = [low.grown(0.010 * k), *(solid.grown(0.010 * k) for solid in rest[:2]), skirt]
    waist = Cut(body.place("waist", "pelvis", (0.0, 0.0, 0.02 * k)), body.frame("pelvis")[:, 2])
    hollow = skirt.grown(-0.030).upto(1.0, start=0.8, flat_end=False)
    shape = mesh([seat], cell_m=_CELL_M, blend_m=0.03, cuts=[waist], carved=[hollow])
    away = shape.vertices_m - body.joint("hips")
    angle = np.arctan2(away[:, 1], away[:, 0])
    drop = np.clip(-away[:, 2] / max(length, 0.1), 0.0, 1.0)
    pleats = 0.010 * drop * np.sin(13 * angle + 2.0 * np.sin(2 * angle) + rng.uniform(0, 6))
    return ruffled(shape, pleats)


def _collar(body: Body, thick: float) -> Solid:
    """A stand-up collar: lower in front."""
    neck = body.neck()
    lean = body.frame("chest") @ np.array([-0.42, 0.0, 1.0])
    ring = neck.grown(0.010 + 0.35 * thick)
    return Clipped(ring, (Cut(neck.start_m + 0.62 * (neck.end_m - neck.start_m), lean),))


def _vest(body: Body, colour: str) -> list[BuiltPart]:
    k = body.scale
    low, high, *rest = body.trunk()
    grow = 0.036 * k
    solids: list[Solid] = [low.grown(grow), high.grown(grow), *(solid.grown(grow) for solid in rest), _drape(body, grow)]
    up = body.frame("chest")[:, 2]
    cuts = [
        Cut(body.place("hips", "pelvis", (0, 0, 0.01 * k)), -body.frame("pelvis")[:, 2]),
        Cut(body.place("neck", "chest", (-0.01, 0, 0.02 * k)), body.frame("chest") @ np.array([0.5, 0, 1.0])),
    ]
    for side, sign in zip(SIDES, (1.0, -1.0), strict=True):
        cuts.append(
            Cut(body.joint(f"shoulder_{side}") + body.frame("chest")[:, 1] * sign * 0.012 * k, body.frame("chest")[:, 1] * sign)
        )
    vest = mesh([solids], cell_m=_CELL_M, blend_m=0.03, cuts=cuts)
    bands = []
    for height in (0.02, 0.15):
        middle = body.place("waist", "chest", (0.0, 0.0, (height - 0.04) * k))
        limits = [*cuts, Cut(middle + 0.027 * k * up, up), Cut(middle - 0.027 * k * up, -up)]
        near = np.stack([middle - [0.45, 0.45, 0.14], middle + [0.45, 0.45, 0.14]])
        bands.append(mesh([[_grown(solid, 0.005) for solid in solids]], cell_m=0.012, blend_m=0.03, cuts=limits, within_m=near))
    return [BuiltPart("vest", vest, colour), BuiltPart("vest_bands", joined(bands), "cloth/grey")]


def _grown(solid: Solid, by_m: float) -> Solid:
    return solid.grown(by_m) if isinstance(solid, Limb | Blob) else solid


def _scarf(body: Body, rng: np.random.Generator) -> Shape:
    k = body.scale
    neck = body.neck()
    middle = neck.start_m + 0.45 * (neck.end_m - neck.start_m)
    loop = [blob(middle + 0.012 * k * body.frame("chest")[:, 0], np.array([0.088, 0.082, 0.042]) * k, body.frame("chest"))]
    tail_top = body.place("neck", "chest", (0.085 * k, 0.035 * k, 0.02 * k))
    tail_end = body.place("neck", "chest", (0.172 * k, 0.052 * k, -0.22 * k))
    thin = (0.012 * k, 0.012 * k, 0.014 * k)
    tail = Limb(
        tail_top, tail_end, body.frame("chest")[:, 0], (0, 0.5, 1), (0.032 * k, 0.042 * k, 0.046 * k), thin, flat_end=True
    )
    return wrinkled(mesh([[*loop, tail]], cell_m=0.009, blend_m=0.03), folds_of(rng, 0.005, upright=0.3))


def _shoe(body: Body, outfit: Outfit, side: Side) -> list[BuiltPart]:
    foot, toes = body.frame(f"foot_{side}"), body.frame(f"toes_{side}")
    length = body.lengths["foot"]
    drop = body.lengths["ankle_height"]
    k = length / 0.266
    ankle, ball_at = body.joint(f"ankle_{side}"), body.joint(f"ball_{side}")
    s = 1.0 if side == "left" else -1.0
    sole_at = ankle - drop * foot[:, 2]
    toe_sole = ball_at - 0.4 * drop * toes[:, 2]
    bend_at = sole_at + 0.46 * length * foot[:, 0]
    heel = ankle + foot @ np.array([-0.165 * length, 0.0, 0.032 * k - drop])
    rear = Limb(
        heel,
        bend_at + 0.020 * k * foot[:, 2],
        foot[:, 2],
        (0, 0.25, 0.5, 0.8, 1),
        _scaled((0.033, 0.033, 0.034, 0.042, 0.047), k),
        _scaled((0.044, 0.046, 0.046, 0.036, 0.031), k),
        _scaled((0.0, 0.008, 0.008, 0.002, 0.0), k),
        cap_m=0.030 * k,
    )
    tip = toe_sole + toes @ np.array([0.175 * length, -0.014 * s * k, 0.016 * k])
    front = Limb(
        toe_sole + 0.018 * k * toes[:, 2],
        tip,
        toes[:, 2],
        (0, 0.5, 1),
        _scaled((0.047, 0.044, 0.031), k),
        _scaled((0.032, 0.027, 0.020), k),
        cap_m=0.030 * k,
    )
    below, toes_below = Cut(sole_at, -foot[:, 2]), Cut(toe_sole, -toes[:, 2])
    upper: list[Solid] = [Clipped(rear, (below,)), Clipped(front, (toes_below,))]
    shank = body.shank(side)
    collar = 0.72 if outfit.shoes == "boots" else 0.90
    upper.append(
        shank.grown((0.0045 if outfit.shoes == "boots" else 0.009) * k).upto(1.0, start=collar, flat_start=True, flat_end=False)
    )
    shoe = mesh([upper], cell_m=0.0095, blend_m=0.03)
    under: list[Solid] = []
    for part, base, up in ((rear, sole_at, foot[:, 2]), (front, toe_sole, toes[:, 2])):
        planes = (Cut(base + 0.010 * k * up, up), Cut(base - SOLE_M * k * up, -up))
        under.append(_Deep(Clipped(part.grown(0.004 * k), planes), up))
    sole = mesh([under], cell_m=0.0085, blend_m=0.006)
    return [BuiltPart(f"shoes_{side}", shoe, outfit.shoes_colour), BuiltPart(f"soles_{side}", sole, outfit.sole_colour)]


@dataclass(frozen=True, slots=True, eq=False)
class _Deep:
    """A clipped solid stretched straight down to its lowest plane, so that a sole keeps its outline."""

    clipped: Clipped
    up: Array

    def bounds_m(self) -> Array:
        low, high = self.clipped.bounds_m()
        return np.stack([low - SOLE_M, high])

    def distance_m(self, x: Array, y: Array, z: Array) -> Array:
        top, bottom = self.clipped.cuts
        unit = top.normal
        height = (x - top.point_m[0]) * unit[0] + (y - top.point_m[1]) * unit[1] + (z - top.point_m[2]) * unit[2]
        # Sections below the upper are those just above its sole.
        lift = np.maximum(-height, 0.0)
        values = self.clipped.solid.distance_m(x + lift * unit[0], y + lift * unit[1], z + lift * unit[2])
        depth = float((top.point_m - bottom.point_m) @ unit)
        return np.asarray(np.maximum(np.maximum(values, height), -height - depth))


@dataclass(frozen=True, slots=True, eq=False)
class Folds:
    """Soft folds of cloth: ridges of a few directions, in some places only. Heights at points [m]; the same for all layers."""

    waves: Array
    bends: Array
    places: Array
    phases: Array
    height_m: float

    def __call__(self, points_m: Array) -> Array:
        bent = 1.2 * np.sin(points_m @ self.bends.T + self.phases[:, 0])
        ridge = np.sin(points_m @ self.waves.T + bent + self.phases[:, 1]) ** 3
        where = 0.5 + 0.5 * np.sin(points_m @ self.places.T + self.phases[:, 2])
        return np.asarray(self.height_m * (where * ridge).sum(axis=1))


def folds_of(rng: np.random.Generator, height_m: float, *, upright: float) -> Folds:
    """Draw folds; a share `upright` of them runs along z."""
    count = 5
    stretch = np.where((np.arange(count) < count * upright)[:, None], [1.0, 1.0, 0.15], [0.4, 0.4, 1.0])
    along = rng.normal(size=(count, 3)) * stretch
    waves = along / np.linalg.norm(along, axis=1, keepdims=True) * 2 * np.pi / rng.uniform(0.09, 0.20, size=(count, 1))
    bends, places = rng.normal(size=(count, 3)) * 7.0, rng.normal(size=(count, 3)) * 9.0
    return Folds(waves, bends, places, rng.uniform(0.0, 2 * np.pi, size=(count, 3)), height_m)


def wrinkled(shape: Shape, folds: Folds) -> Shape:
    """Return cloth with folds pressed in."""
    return ruffled(shape, folds(shape.vertices_m))


def _scaled(values: Sequence[float], factor: float) -> tuple[float, ...]:
    return tuple(float(value) * factor for value in values)
