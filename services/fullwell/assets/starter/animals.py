"""Deer and dogs: four-legged bodies as blended limbs, in measures of their shoulder height.

Sizes: red deer stags stand 1.1 to 1.3 m at the shoulder, hinds 1.0 to 1.15 m, roe deer 0.63 to 0.75 m (Corbet & Harris 1991,
The Handbook of British Mammals); Labradors 0.54 to 0.57 m, shepherds 0.55 to 0.65 m, small terriers 0.25 to 0.35 m (breed
standards of the FCI).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from fullwell.assets.starter.building import BuiltAsset, BuiltPart, StarterEntry
from fullwell.assets.starter.implicit import Cut, Limb, Solid, ball, blob, mesh, ruffled
from fullwell.assets.starter.people import settled
from fullwell.assets.starter.shapes import Shape, joined, tube

__all__ = ["ANIMALS", "deer", "dog"]

Array = NDArray[np.float64]
Gait = Literal["standing", "walking", "trotting"]


@dataclass(frozen=True, slots=True)
class _Build:
    """A quadruped in measures of its shoulder height: where the spine's ends are, and how thick its parts are."""

    rump: tuple[float, float] = (-0.44, 0.80)
    chest: tuple[float, float] = (0.42, 0.76)
    trunk_width: tuple[float, ...] = (0.110, 0.138, 0.145, 0.138, 0.100)
    trunk_depth: tuple[float, ...] = (0.150, 0.172, 0.172, 0.195, 0.165)
    trunk_offset: tuple[float, ...] = (0.010, 0.004, -0.005, -0.012, 0.0)
    leg: float = 1.0


_DEER: Final = _Build()
_DOG: Final = _Build(
    rump=(-0.42, 0.80),
    chest=(0.38, 0.76),
    trunk_width=(0.115, 0.115, 0.135, 0.150, 0.115),
    trunk_depth=(0.130, 0.140, 0.170, 0.225, 0.170),
    trunk_offset=(0.015, 0.015, -0.010, -0.040, -0.010),
    leg=1.22,
)

# Swing of the whole leg and fold of its lower part [deg]: front left, front right, hind left, hind right.
_GAITS: Final[dict[str, tuple[tuple[float, float], ...]]] = {
    "standing": ((2.0, 0.0), (-3.0, 0.0), (-4.0, 0.0), (3.0, 0.0)),
    "walking": ((20.0, 4.0), (-14.0, 8.0), (-16.0, 2.0), (13.0, 14.0)),
    "trotting": ((24.0, 62.0), (-18.0, 4.0), (-22.0, 6.0), (22.0, 34.0)),
}


class _Animal:
    """Places points and solids, scaled by the shoulder height."""

    def __init__(self, shoulder_m: float, build: _Build) -> None:
        self.h = shoulder_m
        self.build = build

    def at(self, x: float, y: float, z: float) -> Array:
        return np.array([x, y, z]) * self.h

    def limb(self, start: Array, end: Array, front: Array, width: tuple[float, ...], depth: tuple[float, ...]) -> Limb:
        stations = tuple(np.linspace(0, 1, len(width)))
        return Limb(start, end, front, stations, self.scaled(width), self.scaled(depth))

    def scaled(self, values: tuple[float, ...]) -> tuple[float, ...]:
        return tuple(value * self.h for value in values)

    def trunk(self) -> Limb:
        (x0, z0), (x1, z1) = self.build.rump, self.build.chest
        b = self.build
        return Limb(
            self.at(x0, 0, z0),
            self.at(x1, 0, z1),
            np.array([0.0, 0.0, 1.0]),
            tuple(np.linspace(0, 1, 5)),
            self.scaled(b.trunk_width),
            self.scaled(b.trunk_depth),
            self.scaled(b.trunk_offset),
        )

    def leg(
        self, points: list[tuple[float, float]], y: float, swing: tuple[float, float], thick: list[tuple[float, float]]
    ) -> tuple[list[Solid], Array, Array]:
        """Return a leg through (x, z) points with half (width, depth) at each, where its foot is, and where that points."""
        joints = [self.at(x, y, z) for x, z in points]
        joints = _swung(joints, 0, swing[0])
        joints = _swung(joints, 2, -swing[1])
        front = np.array([1.0, 0.0, 0.0])
        k = self.build.leg
        solids: list[Solid] = []
        for index in range(len(joints) - 1):
            (w0, d0), (w1, d1) = thick[index], thick[index + 1]
            scale = 1.0 if index == 0 else k
            solids.append(self.limb(joints[index], joints[index + 1], front, (w0 * scale, w1 * k), (d0 * scale, d1 * k)))
        heading = _swung([front * 0, front], 0, swing[0] - swing[1])[1]
        return solids, joints[-1], heading


