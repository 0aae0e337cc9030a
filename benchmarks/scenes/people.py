"""Pedestrians of rounded limbs, about 1.75 m tall, facing +x, the origin on the ground between the feet."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from benchmarks.scenes.meshes import Triangles, capsule, ellipsoid, join, moved, scaled

__all__ = ["person_parts"]


def person_parts(rng: np.random.Generator) -> dict[str, Triangles]:
    """Return the meshes of one person in stride by part: skin, hair, top, trousers, shoes."""
    stride_deg = float(rng.uniform(8, 24)) * (1 if rng.random() < 0.5 else -1)
    build = float(rng.uniform(0.92, 1.10))
    stature = float(rng.uniform(0.92, 1.06))
    legs = [_leg(side, side * stride_deg) for side in (-1, 1)]
    arms = [_arm(side, -side * stride_deg) for side in (-1, 1)]
    torso = join([
        capsule((0, 0, 0.98), (0, 0, 1.36), 0.155, 0.165),
        capsule((0, -0.15, 1.40), (0, 0.15, 1.40), 0.075),
    ])  # fmt: skip
    head = [ellipsoid((0.098, 0.078, 0.12), (0.01, 0, 1.62)), capsule((0, 0, 1.42), (0, 0, 1.56), 0.055)]
    parts = {
        "skin": join([*head, *(arm["hand"] for arm in arms)]),
        "hair": ellipsoid((0.105, 0.088, 0.11), (-0.018, 0, 1.655)),
        "top": join([scaled(torso, (0.75, 1.12, 1)), *(arm["sleeve"] for arm in arms)]),
        "trousers": join([scaled(capsule((0, 0, 0.92), (0, 0, 1.0), 0.15), (0.8, 1.1, 1)), *(leg["leg"] for leg in legs)]),
        "shoes": join(leg["shoe"] for leg in legs),
    }
    return {name: scaled(part, (build * stature, build * stature, stature)) for name, part in parts.items()}


def _leg(side: int, angle_deg: float) -> dict[str, Triangles]:
    hip = np.array([0, 0.085 * side, 0.92])
    bend_deg = angle_deg - 14 if angle_deg < 0 else angle_deg - 3
    knee = hip + 0.43 * _down(angle_deg)
    ankle = knee + 0.42 * _down(bend_deg)
    leg = join([capsule(hip, knee, 0.088, 0.062), capsule(knee, ankle, 0.062, 0.048)])
    shoe = ellipsoid((0.135, 0.05, 0.05), ankle + [0.05, 0, -0.03])
    lift = max(0.0, 0.012 - float(shoe.vertices_m[:, 2].min()))
    return {"leg": leg, "shoe": moved(shoe, (0, 0, lift))}


def _arm(side: int, angle_deg: float) -> dict[str, Triangles]:
    shoulder = np.array([0, 0.205 * side, 1.40])
    elbow = shoulder + 0.29 * _down(angle_deg) + [0, 0.03 * side, 0]
    wrist = elbow + 0.25 * _down(angle_deg + 18)
    sleeve = join([capsule(shoulder, elbow, 0.052, 0.044), capsule(elbow, wrist, 0.044, 0.036)])
    return {"sleeve": sleeve, "hand": ellipsoid((0.035, 0.03, 0.07), wrist + 0.06 * _down(angle_deg + 18), segments=10)}


def _down(angle_deg: float) -> NDArray[np.float64]:
    """Return the unit vector downwards, swung forwards by the angle."""
    return np.array([math.sin(math.radians(angle_deg)), 0.0, -math.cos(math.radians(angle_deg))])
