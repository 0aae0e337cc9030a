"""Large bodies: box-like skins with rows of windows, cabs of lorries, and what hangs on them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fullwell.assets.starter.lofts import (
    Field,
    Line,
    Panels,
    ShellSpec,
    below,
    beyond,
    half_shell,
    intersection,
    outline_walls,
)
from fullwell.assets.starter.shapes import Shape, box, joined, loft, tube
from fullwell.assets.starter.vehicle_fittings import lamp_lens, number_plate, plate_text, rounded_box
from fullwell.assets.starter.vehicle_parts import PartList

__all__ = [
    "add_rear_lamps",
    "box_skin",
    "circle",
    "corrugated_box",
    "cut_well",
    "drum",
    "front_view",
    "heavy_mirror",
    "mudguard",
    "side_view",
    "under_run_bar",
]


def circle(x_m: float, z_m: float, radius_m: float) -> Field:
    """Return the inside of a circle in the side view."""
    return lambda patch: np.hypot(patch.x - x_m, patch.z - z_m) - radius_m


def side_view(x_m: tuple[float, float], z_m: tuple[float, float], *, y_m: float, radius_m: float = 0.05) -> Field:
    """Return a rounded rectangle in the side view, on what lies further out than `y_m`."""
    fields = (beyond("x", min(x_m)), below("x", max(x_m)), beyond("z", z_m[0]), below("z", z_m[1]), beyond("y", y_m))
    return intersection(fields, radius_m=radius_m)


def front_view(
    half_m: float, z_m: tuple[float, float], *, before_x_m: float, front: bool = True, radius_m: float = 0.06
) -> Field:
    """Return a rounded rectangle in the front (or rear) view, on what lies before (or behind) an x."""
    limit = beyond("x", before_x_m) if front else below("x", before_x_m)
    return intersection((below("y", half_m), beyond("z", z_m[0]), below("z", z_m[1]), limit), radius_m=radius_m)


def box_skin(
    x_m: tuple[float, float],
    width_m: float,
    z_m: tuple[float, float],
    *,
    powers: tuple[float, float] = (10.0, 14.0),
    nose: Sequence[float] = (0.10, 0.03, 0.0, 0.02, 0.06, 0.12, 0.20, 0.32),
    stern: Sequence[float] = (0.06, 0.02, 0.0, 0.0, 0.01, 0.03, 0.06, 0.12),
    crown_m: float = 0.05,
    columns: int = 96,
    bulges: tuple[tuple[float, float, float, float, float], ...] = (),
) -> Panels:
    """Return the left half of a long rounded box from x_m[0] (rear) to x_m[1] (front), as `body` and `underside`."""
    levels = (0.0, 0.05, 0.25, 0.55, 0.82, 0.93, 0.98, 1.0)
    side = (0.05, 0.01, 0.0, 0.0, 0.015, 0.035, 0.08, 0.17)
    reach = (x_m[1] - x_m[0]) / 2
    skin, under = half_shell(
        ShellSpec(
            centre_x_m=(x_m[0] + x_m[1]) / 2,
            front_m=reach,
            rear_m=reach,
            half_width_m=width_m / 2,
            low=Line(((0.0, z_m[0]),)),
            high=Line(((0.0, z_m[1]),)),
            crown_m=crown_m,
            profile=tuple(zip(levels, side, nose, stern, strict=True)),
            front_power=powers[0],
            rear_power=powers[1],
            columns=columns,
            levels=16,
            across=4,
            bulges=bulges,
        )
    )
    panels = Panels()
    panels.add("body", skin)
    panels.add("underside", under)
    return panels


def cut_well(
    panels: Panels,
    x_m: float,
    z_m: float,
    radius_m: float,
    *,
    inner_y_m: float,
    floor_m: float,
    names: Sequence[str] = ("body",),
) -> None:
    """Cut a wheel arch from the left half and line it: `wheel_well` gets the walls."""
    hole = circle(x_m, z_m, radius_m)
    for name in (*names, "underside"):
        panels.cut(name, "\0side", beyond("y", inner_y_m), edge_m=1.0)
        panels.cut("\0side", "\0hole", hole, edge_m=0.04)
        panels.add(name, *panels.patches.pop("\0side", []))
    panels.add_loose("wheel_well", *outline_walls(panels.patches.pop("\0hole", []), hole, inner_y_m))
    dip = np.arcsin(np.clip((floor_m - z_m) / radius_m, -1.0, 1.0))
    angle = np.linspace(dip, np.pi - dip, 32)
    reach = radius_m + 0.004
    rim = np.stack([x_m + reach * np.cos(angle), np.full(32, inner_y_m), z_m + reach * np.sin(angle)], axis=1)
    here = np.arange(31)
    faces = np.stack([here + 1, here, np.full(31, 32)], axis=1)
    panels.add_loose("wheel_well", Shape(np.concatenate([rim, [[x_m, inner_y_m, floor_m]]]), faces))


def corrugated_box(
    x_m: tuple[float, float], width_m: float, z_m: tuple[float, float], *, pitch_m: float = 0.278, depth_m: float = 0.036
) -> Shape:
    """Return a closed box with trapezoid corrugations on its long sides; sharp edges."""
    count = int((x_m[1] - x_m[0] - 0.2) / pitch_m)
    start = (x_m[0] + x_m[1]) / 2 - count * pitch_m / 2
    side = [(x_m[0], width_m / 2)]
    for number in range(count):
        at = start + number * pitch_m
        side += [
            (at + share * pitch_m, width_m / 2 - sunk)
            for share, sunk in ((0.0, 0.0), (0.25, depth_m), (0.5, depth_m), (0.75, 0.0))
        ]
    side.append((x_m[1], width_m / 2))
    right = [(x, -y) for x, y in side]
    ring = np.array(right + side[::-1])
    levels = [np.column_stack([ring, np.full(len(ring), z)]) for z in z_m]
    return loft(levels)


def drum(length_m: float, radius_m: float, *, sides: int = 24) -> Shape:
    """Return a tank along x with rounded ends, centred."""
    ends = ((-0.5, 0.5), (-0.485, 0.85), (-0.46, 0.97), (-0.42, 1.0), (0.42, 1.0), (0.46, 0.97), (0.485, 0.85), (0.5, 0.5))
    angle = np.arange(sides) * (2 * np.pi / sides)
    rings = [
        np.stack([np.full(sides, at * length_m), share * radius_m * np.cos(angle), share * radius_m * np.sin(angle)], axis=-1)
        for at, share in ends
    ]
    return loft(rings).smooth(40)


def mudguard(
    radius_m: float, width_m: float, *, start_deg: float = 20.0, stop_deg: float = 160.0, thick_m: float = 0.012
) -> Shape:
    """Return a bent sheet over a wheel about the origin (axle along y); angles from +x upwards."""
    angle = np.deg2rad(np.linspace(start_deg, stop_deg, 18))
    rings = []
    for turn in angle:
        out = np.array([np.cos(turn), 0.0, np.sin(turn)])
        rings.append(
            [
                (radius_m + r) * out + np.array([0.0, y, 0.0])
                for r, y in ((thick_m, -width_m / 2), (thick_m, width_m / 2), (0.0, width_m / 2), (0.0, -width_m / 2))
            ]
        )
    return loft(rings).smooth(30)


def heavy_mirror(height_m: float = 0.5, width_m: float = 0.2, *, reach_m: float = 0.3) -> tuple[Shape, Shape, Shape]:
    """Return housing, arms and glass of a lorry's or bus's left mirror; its foot at the origin, `reach_m` outwards in all."""
    y = reach_m - width_m / 2
    housing = rounded_box((0.11, width_m, height_m), 0.05, centre_m=(0.02, y, -0.05))
    glass = box((0.004, width_m * 0.84, height_m * 0.86), centre_m=(-0.035, y, -0.05))
    upper, lower = height_m / 2 - 0.09, -height_m / 2 - 0.01
    top = tube([(-0.10, -0.05, upper + 0.04), (-0.02, 0.3 * y, upper + 0.05), (0.02, y, upper)], 0.016)
    low = tube([(-0.10, -0.05, lower), (-0.02, 0.3 * y, lower - 0.01), (0.02, y, lower + 0.03)], 0.016)
    return housing, joined([top, low]), glass


def under_run_bar(width_m: float, *, height_m: float = 0.13) -> Shape:
    """Return a rear under-run bar, centred."""
    return rounded_box((0.1, width_m, height_m), 0.02, steps=2)


def add_rear_lamps(
    parts: PartList,
    x_m: float,
    y_m: float,
    z_m: float,
    *,
    rng: np.random.Generator | None,
    size_m: tuple[float, float] = (0.44, 0.13),
) -> None:
    """Add a cluster on the left rear and its mirror image, facing backwards; with `rng`, a number plate between them."""
    wide, tall = size_m
    parts.add_both(
        "lamp_housing", "plastic/black", rounded_box((0.06, wide + 0.03, tall + 0.03), 0.015, centre_m=(x_m + 0.03, y_m, z_m))
    )
    cells = (("taillight", -0.375), ("brakelight", -0.125), ("indicator_rear", 0.375), ("reverselight", 0.125))
    lamps = {
        "taillight": "lamp/tail",
        "brakelight": "lamp/brake",
        "indicator_rear": "lamp/indicator",
        "reverselight": "lamp/reverse",
    }
    for name, share in cells:
        lens = lamp_lens(wide / 4 * 0.92, tall * 0.9).turned("z", 180).moved(x_m, y_m + share * wide, z_m)
        parts.add_pair(name, lamps[name], lens)
    if rng is not None:
        parts.add("plate_rear", "sign/white", number_plate().turned("z", 180).moved(x_m, 0.0, z_m))
        parts.add("plate_text", "plastic/black", plate_text(rng).turned("z", 180).moved(x_m, 0.0, z_m))
        parts.add("plate_holders", "plastic/black", box((0.02, 0.54, 0.13), centre_m=(x_m + 0.0101, 0.0, z_m)))
