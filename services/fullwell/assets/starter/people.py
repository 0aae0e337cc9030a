"""Pedestrians: bodies by stature and age, posed, dressed, with what they carry."""

from __future__ import annotations

from dataclasses import replace
from typing import Final, Literal

import numpy as np

from fullwell.assets.starter.belongings import belongings
from fullwell.assets.starter.bodies import ArmPose, Body, Build, LegPose, Pose, posed, running, standing, walking
from fullwell.assets.starter.building import BuiltAsset, BuiltPart, StarterEntry
from fullwell.assets.starter.clothing import Outfit, dressed
from fullwell.assets.starter.headwear import headwear
from fullwell.assets.starter.shapes import Shape

__all__ = ["PEOPLE", "pedestrian", "settled"]


def pedestrian(
    rng: np.random.Generator,
    *,
    stature_m: float,
    sex: Literal["f", "m"],
    posture: str,
    phase: float = 0.0,
    child: bool = False,
    girth: float = 1.0,
    belly: float = 0.0,
    stoop: float = 0.0,
    skin: str = "light",
    head: str = "short",
    head_colour: str = "hair/brown",
    top: str = "shirt",
    top_colour: str = "cloth/white",
    bottom: str = "straight",
    bottom_colour: str = "cloth/denim",
    shoes: str = "shoes",
    shoes_colour: str = "leather/black",
    sole_colour: str = "rubber/tyre",
    skirt: float = 0.5,
    vest: str = "",
    collar: bool = False,
    hood: bool = False,
    scarf: str = "",
    carries: str = "",
    carries_colour: str = "leather/brown",
    tags: tuple[str, ...] = (),
) -> BuiltAsset:
    """Return a person.

    Parameters
    ----------
    posture
        "standing", "walking", "running", "folded_arms", "phone", "pram", "cane", "umbrella", "hands_in_pockets", "waving" or
        "sitting".
    phase
        Of the stride, for walking and running: the left foot lands at 0.
    stoop
        Added bend of the upper back [deg], the elderly.
    head, head_colour
        Hair or hat, see `clothing.headwear`.

    Other parameters are those of `Build` and `Outfit`.
    """
    build = Build(stature_m, sex, child, girth, belly)
    pose = _varied(_pose(posture, phase), rng)
    pose = replace(pose, stoop=pose.stoop + stoop, nod=pose.nod - 0.5 * stoop)
    body = Body(build, posed(build, pose))
    outfit = Outfit(top, top_colour, bottom, bottom_colour, shoes, shoes_colour, sole_colour, skirt, vest, collar, hood, scarf)
    brows = head_colour if head_colour.startswith("hair/") else "hair/grey" if "elderly" in tags else "hair/brown"
    parts = dressed(body, outfit, (f"skin/{skin}", brows), (pose.arms[0].curl, pose.arms[1].curl), rng)
    parts += headwear(body, head, head_colour, rng)
    if carries:
        parts += belongings(body, carries, carries_colour)
    eye = body.head_point(0.09, 0.0, 0.1125)[2]
    return settled(
        "pedestrian",
        (
            "child" if child else "adult",
            {"f": "woman", "m": "man"}[sex] if not child else {"f": "girl", "m": "boy"}[sex],
            *tags,
        ),
        parts,
        {"stature_m": stature_m, "posture": pose.name, "stride_phase": pose.phase},
        eye_m=float(eye),
    )


def settled(
    asset_class: str,
    tags: tuple[str, ...],
    parts: list[BuiltPart],
    attributes: dict[str, float | str],
    *,
    eye_m: float | None = None,
) -> BuiltAsset:
    """Return parts as an asset whose lowest vertex stands on z = 0; `eye_m` is the eyes' height in the parts' coordinates."""
    low = min(float(part.shape.vertices_m[:, 2].min()) for part in parts)
    if eye_m is not None:
        attributes = attributes | {"eye_height_m": round(eye_m - low, 3)}
    grounded = tuple(replace(part, shape=_rounded(part.shape.moved(z_m=-low))) for part in parts)
    return BuiltAsset(asset_class, tags, grounded, attributes)


def _rounded(shape: Shape) -> Shape:
    # A hundredth of a millimetre: the last bits of a sum differ between instruction sets, digests must not.
    return replace(shape, vertices_m=np.round(shape.vertices_m, 5))


