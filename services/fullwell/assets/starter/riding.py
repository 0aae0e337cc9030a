"""Riders: a body seated on a saddle, with its hands on grips and its feet on pedals or rests."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fullwell.assets.starter.bodies import SIDES, Build, Pose, Side, Skeleton, posed, reaching

__all__ = ["Contacts", "seated"]

Array = NDArray[np.float64]

_SEAT_TO_HIP_M: Final = 0.085
"""Height of the hip joint over the saddle of an adult 1.75 m tall (de Leva 1996 puts it about 0.05 statures up)."""

_ARM_SLACK: Final = 0.95
"""Share of the arm's length that reaches from shoulder to grip: elbows stay soft."""


@dataclass(frozen=True, slots=True, eq=False)
class Contacts:
    """Where a vehicle meets its rider, (3,) positions [m]: top of the saddle, grips and pedals, left then right."""

    saddle_m: Array
    grips_m: tuple[Array, Array]
    pedals_m: tuple[Array, Array]


def seated(build: Build, contacts: Contacts, *, look_deg: float = 0.0, toes_down_deg: float = 12.0) -> Skeleton:
    """Return the joints of a rider; the trunk leans just so far that the arms reach."""
    scale = build.stature_m / 1.75
    hips = contacts.saddle_m + np.array([0.02, 0.0, _SEAT_TO_HIP_M]) * scale
    lengths = build.lengths_m()
    arm = _ARM_SLACK * (lengths["upper_arm"] + lengths["forearm"])
    for lean in np.arange(4.0, 75.0, 1.0):
        skeleton = posed(build, Pose(lean=float(lean), stoop=6.0 + 0.12 * float(lean), nod=4.0, look=look_deg, name="riding"))
        skeleton = skeleton.moved(hips - skeleton.joints_m["hips"])
        wrists = [_wrist(grip, skeleton, side, lengths["hand"]) for grip, side in zip(contacts.grips_m, SIDES, strict=True)]
        spans = [
            np.linalg.norm(wrist - skeleton.joints_m[f"shoulder_{side}"]) for wrist, side in zip(wrists, SIDES, strict=True)
        ]
        if max(spans) <= arm:
            break
    joints, frames = dict(skeleton.joints_m), dict(skeleton.frames)
    # The neck takes back most of the lean: eyes on the road.
    frames["head"] = frames["chest"] @ _about_y(-0.8 * float(lean)) @ _about_z(look_deg)
    joints["chin"] = joints["neck"] + 0.5 * (frames["chest"] + frames["head"])[:, 2] * (
        lengths["chin_height"] - lengths["shoulder_height"] - 0.022 * build.stature_m
    )
    for index, side in enumerate(SIDES):
        _place_arm(joints, frames, lengths, wrists[index], side)
        _place_leg(joints, frames, build, contacts.pedals_m[index], side, toes_down_deg=toes_down_deg)
    return replace(skeleton, joints_m=joints, frames=frames)


def _wrist(grip: Array, skeleton: Skeleton, side: Side, hand_m: float) -> Array:
    """The wrist lies behind and a little above the grip, towards the shoulder."""
    back = skeleton.joints_m[f"shoulder_{side}"] - grip
    back[2] = 0.35 * np.linalg.norm(back[:2])
    return np.asarray(grip + 0.45 * hand_m * back / np.linalg.norm(back) + [0.0, 0.0, 0.012])


def _place_arm(
    joints: dict[str, Array], frames: dict[str, Array], lengths: Mapping[str, float], wrist: Array, side: Side
) -> None:
    s = 1.0 if side == "left" else -1.0
    shoulder = joints[f"shoulder_{side}"]
    elbow, end = reaching(shoulder, wrist, lengths["upper_arm"], lengths["forearm"], np.array([-0.2, 0.55 * s, -0.8]))
    joints |= {f"elbow_{side}": elbow, f"wrist_{side}": end}
    ahead = np.array([1.0, 0.0, 0.2])
    frames[f"upper_arm_{side}"] = _framed(elbow - shoulder, ahead)
    frames[f"forearm_{side}"] = _framed(end - elbow, np.array([0.0, -s, 0.3]))
    # Palms face down, fingers close over the grip.
    reach = end - elbow
    reach = reach / np.linalg.norm(reach) + np.array([0.5, 0.0, 0.0])
    frames[f"hand_{side}"] = _framed(reach, np.cross(s * np.array([0.0, 0.0, 1.0]), -reach))
    joints[f"grip_{side}"] = end - 0.6 * lengths["hand"] * frames[f"hand_{side}"][:, 2]


def _place_leg(
    joints: dict[str, Array], frames: dict[str, Array], build: Build, pedal: Array, side: Side, *, toes_down_deg: float
) -> None:
    s = 1.0 if side == "left" else -1.0
    lengths = build.lengths_m()
    foot = _about_y(toes_down_deg)
    sole = 0.022 * lengths["foot"] / 0.266
    # The ball of the foot stands on the pedal.
    ankle = pedal + foot @ np.array([-0.46 * lengths["foot"], 0.0, lengths["ankle_height"] + sole + 0.008])
    hip = joints[f"hip_{side}"]
    knee, end = reaching(hip, ankle, lengths["thigh"], lengths["shank"], np.array([1.0, 0.06 * s, 0.3]))
    joints |= {f"knee_{side}": knee, f"ankle_{side}": end}
    joints[f"ball_{side}"] = end + foot @ np.array([0.46 * lengths["foot"], 0.0, -0.6 * lengths["ankle_height"]])
    up = np.array([0.3, 0.0, 1.0])
    frames[f"thigh_{side}"] = _framed(knee - hip, up)
    frames[f"shank_{side}"] = _framed(end - knee, np.array([1.0, 0.0, 0.1]))
    frames[f"foot_{side}"] = frames[f"toes_{side}"] = foot


def _framed(bone: Array, front: Array) -> Array:
    """(3, 3) axes of a segment that points down its bone, its depth towards `front`."""
    up = -bone / np.linalg.norm(bone)
    ahead = front - (front @ up) * up
    ahead = ahead / np.linalg.norm(ahead)
    return np.stack([ahead, np.cross(up, ahead), up], axis=1)


def _about_y(angle_deg: float) -> Array:
    cosine, sine = np.cos(np.deg2rad(angle_deg)), np.sin(np.deg2rad(angle_deg))
    return np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])


def _about_z(angle_deg: float) -> Array:
    cosine, sine = np.cos(np.deg2rad(angle_deg)), np.sin(np.deg2rad(angle_deg))
    return np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