def _swung(points: list[Array], pivot: int, angle_deg: float) -> list[Array]:
    """Turn the points after a pivot forward (about -y) by an angle."""
    cosine, sine = np.cos(np.deg2rad(angle_deg)), np.sin(np.deg2rad(angle_deg))
    turn = np.array([[cosine, 0.0, -sine], [0.0, 1.0, 0.0], [sine, 0.0, cosine]])
    centre = points[pivot]
    return [point if index <= pivot else centre + turn @ (point - centre) for index, point in enumerate(points)]


_FRONT = [(0.30, 0.80), (0.25, 0.56), (0.285, 0.31), (0.28, 0.09), (0.31, 0.035)]
_FRONT_THICK = [(0.060, 0.115), (0.040, 0.056), (0.023, 0.026), (0.017, 0.020), (0.018, 0.021)]
_HIND = [(-0.34, 0.80), (-0.24, 0.55), (-0.43, 0.335), (-0.40, 0.09), (-0.365, 0.035)]
_HIND_THICK = [(0.085, 0.150), (0.056, 0.082), (0.022, 0.033), (0.018, 0.022), (0.018, 0.021)]


def _legs(animal: _Animal, gait: Gait) -> tuple[list[list[Solid]], list[tuple[Array, Array]]]:
    groups, feet = [], []
    for index, (points, thick, y) in enumerate(
        (
            (_FRONT, _FRONT_THICK, 0.092),
            (_FRONT, _FRONT_THICK, -0.092),
            (_HIND, _HIND_THICK, 0.090),
            (_HIND, _HIND_THICK, -0.090),
        )
    ):
        solids, foot, heading = animal.leg(points, y, _GAITS[gait][index], thick)
        groups.append(solids)
        feet.append((foot, heading))
    return groups, feet