def _varied(pose: Pose, rng: np.random.Generator) -> Pose:
    """Nobody stands or swings quite like another."""
    arms = tuple(
        replace(
            arm,
            flex=arm.flex + rng.normal(0, 2.0),
            abduct=arm.abduct + abs(rng.normal(0, 1.0)),
            elbow=arm.elbow + rng.normal(0, 3.0),
        )
        for arm in pose.arms
    )
    if pose.name in _PLACED_HANDS:
        arms = pose.arms
    return replace(pose, arms=(arms[0], arms[1]), look=pose.look + rng.normal(0, 5.0), nod=pose.nod + rng.normal(0, 2.0))


_PLACED_HANDS: Final = ("folded_arms", "phone", "pram", "cane", "umbrella")


def _pose(posture: str, phase: float) -> Pose:
    if posture == "walking":
        return walking(phase)
    if posture == "running":
        return running(phase)
    if posture == "folded_arms":
        left = ArmPose(flex=24.0, abduct=6.0, turn_in=58.0, elbow=98.0, curl=20.0)
        right = ArmPose(flex=30.0, abduct=8.0, turn_in=62.0, elbow=88.0, curl=20.0)
        return standing(arms=(left, right), name=posture)
    if posture == "phone":
        right = ArmPose(flex=22.0, abduct=8.0, turn_in=28.0, elbow=112.0, twist=-60.0, curl=35.0)
        return standing(arms=(ArmPose(), right), nod=22.0, name=posture)
    if posture == "pram":
        arm = ArmPose(flex=20.0, abduct=6.0, turn_in=8.0, elbow=52.0, twist=70.0, curl=75.0)
        stride = walking(0.14, vigour=0.55)
        return replace(stride, arms=(arm, arm), chest_turn=-stride.pelvis_turn, nod=9.0, name=posture)
    if posture == "cane":
        right = ArmPose(flex=14.0, abduct=8.0, turn_in=5.0, elbow=34.0, twist=60.0, curl=70.0)
        stride = walking(0.08, vigour=0.6)
        return replace(stride, arms=(stride.arms[0], right), name=posture)
    if posture == "umbrella":
        right = ArmPose(flex=26.0, abduct=8.0, turn_in=14.0, elbow=118.0, curl=80.0)
        return replace(walking(phase), arms=(walking(phase).arms[0], right), name=posture)
    if posture == "hands_in_pockets":
        arm = ArmPose(flex=-8.0, abduct=20.0, turn_in=46.0, elbow=42.0, curl=30.0)
        return standing(arms=(arm, arm), name=posture)
    if posture == "waving":
        right = ArmPose(flex=150.0, abduct=22.0, turn_in=10.0, elbow=38.0, curl=8.0)
        return standing(arms=(ArmPose(), right), look=-14.0, name=posture)
    if posture == "sitting":
        leg = LegPose(hip=86.0, abduct=5.0, knee=88.0, ankle=2.0, turn_out=4.0)
        arm = ArmPose(flex=26.0, abduct=8.0, turn_in=24.0, elbow=46.0, curl=20.0)
        return Pose((leg, replace(leg, knee=80.0)), (arm, arm), lean=-2.0, stoop=8.0, name=posture)
    return standing()


def _entry(name: str, title: str, seed: int, tags: tuple[str, ...], **parameters: object) -> StarterEntry:
    return StarterEntry(name, title, pedestrian, {**parameters, "tags": tags}, seed)


