"""Human bodies: proportions by stature and age, joints posed by angles, and limbs as solids.

Segment lengths are fractions of stature after Drillis & Contini 1966 as printed in Winter, Biomechanics and Motor Control of
Human Movement, 4th ed. 2009, fig. 4.1. Children have larger heads and shorter legs: head length over stature shaped after
Domljan, Iliev & Jurcevic Lulic 2024 (doi 10.3390/app14167185), leg length after Snyder et al. 1977 (UM-HSRI-77-17). Joint
angles over the walking cycle are shaped after Winter 2009 ch. 5, over the running cycle after Novacheck 1998 (Gait Posture 7).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from fullwell.assets.starter.implicit import Blob, Limb, Solid, ball, blob

__all__ = [
    "SEGMENT_FRACTIONS",
    "SIDES",
    "ArmPose",
    "Body",
    "Build",
    "LegPose",
    "Pose",
    "Side",
    "Skeleton",
    "posed",
    "reaching",
    "running",
    "standing",
    "walking",
]

Array = NDArray[np.float64]
Side = Literal["left", "right"]
SIDES: Final[tuple[Side, Side]] = ("left", "right")

SEGMENT_FRACTIONS: Final[Mapping[str, float]] = {
    "ankle_height": 0.039,
    "shank": 0.246,
    "thigh": 0.245,
    "hip_height": 0.530,
    "shoulder_height": 0.818,
    "chin_height": 0.870,
    "eye_height": 0.936,
    "shoulder_half_breadth": 0.1295,
    "upper_arm": 0.186,
    "forearm": 0.146,
    "hand": 0.108,
    "foot": 0.152,
    "head": 0.130,
}
"""Lengths of adults over stature (Drillis & Contini 1966)."""

_HEAD_BY_STATURE: Final = ((0.95, 1.15, 1.30, 1.45, 1.60), (0.195, 0.175, 0.160, 0.147, 0.130))
_LEG_BY_STATURE: Final = ((0.95, 1.15, 1.30, 1.45, 1.60), (0.475, 0.495, 0.508, 0.520, 0.530))


@dataclass(frozen=True, slots=True)
class Build:
    """How large and how shaped a person is.

    Attributes
    ----------
    stature_m
        Standing height without shoes, 0.95 to 2.05.
    sex
        "f" or "m": breadth of shoulders and hips, bust.
    child
        Proportions of a child of that stature.
    girth
        Factor on all thicknesses; 1 is lean to average.
    belly
        0 to 1, added roundness in front.
    """

    stature_m: float
    sex: Literal["f", "m"] = "f"
    child: bool = False
    girth: float = 1.0
    belly: float = 0.0

    def lengths_m(self) -> Mapping[str, float]:
        """Return segment lengths and standing heights [m], by the names of `SEGMENT_FRACTIONS`."""
        f = dict(SEGMENT_FRACTIONS)
        if self.child:
            f["head"] = float(np.interp(self.stature_m, *_HEAD_BY_STATURE))
            f["hip_height"] = float(np.interp(self.stature_m, *_LEG_BY_STATURE))
            shorter = (f["hip_height"] - f["ankle_height"]) / (f["shank"] + f["thigh"])
            f["shank"] *= shorter
            f["thigh"] *= shorter
            f["chin_height"] = 1.0 - f["head"]
            f["eye_height"] = 1.0 - 0.5 * f["head"]
            f["shoulder_height"] = f["chin_height"] - 0.042
            f["upper_arm"] *= 0.95
            f["forearm"] *= 0.95
        return {name: value * self.stature_m for name, value in f.items()}


@dataclass(frozen=True, slots=True)
class LegPose:
    """Angles of a leg [deg]: flexion is forward at the hip, backward at the knee, toes up at the ankle."""

    hip: float = 0.0
    abduct: float = 2.0
    turn_out: float = 6.0
    knee: float = 2.0
    ankle: float = 0.0
    toes: float = 0.0


@dataclass(frozen=True, slots=True)
class ArmPose:
    """Angles of an arm [deg]: flexion forward at shoulder and elbow, `turn_in` about the upper arm, `curl` of the fingers."""

    flex: float = 2.0
    abduct: float = 9.0
    turn_in: float = 20.0
    elbow: float = 14.0
    wrist: float = 0.0
    twist: float = 0.0
    curl: float = 28.0


@dataclass(frozen=True, slots=True)
class Pose:
    """A posture: trunk leans forward, bends left and turns left [deg], head nods down and turns left relative to the chest."""

    legs: tuple[LegPose, LegPose] = (LegPose(), LegPose())
    arms: tuple[ArmPose, ArmPose] = (ArmPose(), ArmPose())
    lean: float = 1.0
    stoop: float = 2.0
    sway: float = 0.0
    pelvis_turn: float = 0.0
    chest_turn: float = 0.0
    nod: float = 3.0
    look: float = 0.0
    phase: float = 0.0
    name: str = "standing"


def standing(**changes: object) -> Pose:
    """Return a relaxed stance, one knee a little softer, with fields of `Pose` changed."""
    legs = (LegPose(hip=1.0, abduct=3.0), LegPose(hip=7.0, abduct=5.0, knee=12.0, ankle=5.0, turn_out=14.0))
    return replace(Pose(legs=legs, sway=0.0), **changes)  # type: ignore[arg-type]


_WALK: Final = (
    (0, 10, 20, 30, 40, 50, 60, 70, 80, 90, 100),
    (29, 24, 15, 5, -4, -10, -5, 11, 24, 30, 29),  # hip
    (5, 15, 16, 9, 5, 11, 34, 59, 49, 20, 5),  # knee
    (0, -4, 4, 7, 10, 5, -16, -9, 0, 2, 0),  # ankle
)
_RUN: Final = (
    (0, 10, 20, 30, 40, 50, 60, 70, 80, 90, 100),
    (38, 34, 20, 3, -6, 3, 26, 44, 50, 46, 38),
    (20, 38, 42, 28, 18, 45, 82, 102, 82, 38, 20),
    (6, 16, 22, 6, -22, -16, -4, 4, 6, 6, 6),
)


def walking(phase: float, *, vigour: float = 1.0, **changes: object) -> Pose:
    """Return a moment of walking; the left heel strikes at phase 0, the right one at 0.5. `vigour` widens the stride."""
    legs = (_stride(_WALK, phase, vigour), _stride(_WALK, phase + 0.5, vigour))
    swing = 21.0 * vigour * np.cos(2 * np.pi * phase)
    arms = tuple(
        ArmPose(flex=-3.0 + sign * swing, abduct=8.0, turn_in=22.0, elbow=18.0 + max(sign * swing, 0.0) * 0.7)
        for sign in (-1.0, 1.0)
    )
    turn = 5.0 * vigour * np.cos(2 * np.pi * phase)
    pose = Pose(legs, (arms[0], arms[1]), lean=4.0, pelvis_turn=-turn, chest_turn=2 * turn, phase=phase % 1.0, name="walking")
    return replace(pose, **changes)  # type: ignore[arg-type]


def running(phase: float, **changes: object) -> Pose:
    """Return a moment of running; the left foot lands at phase 0, both are in the air about phase 0.45 and 0.95."""
    legs = (_stride(_RUN, phase, 1.0), _stride(_RUN, phase + 0.5, 1.0))
    swing = 38.0 * np.cos(2 * np.pi * phase)
    arms = tuple(
        ArmPose(flex=-12.0 + sign * swing, abduct=13.0, turn_in=32.0, elbow=88.0 + 0.25 * sign * swing, curl=70.0)
        for sign in (-1.0, 1.0)
    )
    turn = 8.0 * np.cos(2 * np.pi * phase)
    pose = Pose(legs, (arms[0], arms[1]), lean=9.0, pelvis_turn=-turn, chest_turn=2 * turn, phase=phase % 1.0, name="running")
    return replace(pose, **changes)  # type: ignore[arg-type]


def _stride(table: tuple[tuple[float, ...], ...], phase: float, vigour: float) -> LegPose:
    at = 100.0 * (phase % 1.0)
    hip, knee, ankle = (float(np.interp(at, table[0], row)) for row in table[1:])
    # Late in stance the heel rises while the toes stay flat: they bend by as much as the foot pitches.
    rise = max(0.0, knee - hip - ankle) if 35.0 < at < 62.0 else 0.0
    return LegPose(hip=hip * vigour, abduct=-1.0, turn_out=5.0, knee=knee, ankle=ankle, toes=min(rise, 55.0))


@dataclass(frozen=True, slots=True, eq=False)
class Skeleton:
    """Where joints are [m] and how segments are turned, by names like "knee_left"; columns of frames: forward, left, up."""

    joints_m: Mapping[str, Array]
    frames: Mapping[str, Array]

    def moved(self, shift_m: Array) -> Skeleton:
        """Return it shifted."""
        return replace(self, joints_m={name: point + shift_m for name, point in self.joints_m.items()})


def _turn(axis: str, angle_deg: float) -> Array:
    first, second = {"x": (1, 2), "y": (2, 0), "z": (0, 1)}[axis]
    matrix = np.eye(3)
    cosine, sine = np.cos(np.deg2rad(angle_deg)), np.sin(np.deg2rad(angle_deg))
    matrix[first, first] = matrix[second, second] = cosine
    matrix[first, second], matrix[second, first] = -sine, sine
    return matrix


def _sign(side: Side) -> float:
    return 1.0 if side == "left" else -1.0


def posed(build: Build, pose: Pose) -> Skeleton:
    """Return the joints of a build in a pose, hips above the origin at standing height; the shoes meet the ground later."""
    m = build.lengths_m()
    h = build.stature_m
    pelvis = _turn("z", pose.pelvis_turn) @ _turn("y", 0.4 * pose.lean)
    chest = pelvis @ _turn("z", pose.chest_turn) @ _turn("y", 0.6 * pose.lean + pose.stoop) @ _turn("x", -pose.sway)
    head = chest @ _turn("z", pose.look) @ _turn("y", pose.nod - pose.stoop - 0.8 * pose.lean)
    hips = np.array([0.0, 0.0, m["hip_height"]])
    trunk = m["shoulder_height"] - m["hip_height"]
    waist = hips + pelvis @ np.array([0.0, 0.0, 0.36 * trunk])
    neck = waist + chest @ np.array([-0.006 * h, 0.0, 0.64 * trunk + 0.022 * h])
    skull = neck + (chest @ _turn("y", 9.0)) @ np.array([0.0, 0.0, m["chin_height"] - m["shoulder_height"] - 0.022 * h])
    joints = {"hips": hips, "waist": waist, "neck": neck, "chin": skull}
    frames = {"pelvis": pelvis, "chest": chest, "head": head}
    for index, side in enumerate(SIDES):
        _add_leg(joints, frames, build, pose.legs[index], side)
        _add_arm(joints, frames, build, pose.arms[index], side, rise_m=0.64 * trunk)
    return Skeleton(joints, frames)


def _add_leg(joints: dict[str, Array], frames: dict[str, Array], build: Build, leg: LegPose, side: Side) -> None:
    m, h = build.lengths_m(), build.stature_m
    s = _sign(side)
    # Gait angles are against the vertical, so the thigh hangs from the world's axes turned with the pelvis.
    base = _turn("z", np.rad2deg(np.arctan2(frames["pelvis"][1, 0], frames["pelvis"][0, 0])))
    thigh = base @ _turn("y", -leg.hip) @ _turn("x", s * leg.abduct) @ _turn("z", s * 0.6 * leg.turn_out)
    shank = thigh @ _turn("y", leg.knee) @ _turn("x", -s * 0.6 * leg.abduct)
    foot = shank @ _turn("z", s * 0.4 * leg.turn_out) @ _turn("y", -leg.ankle)
    hip = joints["hips"] + frames["pelvis"] @ np.array([0.0, s * 0.050 * h, 0.0])
    knee = hip - m["thigh"] * thigh[:, 2]
    ankle = knee - m["shank"] * shank[:, 2]
    joints |= {f"hip_{side}": hip, f"knee_{side}": knee, f"ankle_{side}": ankle}
    joints[f"ball_{side}"] = ankle + foot @ np.array([0.46 * m["foot"], 0.0, -0.6 * m["ankle_height"]])
    frames |= {f"thigh_{side}": thigh, f"shank_{side}": shank, f"foot_{side}": foot}
    frames[f"toes_{side}"] = foot @ _turn("y", -leg.toes)


def _add_arm(
    joints: dict[str, Array], frames: dict[str, Array], build: Build, arm: ArmPose, side: Side, *, rise_m: float
) -> None:
    m, h = build.lengths_m(), build.stature_m
    s = _sign(side)
    upper = frames["chest"] @ _turn("y", -arm.flex) @ _turn("x", s * arm.abduct) @ _turn("z", -s * arm.turn_in)
    fore = upper @ _turn("y", -arm.elbow) @ _turn("z", -s * arm.twist)
    hand = fore @ _turn("x", -s * arm.wrist)
    breadth = m["shoulder_half_breadth"] * (0.94 if build.sex == "f" and not build.child else 1.0) - 0.027 * h
    shoulder = joints["waist"] + frames["chest"] @ np.array([-0.006 * h, s * breadth, rise_m])
    elbow = shoulder - m["upper_arm"] * upper[:, 2]
    wrist = elbow - m["forearm"] * fore[:, 2]
    joints |= {f"shoulder_{side}": shoulder, f"elbow_{side}": elbow, f"wrist_{side}": wrist}
    joints[f"grip_{side}"] = wrist - 0.6 * m["hand"] * hand[:, 2]
    frames |= {f"upper_arm_{side}": upper, f"forearm_{side}": fore, f"hand_{side}": hand}


def reaching(start_m: Array, target_m: Array, first_m: float, second_m: float, bend: Array) -> tuple[Array, Array]:
    """Return the middle and end joint of two bones that reach from a joint towards a target, bending towards `bend`.

    A target out of reach is approached as far as the bones allow.
    """
    away = target_m - start_m
    distance = float(np.linalg.norm(away))
    reach = float(np.clip(distance, abs(first_m - second_m) * 1.001, (first_m + second_m) * 0.999))
    direction = away / distance
    along = (first_m**2 - second_m**2 + reach**2) / (2 * reach)
    lift = np.sqrt(max(first_m**2 - along**2, 0.0))
    side = bend - (bend @ direction) * direction
    side = side / np.linalg.norm(side)
    return start_m + along * direction + lift * side, start_m + reach * direction


@dataclass(frozen=True, slots=True, eq=False)
class Body:
    """The flesh on a skeleton, as solids for skin and clothes alike."""

    build: Build
    skeleton: Skeleton
    scale: float = field(init=False)
    lengths: Mapping[str, float] = field(init=False)

    def __post_init__(self) -> None:
        # Thickness follows stature, children a little rounder than scaled adults.
        scale = self.build.stature_m / 1.75 * (1.08 if self.build.child else 1.0)
        object.__setattr__(self, "scale", scale)
        object.__setattr__(self, "lengths", self.build.lengths_m())

    def joint(self, name: str) -> Array:
        """(3,) position of a joint [m]."""
        return self.skeleton.joints_m[name]

    def frame(self, name: str) -> Array:
        """(3, 3) axes of a segment: columns forward, left, up."""
        return self.skeleton.frames[name]

    def place(self, joint: str, frame: str, offset_m: tuple[float, float, float]) -> Array:
        """(3,) a point given in a segment's axes from a joint."""
        return np.asarray(self.joint(joint) + self.frame(frame) @ np.asarray(offset_m))

    def thigh(self, side: Side) -> Limb:
        """From hip to knee."""
        k = self.scale * self.build.girth * (1.03 if self._womanly() else 1.0)
        width = np.array([0.088, 0.085, 0.075, 0.060, 0.055]) * k
        depth = np.array([0.092, 0.090, 0.080, 0.064, 0.060]) * k
        return self._limb((f"hip_{side}", f"knee_{side}", f"thigh_{side}"), (0, 0.2, 0.5, 0.85, 1), width, depth)

    def shank(self, side: Side) -> Limb:
        """From knee to ankle, the calf behind."""
        k = self.scale * self.build.girth
        width = np.array([0.054, 0.050, 0.053, 0.045, 0.035, 0.036]) * k
        depth = np.array([0.059, 0.054, 0.058, 0.049, 0.037, 0.041]) * k
        offset = np.array([0.0, -0.006, -0.015, -0.012, -0.004, 0.0]) * k
        return self._limb(
            (f"knee_{side}", f"ankle_{side}", f"shank_{side}"), (0, 0.12, 0.3, 0.58, 0.86, 1), width, depth, offset
        )

    def upper_arm(self, side: Side) -> Limb:
        """From shoulder to elbow."""
        k = self.scale * self.build.girth * (0.88 if self._womanly() else 1.0)
        # The shoulder's landmark is the acromion, on top: the flesh rounds off towards it.
        width = np.array([0.035, 0.045, 0.047, 0.043, 0.037]) * k
        depth = np.array([0.040, 0.050, 0.051, 0.047, 0.040]) * k
        return self._limb((f"shoulder_{side}", f"elbow_{side}", f"upper_arm_{side}"), (0, 0.14, 0.34, 0.65, 1), width, depth)

    def forearm(self, side: Side) -> Limb:
        """From elbow to wrist."""
        k = self.scale * self.build.girth * (0.88 if self._womanly() else 1.0)
        width = np.array([0.037, 0.041, 0.034, 0.023]) * k
        depth = np.array([0.040, 0.042, 0.036, 0.029]) * k
        return self._limb((f"elbow_{side}", f"wrist_{side}", f"forearm_{side}"), (0, 0.25, 0.6, 1), width, depth)

    def trunk(self) -> list[Limb | Blob]:
        """Pelvis, belly, chest, and what slopes from neck to shoulders."""
        k = self.scale * self.build.girth
        if self._womanly():
            low_width, high_width = (0.165, 0.175, 0.160, 0.132), (0.132, 0.142, 0.150, 0.140, 0.100)
        else:
            low_width, high_width = (0.155, 0.166, 0.160, 0.148), (0.148, 0.160, 0.172, 0.160, 0.115)
        belly = 0.075 * self.build.belly
        low = self._limb(
            ("hips", "waist", "pelvis"),
            (0, 0.25, 0.62, 1),
            np.array(low_width) * k,
            np.array([0.112, 0.118, 0.108 + 0.6 * belly, 0.100 + belly]) * k,
            np.array([-0.016, -0.018, -0.002 + 0.6 * belly, 0.002 + belly]) * k,
        )
        high = self._limb(
            ("waist", "neck", "chest"),
            (0, 0.3, 0.6, 0.82, 1),
            np.array(high_width) * k,
            np.array([0.100 + belly, 0.110 + 0.5 * belly, 0.118, 0.098, 0.062]) * k,
            np.array([0.002 + belly, 0.004 + 0.5 * belly, 0.004, -0.008, -0.014]) * k,
        )
        return [low, high, *self._buttocks(), *self._shoulder_slopes(), *self._bust()]

    def neck(self) -> Limb:
        """From the trunk into the head."""
        k = self.scale * (0.045 if self._womanly() or self.build.child else 0.057)
        start = self.place("neck", "chest", (-0.01 * self.scale, 0.0, -0.03 * self.scale))
        head = self.lengths["head"] / 0.23
        end = self.place("chin", "head", (-0.018 * head, 0.0, 0.07 * head))
        return Limb(start, end, self.frame("head")[:, 0], (0, 0.5, 1), (1.25 * k, k, 0.97 * k), (1.2 * k, k, 1.02 * k))

    def _buttocks(self) -> list[Blob]:
        k = self.scale * self.build.girth
        return [
            ball(self.place(f"hip_{side}", "pelvis", (-0.055 * k, 0.0, 0.005 * k)), (0.083 if self._womanly() else 0.077) * k)
            for side in SIDES
        ]

    def _shoulder_slopes(self) -> list[Limb]:
        k = self.scale * np.sqrt(self.build.girth)
        narrow = 0.85 if self._womanly() else 1.0
        slopes: list[Limb] = []
        for side in SIDES:
            neck = self.place("neck", "chest", (-0.018 * k, 0.0, 0.012 * k))
            tip = self.joint(f"shoulder_{side}") + self.frame("chest") @ np.array([-0.004, 0.0, -0.004]) * k
            wide = np.array([0.050, 0.043, 0.036]) * k * narrow
            slopes.append(Limb(neck, tip, self.frame("chest")[:, 0], (0, 0.5, 1), _floats(0.9 * wide), _floats(1.15 * wide)))
        return slopes

    def _bust(self) -> list[Blob]:
        if not self._womanly():
            return []
        k = self.scale * self.build.girth
        centre = self.joint("waist") * 0.5 + self.joint("neck") * 0.5
        chest = self.frame("chest")
        return [
            blob(centre + chest @ np.array([0.082, s * 0.068, -0.012]) * k, np.array([0.056, 0.062, 0.064]) * k, chest)
            for s in (1.0, -1.0)
        ]

    def _womanly(self) -> bool:
        return self.build.sex == "f" and not self.build.child

    def _limb(
        self, bone: tuple[str, str, str], at: tuple[float, ...], width: Array, depth: Array, offset: Array | None = None
    ) -> Limb:
        start, end, frame = bone
        shift = () if offset is None else _floats(offset)
        return Limb(self.joint(start), self.joint(end), self.frame(frame)[:, 0], at, _floats(width), _floats(depth), shift)

    def hand(self, side: Side, curl_deg: float) -> list[list[Solid]]:
        """Palm and fingers, each finger a group of its own so that they stay apart."""
        k = self.lengths["hand"] / 0.189
        s = _sign(side)
        turn = self.frame(f"hand_{side}")

        def at(x: float, y: float, z: float) -> Array:
            return np.asarray(self.joint(f"wrist_{side}") + turn @ np.array([x, -s * y, z]) * k)

        palm = Limb(
            at(0, 0, 0.012),
            at(0, 0.002, -0.082),
            turn[:, 0],
            (0, 0.35, 1),
            _floats(np.array([0.019, 0.016, 0.012]) * k),
            _floats(np.array([0.027, 0.036, 0.038]) * k),
            cap_m=0.012 * k,
        )
        groups: list[list[Solid]] = [[palm]]
        for x, length, more in ((0.028, 0.072, 0), (0.010, 0.080, 3), (-0.009, 0.075, 6), (-0.027, 0.060, 9)):
            bend = np.deg2rad(curl_deg + more)
            base = np.array([x, 0.002, -0.084 + 0.25 * abs(x)])
            knuckle = base + 0.5 * length * np.array([0.05 * x / 0.03, np.sin(0.6 * bend), -np.cos(0.6 * bend)])
            tip = knuckle + 0.5 * length * np.array([0.0, np.sin(1.7 * bend), -np.cos(1.7 * bend)])
            groups.append([palm, *_finger(at(*base), at(*knuckle), at(*tip), turn[:, 0], 0.0088 * k)])
        thumb = (at(0.026, 0.006, -0.018), at(0.044, 0.020, -0.052), at(0.040, 0.026, -0.084))
        groups.append([palm, *_finger(*thumb, turn[:, 0], 0.0108 * k)])
        return groups

    def head(self) -> tuple[list[Solid], list[Solid]]:
        """What makes the head, and what is carved from it: eye sockets."""
        at, unit, turn = self._head_axes()
        young = 1.0 if self.build.child else 0.0
        jaw = 0.90 if self._womanly() else 1.0 - 0.12 * young

        def lump(centre: tuple[float, float, float], half_axes: tuple[float, float, float]) -> Solid:
            return blob(at(*centre), np.asarray(half_axes) * unit, turn)

        nose = Limb(
            at(0.088, 0, 0.124),
            at(0.111, 0, 0.085),
            turn[:, 0],
            (0, 0.6, 1),
            _floats(np.array([0.005, 0.007, 0.009]) * unit),
            _floats(np.array([0.008, 0.009, 0.009]) * unit),
        )
        solids = [
            lump((-0.004, 0, 0.146), (0.098, 0.077, 0.085)),
            lump((0.034, 0, 0.128), (0.060, 0.067, 0.070)),
            lump((0.030, 0, 0.078), (0.063, 0.061 * jaw, 0.062)),
            lump((0.044, 0, 0.048), (0.048, 0.046 * jaw, 0.040)),
            lump((0.074, 0, 0.024), (0.022, 0.026 * jaw, 0.020)),
            lump((0.076, 0, 0.133), (0.019, 0.050, 0.012)),
            lump((0.087, 0, 0.052), (0.011, 0.023, 0.007)),
            lump((0.086, 0, 0.038), (0.012, 0.020, 0.008)),
            nose,
            *(lump((0.058, s * 0.040, 0.088), (0.030, 0.024, 0.024)) for s in (1.0, -1.0)),
            *(lump((0.100, s * 0.010, 0.083), (0.009, 0.007, 0.006)) for s in (1.0, -1.0)),
        ]
        sockets = [lump((0.100, s * 0.032, 0.113), (0.012, 0.018, 0.0085)) for s in (1.0, -1.0)]
        return solids, sockets

    def ears(self) -> list[Solid]:
        """Both ears, hanging on the side of the head."""
        at, unit, turn = self._head_axes()
        return [
            blob(
                at(-0.008, s * 0.076, 0.105), np.array([0.019, 0.009, 0.031]) * unit, turn @ _turn("z", s * 24) @ _turn("y", 10)
            )
            for s in (1.0, -1.0)
        ]

    def eyes(self) -> list[Solid]:
        """Dark slits in the sockets: what eyes are from across a street."""
        at, unit, turn = self._head_axes()
        return [blob(at(0.0850, s * 0.032, 0.1125), np.array([0.0075, 0.0125, 0.0048]) * unit, turn) for s in (1.0, -1.0)]

    def brows(self) -> list[Limb]:
        """Eyebrows."""
        at, unit, turn = self._head_axes()
        thin = _floats(np.array([0.0045, 0.0045, 0.003]) * unit)
        return [
            Limb(at(0.0965, s * 0.014, 0.1285), at(0.0855, s * 0.048, 0.1305), turn[:, 0], (0, 0.5, 1), thin, thin)
            for s in (1.0, -1.0)
        ]

    def head_point(self, x: float, y: float, z: float) -> Array:
        """(3,) a point of the head given for an adult head 0.23 m high, from the chin's level."""
        return self._head_axes()[0](x, y, z)

    def head_unit(self) -> float:
        """Head size over an adult's 0.23 m."""
        return self.lengths["head"] / 0.231

    def _head_axes(self) -> tuple[_Placed, float, Array]:
        unit = self.head_unit()
        return _Placed(self.joint("chin"), self.frame("head"), unit), unit, self.frame("head")


@dataclass(frozen=True, slots=True, eq=False)
class _Placed:
    origin_m: Array
    turn: Array
    unit: float

    def __call__(self, x: float, y: float, z: float) -> Array:
        return np.asarray(self.origin_m + self.turn @ np.array([x, y, z]) * self.unit)


def _finger(base: Array, knuckle: Array, tip: Array, front: Array, radius_m: float) -> list[Solid]:
    thick = (1.05 * radius_m, radius_m)
    thin = (radius_m, 0.8 * radius_m)
    return [Limb(base, knuckle, front, (0, 1), thick, thick), Limb(knuckle, tip, front, (0, 1), thin, thin)]


def _floats(values: Array) -> tuple[float, ...]:
    return tuple(float(value) for value in values)