def deer(
    rng: np.random.Generator,
    *,
    shoulder_m: float,
    antlers_m: float = 0.0,
    gait: Gait = "standing",
    graze: float = 0.0,
    look_deg: float = 0.0,
    mane: float = 0.0,
    tags: tuple[str, ...] = (),
) -> BuiltAsset:
    """Return a deer.

    Parameters
    ----------
    antlers_m
        Length of each beam; 0 for a doe.
    graze
        Lowers the head, 0 to 1.
    look_deg
        Turns the head to the left.
    mane
        Thickens the neck by that fraction.
    """
    animal = _Animal(shoulder_m, _DEER)
    h = shoulder_m
    legs, feet = _legs(animal, gait)
    base = animal.at(0.62 + 0.10 * graze, 0, 1.26 - 0.55 * graze)
    turn = _yaw(look_deg)

    def head(x: float, y: float, z: float) -> Array:
        return np.asarray(base + turn @ (np.array([x, y, z]) * h))

    wide = 1.0 + mane
    neck = animal.limb(
        animal.at(0.33, 0, 0.82),
        head(0.0, 0, -0.02),
        np.array([1.0, 0.0, 0.3]),
        (0.092 * wide, 0.070 * wide, 0.056, 0.052),
        (0.150 * wide, 0.110 * wide, 0.080, 0.066),
    )
    front = turn @ np.array([0.3, 0.0, 1.0])
    skull = animal.limb(
        head(-0.01, 0, 0.01),
        head(0.255, 0, -0.125),
        front,
        (0.058, 0.062, 0.048, 0.037, 0.030),
        (0.076, 0.074, 0.060, 0.046, 0.034),
    )
    tail = animal.limb(
        animal.at(-0.49, 0, 0.90),
        animal.at(-0.565, 0, 0.76),
        np.array([1.0, 0, 0]),
        (0.022, 0.034, 0.014),
        (0.018, 0.022, 0.010),
    )
    trunk = animal.trunk()
    coat = mesh(
        [[trunk, neck, tail], *([trunk, *leg[:2]] for leg in legs)],
        cell_m=0.0145 * max(h, 0.7),
        blend_m=0.07 * h,
        between_m=0.03 * h,
    )
    shanks = [mesh([leg[1:]], cell_m=0.0085 * max(h, 0.7), blend_m=0.018 * h) for leg in legs]
    face = mesh(
        [[neck.upto(1.0, start=0.6, flat_end=False), skull], *_ears(animal, head, h)],
        cell_m=0.0085 * max(h, 0.7),
        blend_m=0.03 * h,
    )
    rump = mesh(
        [[blob(animal.at(-0.527, s * 0.048, 0.790), np.array([0.046, 0.062, 0.095]) * h)] for s in (1, -1)],
        cell_m=0.012 * h,
        blend_m=0.0,
        between_m=0.02,
    )
    parts = [
        BuiltPart("coat", joined([_shaggy(coat, rng, 0.0012), face, *shanks]), "fur/deer"),
        BuiltPart("rump", rump, "fur/white"),
        BuiltPart("hooves", joined([_hoof(foot, heading, h) for foot, heading in feet]), "leather/black"),
        BuiltPart(
            "nose",
            mesh([[blob(head(0.276, 0, -0.128), np.array([0.022, 0.024, 0.020]) * h)]], cell_m=0.006 * h, blend_m=0),
            "leather/black",
        ),
        BuiltPart(
            "eyes",
            joined([mesh([[ball(head(0.080, s * 0.053, 0.014), 0.014 * h)]], cell_m=0.006 * h, blend_m=0) for s in (1, -1)]),
            "leather/black",
        ),
    ]
    if antlers_m:
        parts.append(BuiltPart("antlers", _antlers(rng, head, antlers_m / h), "wood/oak"))
    animal_tags = ("stag" if antlers_m else "doe", gait, *tags)
    return settled("deer", animal_tags, parts, {"shoulder_height_m": h, "gait": gait}, eye_m=float(head(0.080, 0, 0.014)[2]))


def _ears(animal: _Animal, head: Callable[[float, float, float], Array], h: float) -> list[list[Solid]]:
    ears: list[list[Solid]] = []
    for s in (1.0, -1.0):
        start, end = head(-0.015, s * 0.050, 0.055), head(-0.075, s * 0.185, 0.125)
        ears.append(
            [
                animal.limb(
                    start, end, np.array([0.9, 0.35 * s, 0.0]), (0.018, 0.050, 0.044, 0.010), (0.013, 0.014, 0.012, 0.008)
                )
            ]
        )
    return ears


def _antlers(rng: np.random.Generator, head: Callable[[float, float, float], Array], length: float) -> Shape:
    """Return both antlers: a beam that sweeps back, out and up, with tines forward."""
    shapes = []
    for s in (1.0, -1.0):
        t = np.linspace(0, 1, 9)
        beam = np.column_stack(
            [-0.30 * np.sin(2.5 * t) + 0.12 * t**2, s * (0.045 + 0.40 * np.sin(2.1 * t)), 0.055 + 0.80 * t**1.2]
        ) * [length, length, length]
        beam[:, 1] += s * 0.03
        points = np.array([head(*p) for p in beam])
        shapes.append(tube(points, np.linspace(0.026, 0.008, 9) * (0.4 + 0.6 * length), sides=8))
        for at, reach, rise in ((0.06, 0.30, 0.10), (0.22, 0.24, 0.10), (0.5, 0.24, 0.14), (0.8, 0.15, 0.16)):
            root = np.array([np.interp(at, t, beam[:, k]) for k in range(3)])
            size = length * rng.uniform(0.9, 1.1)
            tine = root + np.array([[0, 0, 0], [0.6 * reach, s * 0.03, 0.25 * rise], [reach, s * 0.05, rise]]) * size
            shapes.append(
                tube(np.array([head(*p) for p in tine]), np.array([0.017, 0.013, 0.005]) * (0.4 + 0.6 * length), sides=6)
            )
    return joined(shapes)