PEOPLE: Final = (
    _entry(
        "woman-walking-01",
        "Woman walking, red jacket, jeans and a handbag",
        101,
        ("walking",),
        stature_m=1.68,
        sex="f",
        posture="walking",
        phase=0.02,
        skin="light",
        head="long",
        head_colour="hair/brown",
        top="jacket",
        top_colour="cloth/red",
        collar=True,
        bottom="slim",
        bottom_colour="cloth/denim",
        shoes="boots",
        shoes_colour="leather/brown",
        carries="handbag",
        carries_colour="leather/black",
    ),
    _entry(
        "woman-walking-02",
        "Woman walking, yellow summer dress",
        102,
        ("walking", "summer"),
        stature_m=1.62,
        sex="f",
        posture="walking",
        phase=0.30,
        skin="dark",
        head="curly",
        head_colour="hair/black",
        top="dress",
        top_colour="cloth/yellow",
        bottom="none",
        skirt=0.62,
        shoes="trainers",
        shoes_colour="cloth/white",
        sole_colour="plastic/white",
    ),
    _entry(
        "woman-standing-01",
        "Woman waiting, navy coat and scarf",
        103,
        ("standing", "winter"),
        stature_m=1.71,
        sex="f",
        posture="hands_in_pockets",
        skin="light",
        head="bob",
        head_colour="hair/blond",
        top="coat",
        top_colour="cloth/navy",
        collar=True,
        bottom="slim",
        bottom_colour="cloth/black",
        skirt=0.58,
        shoes="boots",
        scarf="cloth/beige",
    ),
    _entry(
        "woman-phone-01",
        "Woman looking at a phone, headscarf and long skirt",
        104,
        ("standing", "phone"),
        stature_m=1.60,
        sex="f",
        posture="phone",
        skin="medium",
        head="headscarf",
        head_colour="cloth/beige",
        top="shirt",
        top_colour="cloth/white",
        bottom="skirt",
        bottom_colour="cloth/green",
        skirt=0.86,
        carries="phone",
        carries_colour="plastic/black",
    ),
    _entry(
        "woman-umbrella-01",
        "Woman walking under an umbrella",
        105,
        ("walking", "rain"),
        stature_m=1.66,
        sex="f",
        posture="umbrella",
        phase=0.52,
        skin="light",
        head="bun",
        head_colour="hair/black",
        top="coat",
        top_colour="cloth/beige",
        collar=True,
        bottom="slim",
        bottom_colour="cloth/black",
        skirt=0.45,
        shoes="boots",
        carries="umbrella",
        carries_colour="cloth/red",
    ),
    _entry(
        "woman-pram-01",
        "Woman pushing a pram",
        106,
        ("walking", "pram"),
        stature_m=1.69,
        sex="f",
        posture="pram",
        skin="medium",
        head="ponytail",
        head_colour="hair/brown",
        top="sweater",
        top_colour="cloth/grey",
        bottom="slim",
        bottom_colour="cloth/black",
        shoes="trainers",
        shoes_colour="cloth/white",
        sole_colour="plastic/white",
        carries="pram",
        carries_colour="cloth/navy",
    ),
    _entry(
        "man-walking-01",
        "Man walking, shirt and trousers",
        111,
        ("walking",),
        stature_m=1.80,
        sex="m",
        posture="walking",
        phase=0.10,
        skin="light",
        head="short",
        head_colour="hair/brown",
        top="shirt",
        top_colour="cloth/white",
        collar=True,
        bottom="straight",
        bottom_colour="cloth/navy",
        shoes_colour="leather/brown",
    ),
    _entry(
        "man-walking-02",
        "Man walking with a backpack, hooded sweater",
        112,
        ("walking", "backpack"),
        stature_m=1.76,
        sex="m",
        posture="walking",
        phase=0.70,
        skin="dark",
        head="crop",
        head_colour="hair/black",
        top="sweater",
        top_colour="cloth/green",
        hood=True,
        bottom="straight",
        bottom_colour="cloth/denim",
        shoes="trainers",
        shoes_colour="cloth/white",
        sole_colour="plastic/white",
        carries="backpack",
        carries_colour="cloth/black",
    ),
    _entry(
        "man-standing-01",
        "Man standing with folded arms, T-shirt",
        113,
        ("standing",),
        stature_m=1.85,
        sex="m",
        girth=1.06,
        belly=0.35,
        posture="folded_arms",
        skin="medium",
        head="short",
        head_colour="hair/black",
        top="tshirt",
        top_colour="cloth/black",
        bottom="straight",
        bottom_colour="cloth/beige",
        shoes="trainers",
        shoes_colour="cloth/grey",
        sole_colour="plastic/white",
    ),
    _entry(
        "man-running-01",
        "Man running, shorts and T-shirt",
        114,
        ("running", "sport"),
        stature_m=1.78,
        sex="m",
        girth=0.95,
        posture="running",
        phase=0.40,
        skin="light",
        head="cap",
        head_colour="cloth/white",
        top="tshirt",
        top_colour="cloth/red",
        bottom="shorts",
        bottom_colour="cloth/black",
        shoes="trainers",
        shoes_colour="cloth/hi_vis_orange",
        sole_colour="plastic/white",
    ),
    _entry(
        "man-worker-01",
        "Road worker in a high-visibility vest",
        115,
        ("standing", "worker", "hi_vis"),
        stature_m=1.79,
        sex="m",
        girth=1.08,
        belly=0.3,
        posture="waving",
        skin="medium",
        head="beanie",
        head_colour="cloth/black",
        top="sweater",
        top_colour="cloth/navy",
        bottom="wide",
        bottom_colour="cloth/grey",
        shoes="boots",
        shoes_colour="leather/brown",
        vest="cloth/hi_vis_orange",
    ),
    _entry(
        "man-coat-01",
        "Man walking in a black coat with a shopping bag",
        116,
        ("walking", "winter"),
        stature_m=1.83,
        sex="m",
        posture="walking",
        phase=0.55,
        skin="deep",
        head="crop",
        head_colour="hair/black",
        top="coat",
        top_colour="cloth/black",
        collar=True,
        bottom="straight",
        bottom_colour="cloth/grey",
        skirt=0.50,
        carries="shopping_bag",
        carries_colour="cloth/white",
    ),
    _entry(
        "elderly-man-01",
        "Elderly man with a cane",
        121,
        ("walking", "elderly", "cane"),
        stature_m=1.70,
        sex="m",
        girth=1.02,
        belly=0.5,
        stoop=15.0,
        posture="cane",
        skin="light",
        head="fringe",
        head_colour="hair/grey",
        top="jacket",
        top_colour="cloth/brown",
        collar=True,
        bottom="straight",
        bottom_colour="cloth/grey",
        carries="cane",
        carries_colour="wood/oak",
    ),
    _entry(
        "elderly-woman-01",
        "Elderly woman in a sun hat",
        122,
        ("standing", "elderly"),
        stature_m=1.56,
        sex="f",
        girth=1.08,
        belly=0.4,
        stoop=12.0,
        posture="standing",
        skin="light",
        head="sun_hat",
        head_colour="cloth/beige",
        top="shirt",
        top_colour="cloth/red",
        collar=True,
        bottom="skirt",
        bottom_colour="cloth/navy",
        skirt=0.66,
    ),
    _entry(
        "girl-walking-01",
        "Girl of about seven walking with a school bag",
        131,
        ("walking", "school"),
        stature_m=1.22,
        sex="f",
        child=True,
        posture="walking",
        phase=0.05,
        skin="light",
        head="ponytail",
        head_colour="hair/blond",
        top="tshirt",
        top_colour="cloth/yellow",
        bottom="skirt",
        bottom_colour="cloth/denim",
        skirt=0.48,
        shoes="trainers",
        shoes_colour="cloth/red",
        sole_colour="plastic/white",
        carries="backpack",
        carries_colour="cloth/red",
    ),
    _entry(
        "boy-running-01",
        "Boy of about nine running",
        132,
        ("running",),
        stature_m=1.35,
        sex="m",
        child=True,
        posture="running",
        phase=0.90,
        skin="medium",
        head="short",
        head_colour="hair/black",
        top="tshirt",
        top_colour="cloth/green",
        bottom="shorts",
        bottom_colour="cloth/navy",
        shoes="trainers",
        shoes_colour="cloth/white",
        sole_colour="plastic/white",
    ),
    _entry(
        "toddler-standing-01",
        "Small child of about four, hooded jacket",
        133,
        ("standing",),
        stature_m=1.03,
        sex="m",
        child=True,
        girth=1.06,
        posture="standing",
        skin="light",
        head="beanie",
        head_colour="cloth/red",
        top="jacket",
        top_colour="cloth/yellow",
        hood=True,
        bottom="straight",
        bottom_colour="cloth/navy",
        shoes="boots",
        shoes_colour="cloth/green",
    ),
    _entry(
        "teenager-phone-01",
        "Teenage girl with a phone",
        134,
        ("standing", "phone", "teenager"),
        stature_m=1.48,
        sex="f",
        child=True,
        posture="phone",
        skin="dark",
        head="long",
        head_colour="hair/black",
        top="sweater",
        top_colour="cloth/white",
        hood=True,
        bottom="wide",
        bottom_colour="cloth/denim",
        shoes="trainers",
        shoes_colour="cloth/black",
        sole_colour="plastic/white",
        carries="phone",
        carries_colour="plastic/black",
    ),
)
"""Pedestrians of the starter library."""