def _hoof(foot: Array, heading: Array, h: float) -> Shape:
    down = np.array([-heading[2], 0.0, heading[0]]) * -1.0
    solid = Limb(
        foot - 0.012 * h * down,
        foot + 0.034 * h * down + 0.018 * h * heading,
        heading,
        (0, 1),
        (0.022 * h, 0.029 * h),
        (0.026 * h, 0.038 * h),
        flat_end=True,
    )
    return mesh([[solid]], cell_m=0.008 * h, blend_m=0.0)


def dog(
    rng: np.random.Generator,
    *,
    shoulder_m: float,
    breed: Literal["labrador", "shepherd", "terrier"],
    coat: str,
    gait: Gait = "standing",
    collar: str = "cloth/red",
    tags: tuple[str, ...] = (),
) -> BuiltAsset:
    """Return a dog; the breed decides ears, muzzle, coat and tail."""
    animal = _Animal(shoulder_m, _DOG)
    h = shoulder_m
    legs, feet = _legs(animal, gait)
    shaggy = {"labrador": 0.0, "shepherd": 0.0035, "terrier": 0.012}[breed]
    muzzle = {"labrador": 1.0, "shepherd": 1.12, "terrier": 0.85}[breed]
    neck = animal.limb(
        animal.at(0.31, 0, 0.86),
        animal.at(0.50, 0, 1.08),
        np.array([1.0, 0, 0.4]),
        (0.105, 0.092, 0.088),
        (0.140, 0.112, 0.098),
    )
    skull = blob(animal.at(0.535, 0, 1.135), np.array([0.125, 0.108, 0.104]) * h)
    snout_end = animal.at(0.585 + 0.215 * muzzle, 0, 1.065)
    snout = animal.limb(
        animal.at(0.575, 0, 1.105), snout_end, np.array([0.2, 0, 1.0]), (0.082, 0.068, 0.056), (0.080, 0.066, 0.050)
    )
    trunk = animal.trunk()
    cell = 0.022 * max(h, 0.42) if h > 0.4 else 0.0085
    body = mesh(
        [[trunk, neck, *_tail(animal, breed)], *([trunk, *leg[:2]] for leg in legs)],
        cell_m=cell,
        blend_m=0.09 * h,
        between_m=0.03 * h,
    )
    shanks = [
        mesh([[*leg[1:], _paw(foot, heading, h)]], cell_m=0.0155 * max(h, 0.4), blend_m=0.03 * h)
        for leg, (foot, heading) in zip(legs, feet, strict=True)
    ]
    head = mesh(
        [[neck.upto(1.0, start=0.5, flat_end=False), skull, snout], *_dog_ears(animal, breed)],
        cell_m=0.015 * max(h, 0.4),
        blend_m=0.05 * h,
    )
    hair = [_shaggy(part, rng, shaggy * h + 0.0012) for part in (body, head, *shanks)]
    band = neck.grown(0.012 * h).upto(0.74, start=0.60, flat_start=True)
    tip = snout_end + animal.at(0.036, 0, 0.018)
    parts = [
        BuiltPart("coat", joined(hair), coat),
        BuiltPart(
            "nose", mesh([[blob(tip, np.array([0.024, 0.030, 0.022]) * h)]], cell_m=0.009 * h, blend_m=0), "leather/black"
        ),
        BuiltPart(
            "eyes",
            joined(
                [mesh([[ball(animal.at(0.622, s * 0.056, 1.158), 0.020 * h)]], cell_m=0.008 * h, blend_m=0) for s in (1, -1)]
            ),
            "leather/black",
        ),
    ]
    if collar:
        parts.append(BuiltPart("collar", mesh([[band]], cell_m=0.014 * h, blend_m=0.0), collar))
    if breed == "shepherd":
        saddle = trunk.grown(0.010 * h + 0.012 * h).upto(0.92, start=0.06, flat_end=False)
        top = mesh([[saddle]], cell_m=cell, blend_m=0.0, cuts=[Cut(animal.at(0, 0, 0.80), np.array([0.0, 0.0, -1.0]))])
        parts.append(BuiltPart("saddle", _shaggy(top, rng, 0.004 * h), "fur/dog_black"))
    return settled("dog", (breed, gait, *tags), parts, {"shoulder_height_m": h, "breed": breed, "gait": gait}, eye_m=1.158 * h)


def _paw(foot: Array, heading: Array, h: float) -> Solid:
    return Limb(
        foot - 0.005 * h * heading,
        foot + 0.055 * h * heading + np.array([0, 0, -0.012 * h]),
        np.array([0.0, 0.0, 1.0]),
        (0, 1),
        (0.030 * h, 0.040 * h),
        (0.026 * h, 0.026 * h),
    )


def _tail(animal: _Animal, breed: str) -> list[Solid]:
    paths = {
        "labrador": [(-0.47, 0.86), (-0.62, 0.80), (-0.78, 0.84)],
        "shepherd": [(-0.47, 0.84), (-0.62, 0.66), (-0.72, 0.46)],
        "terrier": [(-0.45, 0.88), (-0.51, 1.03), (-0.50, 1.18)],
    }[breed]
    points = [animal.at(x, 0, z) for x, z in paths]
    thick = {"labrador": (0.042, 0.036, 0.018), "shepherd": (0.045, 0.058, 0.026), "terrier": (0.035, 0.032, 0.018)}[breed]
    return [
        animal.limb(points[k], points[k + 1], np.array([0.0, 0.3, 1.0]), (thick[k], thick[k + 1]), (thick[k], thick[k + 1]))
        for k in range(2)
    ]


def _dog_ears(animal: _Animal, breed: str) -> list[list[Solid]]:
    ears: list[list[Solid]] = []
    for s in (1.0, -1.0):
        if breed == "shepherd":
            start, end = animal.at(0.50, s * 0.058, 1.19), animal.at(0.505, s * 0.088, 1.37)
            ears.append([animal.limb(start, end, np.array([0.3, s, 0.0]), (0.052, 0.042, 0.010), (0.022, 0.016, 0.008))])
        else:
            start, end = animal.at(0.520, s * 0.088, 1.190), animal.at(0.560, s * 0.118, 1.050)
            ears.append([animal.limb(start, end, np.array([0.0, s, 0.3]), (0.038, 0.062, 0.030), (0.017, 0.018, 0.014))])
    return ears


def _shaggy(shape: Shape, rng: np.random.Generator, height_m: float) -> Shape:
    waves = rng.normal(0, 1.0, (4, 3)) * 110.0
    bends = rng.normal(0, 1.0, (4, 3)) * 40.0
    points = shape.vertices_m
    heights = np.sin(points @ waves.T + 2.0 * np.sin(points @ bends.T)).sum(axis=1) / 3.0
    return ruffled(shape, height_m * heights)


def _yaw(angle_deg: float) -> Array:
    cosine, sine = np.cos(np.deg2rad(angle_deg)), np.sin(np.deg2rad(angle_deg))
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])


def _deer(name: str, title: str, seed: int, **parameters: object) -> StarterEntry:
    return StarterEntry(name, title, deer, parameters, seed)


def _dog(name: str, title: str, seed: int, **parameters: object) -> StarterEntry:
    return StarterEntry(name, title, dog, parameters, seed)


ANIMALS: Final = (
    _deer("deer-stag-01", "Red deer stag", 201, shoulder_m=1.18, antlers_m=0.78, mane=0.35, look_deg=18.0, tags=("red_deer",)),
    _deer("deer-doe-01", "Red deer hind, walking", 202, shoulder_m=1.05, gait="walking", tags=("red_deer",)),
    _deer(
        "deer-roe-01",
        "Roe deer crossing, looking aside",
        203,
        shoulder_m=0.70,
        gait="trotting",
        look_deg=55.0,
        tags=("roe_deer",),
    ),
    _dog("dog-labrador-01", "Black Labrador", 211, shoulder_m=0.57, breed="labrador", coat="fur/dog_black"),
    _dog(
        "dog-shepherd-01",
        "Shepherd dog, trotting",
        212,
        shoulder_m=0.62,
        breed="shepherd",
        coat="fur/dog_brown",
        gait="trotting",
        collar="leather/black",
    ),
    _dog("dog-terrier-01", "White terrier, walking", 213, shoulder_m=0.30, breed="terrier", coat="fur/white", gait="walking"),
)
"""Animals of the starter library."""
