"""The grammar of facades: walls with openings, windows, doors, shop fronts, garage doors, balconies and mouldings.

Everything is drawn on a facade that faces +x in the plane x = 0, centred on y = 0 (seen from the street, +y is to the
right), standing on z = 0; who uses it turns and shifts it. Window panes are single opaque sheets of dark glass, so that the
inside of a building costs no triangles; what is lit at night are the panes themselves.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from fullwell.assets.starter.assembly import Assembly, boxes, quads, span
from fullwell.assets.starter.shapes import Shape, cylinder, joined, loft

__all__ = [
    "Balcony",
    "Facade",
    "Opening",
    "PaneLots",
    "WindowLook",
    "courses",
    "moulding",
    "solid_spans",
    "wall",
]

Array = NDArray[np.float64]

PANE_GROUPS = 6
"""Dark panes are dealt out to so many parts, so that a recipe can light any share of a facade by part name."""

SHEET_M = 0.004
"""Layers that lie on each other are at least this far apart: float32 at 1 km resolves 0.06 mm, a depth image less."""


@dataclass(frozen=True, slots=True)
class Opening:
    """A rectangle cut out of a facade [m]."""

    left_m: float
    right_m: float
    bottom_m: float
    top_m: float

    @property
    def width_m(self) -> float:
        """Along the facade."""
        return self.right_m - self.left_m

    @property
    def height_m(self) -> float:
        """Upwards."""
        return self.top_m - self.bottom_m


@dataclass(frozen=True, slots=True)
class WindowLook:
    """How the windows of a facade are made.

    Attributes
    ----------
    recess_m
        From the wall's face to the glass; 0.12 to 0.25 in masonry.
    columns, transom
        Casements side by side; height of a transom as a fraction of the opening, 0 for none.
    bars
        Glazing bars across each casement.
    frame_material, frame_m
        Of the frame and its members, seen from the front.
    sill_m, surround_m
        How far the sill and the surround stand out; 0 for none.
    head
        What is above: nothing, a plain lintel, a pediment on brackets, or a course of upright bricks.
    shutters
        None, hinged leaves beside the window, or a roller blind in a box, drawn down by chance.
    curtains
        Share of windows with drawn-back curtains or a blind behind them.
    """

    recess_m: float = 0.16
    columns: int = 2
    transom: float = 0.0
    bars: int = 0
    frame_material: str = "wood/painted_white"
    frame_m: float = 0.06
    sill_m: float = 0.06
    surround_m: float = 0.0
    head: Literal["none", "lintel", "pediment", "soldier"] = "none"
    shutters: Literal["none", "hinged", "roller"] = "none"
    shutter_material: str = "coating/green"
    trim_material: str = "stone/limestone"
    soldier_material: str = "brick/dark"
    curtains: float = 0.35


class PaneLots:
    """Deals windows out to pane parts: lit warm, lit cool, or one of the dark groups."""

    def __init__(self, rng: np.random.Generator, *, warm: float = 0.16, cool: float = 0.07) -> None:
        self._rng, self._warm, self._cool = rng, warm, cool

    def draw(self) -> tuple[str, str]:
        """Return part and material of the next window."""
        lot = self._rng.random()
        if lot < self._warm:
            return "lit_windows_warm", "lamp/window_warm"
        if lot < self._warm + self._cool:
            return "lit_windows_cool", "lamp/window_cool"
        return f"panes_{1 + int(self._rng.integers(PANE_GROUPS)):02d}", "glass/window"


@dataclass(frozen=True, slots=True)
class Balcony:
    """A slab in front of a window, with a railing of bars or of panels [m]."""

    depth_m: float = 1.1
    railing: Literal["bars", "panels", "stone"] = "bars"
    panel_material: str = "coating/white"
    slab_material: str = "concrete/light"


def wall(width_m: float, bottom_m: float, top_m: float, openings: Sequence[Opening] = ()) -> Shape:
    """Return the face of a wall around its openings, which may not overlap."""
    half = width_m / 2
    levels = sorted({bottom_m, top_m, *(z for o in openings for z in (o.bottom_m, o.top_m) if bottom_m < z < top_m)})
    faces = []
    for low, high in itertools.pairwise(levels):
        cut = sorted((o.left_m, o.right_m) for o in openings if o.bottom_m < high - 1e-9 and o.top_m > low + 1e-9)
        edges = [-half, *(edge for pair in cut for edge in pair), half]
        for left, right in zip(edges[::2], edges[1::2], strict=True):
            if right - left > 1e-6:
                faces.append([(0, left, low), (0, right, low), (0, right, high), (0, left, high)])
    return quads(faces)


def reveal(opening: Opening, depth_m: float) -> Shape:
    """Return the four inner faces of an opening: sill, head and jambs."""
    left, right, low, high, deep = opening.left_m, opening.right_m, opening.bottom_m, opening.top_m, -depth_m
    return quads(
        [
            [(0, left, low), (0, right, low), (deep, right, low), (deep, left, low)],
            [(deep, left, high), (deep, right, high), (0, right, high), (0, left, high)],
            [(0, left, low), (deep, left, low), (deep, left, high), (0, left, high)],
            [(0, right, low), (0, right, high), (deep, right, high), (deep, right, low)],
        ]
    )


def moulding(width_m: float, depth_m: float, profile_m: Sequence[tuple[float, float]]) -> Shape:
    """Return a moulding around a rectangular building: (n, 2) points (standing out, z) from the bottom up, mitred."""
    rings = []
    for out, z in profile_m:
        x, y = depth_m / 2 + out, width_m / 2 + out
        rings.append([(x, -y, z), (x, y, z), (-x, y, z), (-x, -y, z)])
    return loft(np.array(rings), caps=False)


@dataclass(eq=False)
class Facade:
    """One side of a building under construction: parts are added to `assembly`, openings are remembered for the wall."""

    width_m: float
    look: WindowLook
    panes: PaneLots
    rng: np.random.Generator
    wall_part: str = "walls"
    wall_material: str = "plaster/cream"
    assembly: Assembly = field(default_factory=Assembly)
    openings: list[Opening] = field(default_factory=list)

    def close(self, bottom_m: float, top_m: float) -> None:
        """Draw the wall of a band around the openings made in it so far, and forget them."""
        self.assembly.add(self.wall_part, self.wall_material, wall(self.width_m, bottom_m, top_m, self.openings))
        self.openings.clear()

    def cut(self, opening: Opening, depth_m: float) -> None:
        """Remember an opening and draw its reveals in the wall's material."""
        self.openings.append(opening)
        self.assembly.add(self.wall_part, self.wall_material, reveal(opening, depth_m))

    # -- windows ------------------------------------------------------------------------------------------------------

    def window(self, opening: Opening, look: WindowLook | None = None, *, sill: bool = True) -> None:
        """Draw a window of the facade's look, or another one."""
        look = look or self.look
        self.cut(opening, look.recess_m)
        part, material = self.panes.draw()
        casements, members = _casements(opening, look)
        self.assembly.add(part, material, self.glass(casements, -look.recess_m))
        self.assembly.add("window_frames", look.frame_material, _frames(members, -look.recess_m))
        if self.rng.random() < look.curtains and not part.startswith("lit_"):
            self._curtain(opening, look)
        if sill and look.sill_m > 0:
            low = (-look.recess_m, opening.left_m - 0.05, opening.bottom_m - 0.07)
            self.assembly.add(
                "sills", look.trim_material, span(low, (look.sill_m, opening.right_m + 0.05, opening.bottom_m + 0.012))
            )
        self._surround(opening, look)
        self._shutters(opening, look)

    def glass(self, casements: Array, x_m: float) -> Shape:
        # No two panes of a real facade lie in one plane; a sixth of a degree is what makes their reflections differ.
        left, right, low, high = casements.T
        tilt = np.clip(self.rng.normal(0.0, 0.003, (len(casements), 2)), -0.005, 0.005)
        across, up = tilt[:, 0] * (right - left) / 2, tilt[:, 1] * (high - low) / 2
        corners = np.stack(
            [
                np.stack([x_m - across - up, left, low], axis=1),
                np.stack([x_m + across - up, right, low], axis=1),
                np.stack([x_m + across + up, right, high], axis=1),
                np.stack([x_m - across + up, left, high], axis=1),
            ],
            axis=1,
        )
        return quads(corners)

    def _curtain(self, opening: Opening, look: WindowLook) -> None:
        """A blind drawn down some way, or two curtains drawn aside, just in front of the opaque pane that hides the room."""
        x = -look.recess_m + 0.016
        margin = look.frame_m * 0.5
        left, right = opening.left_m + margin, opening.right_m - margin
        low, high = opening.bottom_m + margin, opening.top_m - margin
        if self.rng.random() < 0.5:
            drop = self.rng.uniform(0.2, 0.65) * (high - low)
            strips = [(left, right, high - drop, high)]
        else:
            wide = self.rng.uniform(0.12, 0.24) * (right - left)
            strips = [(left, left + wide, low, high), (right - wide, right, low, high)]
        corners = [[(x, a, c), (x, b, c), (x, b, d), (x, a, d)] for a, b, c, d in strips]
        self.assembly.add("curtains", "coating/grey", quads(corners))

    def _surround(self, opening: Opening, look: WindowLook) -> None:
        left, right, low, high = opening.left_m, opening.right_m, opening.bottom_m, opening.top_m
        if look.surround_m > 0:
            wide, out = 0.15, look.surround_m
            self.assembly.add(
                "surrounds",
                look.trim_material,
                boxes(
                    [(0.0, left - wide, low), (0.0, right, low), (0.0, left - wide, high)],
                    [(out, left, high), (out, right + wide, high), (out + 0.004, right + wide, high + wide)],
                ),
            )
        base = high + (0.15 if look.surround_m > 0 else 0.0)
        if look.head == "lintel":
            self.assembly.add("lintels", look.trim_material, span((0.0, left - 0.12, high), (0.03, right + 0.12, high + 0.22)))
        elif look.head == "soldier":
            self.assembly.add("lintels", look.soldier_material, _soldier_course(left - 0.1, right + 0.1, high))
        elif look.head == "pediment":
            self.assembly.add("pediments", look.trim_material, *_pediment(left - 0.22, right + 0.22, base))

    def _shutters(self, opening: Opening, look: WindowLook) -> None:
        left, right, low, high = opening.left_m, opening.right_m, opening.bottom_m, opening.top_m
        if look.shutters == "hinged":
            wide = min(opening.width_m / 2, 0.62)
            gap = 0.04 + (0.15 if look.surround_m > 0 else 0.0)
            for start in (left - wide - gap, right + gap):
                self.assembly.add("shutters", look.shutter_material, _louvred_leaf(start, start + wide, low, high))
        elif look.shutters == "roller":
            self.assembly.add(
                "shutter_boxes", "plastic/white", span((-0.1, left + 0.002, high - 0.16), (0.014, right - 0.002, high - 0.002))
            )
            if self.rng.random() < 0.45:
                drop = self.rng.choice([0.15, 0.35, 0.55, 0.8]) * (opening.height_m - 0.16)
                count = max(int(drop / 0.05), 1)
                tops = high - 0.16 - 0.05 * np.arange(count)
                low_corners = np.column_stack([np.full(count, -0.06), np.full(count, left + 0.02), tops - 0.046])
                high_corners = np.column_stack([np.full(count, -0.045), np.full(count, right - 0.02), tops])
                self.assembly.add("shutters", look.shutter_material, boxes(low_corners, high_corners))

    # -- doors and shops ----------------------------------------------------------------------------------------------

    def door(self, opening: Opening, *, material: str = "wood/oak", leaves: int = 1, fanlight_m: float = 0.45) -> None:
        """Draw a panelled door under a fanlight, with a step; its opening stands on the ground."""
        recess, frame = 0.22, 0.07
        self.cut(opening, recess)
        left, right = opening.left_m + frame, opening.right_m - frame
        low, high = opening.bottom_m, opening.top_m - frame
        split = high - fanlight_m
        self.assembly.add(
            "door_frames",
            self.look.frame_material,
            boxes(
                [
                    (-recess, opening.left_m, low + 0.02),
                    (-recess, right, low + 0.02),
                    (-recess, left, high),
                    *([(-recess, left, split - frame)] if fanlight_m else []),
                ],
                [
                    (-recess + 0.07, left, opening.top_m),
                    (-recess + 0.07, opening.right_m, opening.top_m),
                    (-recess + 0.07, right, opening.top_m),
                    *([(-recess + 0.07, right, split)] if fanlight_m else []),
                ],
            ),
        )
        if fanlight_m:
            part, pane = self.panes.draw()
            self.assembly.add(part, pane, self.glass(np.array([[left, right, split, high]]), -recess + 0.01))
        top = split - frame if fanlight_m else high
        edges = np.linspace(left, right, leaves + 1)
        for number in range(leaves):
            a, b = edges[number] + 0.003, edges[number + 1] - 0.003
            self.assembly.add("doors", material, _door_leaf(a, b, low + 0.02, top, -recess + 0.01))
            handle = b - 0.09 if number == 0 else a + 0.09
            self.assembly.add(
                "door_fittings",
                "metal/brass",
                cylinder(0.03, 0.05, sides=10, axis="x").moved(-recess + 0.09, handle, low + 1.05),
                span((-recess + 0.05, (a + b) / 2 - 0.13, low + 0.95), (-recess + 0.062, (a + b) / 2 + 0.13, low + 1.0)),
            )
        self.assembly.add(
            "steps",
            "stone/granite",
            span((-recess - 0.01, opening.left_m, max(low - 0.15, 0.0)), (0.3, opening.right_m, low + 0.02)),
        )

    def garage_door(self, opening: Opening, *, material: str = "coating/white") -> None:
        """Draw a sectional door of ribbed panels, each about 0.5 m high."""
        recess = 0.2
        self.cut(opening, recess)
        count = max(round(opening.height_m / 0.53), 2)
        levels = np.linspace(opening.bottom_m, opening.top_m, count + 1)
        self.assembly.add(
            "garage_doors",
            material,
            span((-recess - 0.02, opening.left_m, opening.bottom_m), (-recess, opening.right_m, opening.top_m)),
        )
        panel = np.array([(a + 0.008, b - 0.008) for a, b in itertools.pairwise(levels)])
        ribs = [(a + (b - a) * k / 4 + 0.012, a + (b - a) * (k + 1) / 4 - 0.012) for a, b in panel for k in range(4)]
        low = [(-recess - 0.01, opening.left_m + 0.01, a) for a, _ in ribs]
        high = [(-recess + 0.02, opening.right_m - 0.01, b) for _, b in ribs]
        self.assembly.add("garage_doors", material, boxes(low, high))

    def shop(
        self, opening: Opening, *, material: str = "coating/green", door_at: float = 0.5, awning: str = "", sign_m: float = 0.62
    ) -> None:
        """Draw a shop front: display windows on a plinth, a glazed door set back, a fascia with a sign, perhaps an awning."""
        recess, frame = 0.12, 0.06
        self.openings.append(opening)
        self.assembly.add("shop_fronts", material, reveal(opening, 0.9))
        left, right, low = opening.left_m, opening.right_m, opening.bottom_m
        top = opening.top_m - sign_m
        wide = min(1.1, 0.4 * opening.width_m)
        start = left + door_at * (opening.width_m - wide)
        plinth = low + 0.5
        sides = [(a, b) for a, b in ((left, start), (start + wide, right)) if b - a > 0.25]
        for a, b in sides:
            self._display(a, b, plinth, top, recess=recess, frame=frame, material=material)
            self.assembly.add("shop_fronts", material, span((-0.9, a, low), (-0.04, b, plinth)))
        self._shop_door(start, start + wide, low, top, material=material)
        self.assembly.add("shop_fronts", material, span((-0.9, left, top), (0.05, right, opening.top_m)))
        self.assembly.add(
            "shop_fronts",
            material,
            span((-0.05, left - 0.06, opening.top_m), (0.2, right + 0.06, opening.top_m + 0.09)),
            span((-0.05, left - 0.06, opening.top_m - 0.06), (0.13, right + 0.06, opening.top_m)),
        )
        middle = (top + opening.top_m - 0.06) / 2
        tall = (sign_m - 0.06) * 0.36
        long = min(0.42 * opening.width_m, 3.2)
        x = 0.05 + 2 * SHEET_M
        centre = (left + right) / 2
        face = [
            (x, centre - long, middle - tall),
            (x, centre + long, middle - tall),
            (x, centre + long, middle + tall),
            (x, centre - long, middle + tall),
        ]
        self.assembly.add("sign_panel", "lamp/sign_panel", quads([face]))
        self.lettering(centre, long, middle, tall, x + SHEET_M)
        if awning:
            self._awning(left + 0.1, right - 0.1, top + 0.02, awning)

    def _display(
        self, left: float, right: float, low: float, high: float, *, recess: float, frame: float, material: str
    ) -> None:
        count = max(round((right - left) / 1.5), 1)
        edges = np.linspace(left, right, count + 1)
        transom = high - 0.5
        casements = [(a, b, c, d) for a, b in itertools.pairwise(edges) for c, d in ((low, transom), (transom, high))]
        self.assembly.add("shop_windows", "lamp/shop", self.glass(np.array(casements), -recess))
        bars = [(edge - frame / 2, edge + frame / 2, low, high) for edge in edges[1:-1]]
        bars += [(left, left + frame, low, high), (right - frame, right, low, high)]
        bars += [
            (left, right, low, low + frame),
            (left, right, high - frame, high),
            (left, right, transom - 0.02, transom + 0.02),
        ]
        self.assembly.add(
            "shop_fronts",
            material,
            boxes([(-recess - 0.02, a, c) for a, _, c, _ in bars], [(-recess + 0.06, b, d) for _, b, _, d in bars]),
        )

    def _shop_door(self, left: float, right: float, low: float, high: float, *, material: str) -> None:
        recess = 0.75
        head = low + 2.15
        panes = np.array(
            [(left + 0.12, right - 0.12, low + 0.3, head - 0.1), (left + 0.08, right - 0.08, head + 0.05, high - 0.05)]
        )
        self.assembly.add("shop_windows", "lamp/shop", self.glass(panes, -recess))
        bars = [
            (left, left + 0.13, low + 0.015, high),
            (right - 0.13, right, low + 0.015, high),
            (left, right, low + 0.015, low + 0.32),
            (left, right, head - 0.12, head + 0.06),
            (left, right, high - 0.06, high),
        ]
        self.assembly.add(
            "shop_fronts",
            material,
            boxes([(-recess - 0.04, a, c) for a, _, c, _ in bars], [(-recess + 0.03, b, d) for _, b, _, d in bars]),
        )
        self.assembly.add(
            "door_fittings",
            "metal/brass",
            span((-recess + 0.05, right - 0.19, low + 0.8), (-recess + 0.075, right - 0.165, low + 1.4)),
        )
        self.assembly.add(
            "steps", "stone/granite", span((-0.895, left + 0.001, max(low - 0.15, 0.0)), (0.1, right - 0.001, low + 0.015))
        )

    def lettering(self, centre: float, long: float, middle: float, tall: float, x: float) -> None:
        """Strokes that read as a line of letters from afar, without saying anything."""
        pitch = tall * 0.95
        count = int(self.rng.integers(5, 10))
        count = min(count, int(1.7 * long / pitch))
        start = centre - count * pitch / 2
        faces = []
        for number in range(count):
            a, b = start + number * pitch, start + number * pitch + 0.62 * pitch
            low, high, stroke = middle - 0.5 * tall, middle + 0.5 * tall, 0.16 * tall
            choice = self.rng.random(4) < 0.6
            strokes = [(a, a + stroke, low, high)]
            strokes += [(b - stroke, b, low, high)] if choice[0] else []
            for wanted, z in ((choice[1], high - stroke), (choice[2], middle - stroke / 2), (choice[3], low)):
                right_end = b - stroke if choice[0] else b
                strokes += [(a + stroke, right_end, z, z + stroke)] if wanted else []
            faces += [[(x, p, r), (x, q, r), (x, q, s), (x, p, s)] for p, q, r, s in strokes]
        if faces:
            material = ("sign/red", "sign/blue", "sign/black", "sign/green")[int(self.rng.integers(4))]
            self.assembly.add("sign_letters", material, quads(faces))

    def _awning(self, left: float, right: float, top: float, material: str) -> None:
        out, drop, thick = 1.1, 0.45, 0.012
        stripes = max(round((right - left) / 0.35), 2)
        edges = np.linspace(left, right, stripes + 1)
        for part, cloth, first in (
            ("awnings", material, 0),
            ("awning_stripes", "plaster/white", 1),
        ):
            faces = []
            for a, b in zip(edges[first:-1:2], edges[first + 1 :: 2], strict=False):
                upper = [(0.08, a, top), (out, a, top - drop), (out, b, top - drop), (0.08, b, top)]
                front = [(out, a, top - drop - 0.2), (out, b, top - drop - 0.2), (out, b, top - drop), (out, a, top - drop)]
                faces += [upper, front]
                faces.append([(x - thick, y, z - thick) for x, y, z in upper[::-1]])
                faces.append([(x - thick, y, z) for x, y, z in front[::-1]])
            self.assembly.add(part, cloth, quads(faces))

    # -- balconies ----------------------------------------------------------------------------------------------------

    def balcony(self, left_m: float, right_m: float, floor_m: float, style: Balcony) -> None:
        """Draw a balcony: slab, and a railing 1.05 m high on its three sides."""
        out, thick = style.depth_m, 0.16
        self.assembly.add("balconies", style.slab_material, span((-0.1, left_m, floor_m - thick), (out, right_m, floor_m)))
        rail = floor_m + 1.05
        if style.railing == "panels":
            sheets = boxes(
                [
                    (out - 0.03, left_m + 0.01, floor_m + 0.06),
                    (0.02, left_m + 0.01, floor_m + 0.06),
                    (0.02, right_m - 0.04, floor_m + 0.06),
                ],
                [
                    (out - 0.005, right_m - 0.01, rail - 0.08),
                    (out - 0.03, left_m + 0.035, rail - 0.08),
                    (out - 0.03, right_m - 0.015, rail - 0.08),
                ],
            )
            self.assembly.add("balcony_panels", style.panel_material, sheets)
        elif style.railing == "stone":
            self._balusters(left_m, right_m, floor_m, rail, out, material=style.slab_material)
            return
        else:
            spots = _railing_spots(left_m + 0.04, right_m - 0.04, out - 0.04, pitch_m=0.125)
            low = np.column_stack([spots - 0.008, np.full(len(spots), floor_m)])
            high = np.column_stack([spots + 0.008, np.full(len(spots), rail - 0.03)])
            self.assembly.add("railings", "coating/black", boxes(low, high))
        material = "metal/steel_galvanised" if style.railing == "panels" else "coating/black"
        part = "handrails" if style.railing == "panels" else "railings"
        self.assembly.add(
            part,
            material,
            boxes(
                [
                    (out - 0.065, left_m + 0.015, rail - 0.04),
                    (0.0, left_m + 0.015, rail - 0.04),
                    (0.0, right_m - 0.065, rail - 0.04),
                ],
                [
                    (out - 0.015, right_m - 0.015, rail),
                    (out - 0.065, left_m + 0.065, rail),
                    (out - 0.065, right_m - 0.015, rail),
                ],
            ),
        )

    def _balusters(self, left: float, right: float, low: float, high: float, out: float, *, material: str) -> None:
        spots = _railing_spots(left + 0.09, right - 0.09, out - 0.09, pitch_m=0.24)
        for half, a, b in ((0.05, low, low + 0.3), (0.075, low + 0.3, low + 0.55), (0.05, low + 0.55, high - 0.12)):
            corners_low = np.column_stack([spots - half, np.full(len(spots), a)])
            corners_high = np.column_stack([spots + half, np.full(len(spots), b)])
            self.assembly.add("balconies", material, boxes(corners_low, corners_high))
        self.assembly.add(
            "balconies",
            material,
            boxes(
                [(out - 0.19, left - 0.02, high - 0.12), (0.0, left - 0.02, high - 0.12), (0.0, right - 0.18, high - 0.12)],
                [(out + 0.02, right + 0.02, high), (out - 0.19, left + 0.18, high), (out - 0.19, right + 0.02, high)],
            ),
            boxes(
                [(-0.01, left + 0.21, low - 0.45), (-0.01, right - 0.45, low - 0.45)],
                [(0.35, left + 0.45, low - 0.16), (0.35, right - 0.21, low - 0.16)],
            ),
        )


def _railing_spots(left: float, right: float, out: float, *, pitch_m: float) -> Array:
    """(n, 2) places (x, y) of bars along the front and both sides."""
    count = max(round((right - left) / pitch_m), 2)
    front = np.column_stack([np.full(count + 1, out), np.linspace(left, right, count + 1)])
    deep = max(round(out / pitch_m), 1)
    along = np.linspace(0.06, out, deep + 1)[:-1]
    sides = [np.column_stack([along, np.full(deep, y)]) for y in (left, right)]
    return np.concatenate([front, *sides])


def _casements(opening: Opening, look: WindowLook) -> tuple[Array, Array]:
    """(n, 4) panes and (m, 4) frame members, each left, right, bottom, top [m]."""
    left, right, low, high, frame = opening.left_m, opening.right_m, opening.bottom_m, opening.top_m, look.frame_m
    edges = np.linspace(left, right, look.columns + 1)
    levels = [low, high] if look.transom <= 0 else [low, low + look.transom * (high - low), high]
    panes = [(a, b, c, d) for a, b in itertools.pairwise(edges) for c, d in itertools.pairwise(levels)]
    members = [(left, left + frame, low, high), (right - frame, right, low, high)]
    inner = (left + frame, right - frame)
    members += [(*inner, low, low + frame), (*inner, high - frame, high)]
    members += [(edge - 0.7 * frame, edge + 0.7 * frame, low + frame, high - frame) for edge in edges[1:-1]]
    members += [(*inner, level - 0.5 * frame, level + 0.5 * frame) for level in levels[1:-1]]
    for a, b in itertools.pairwise(edges):
        top = levels[1] if look.transom > 0 else high
        for k in range(look.bars):
            z = low + (top - low) * (k + 1) / (look.bars + 1)
            members.append((a + 0.02, b - 0.02, z - 0.013, z + 0.013))
    return np.array(panes), np.array(members)


def _frames(members: Array, x_m: float) -> Shape:
    left, right, low, high = members.T
    # Thinner members stand back a little, so that where they cross no two faces share a plane.
    front = x_m + 0.03 + 0.25 * np.minimum(np.minimum(right - left, high - low), 0.08)
    back = np.full(len(members), x_m - 0.02)
    return boxes(np.column_stack([back, left, low]), np.column_stack([front, right, high]))


def _soldier_course(left: float, right: float, low: float) -> Shape:
    count = max(round((right - left) / 0.075), 1)
    edges = np.linspace(left, right, count + 1)
    low_corners = np.column_stack([np.full(count, 0.0), edges[:-1] + 0.005, np.full(count, low)])
    high_corners = np.column_stack([np.full(count, 0.012), edges[1:] - 0.005, np.full(count, low + 0.22)])
    return boxes(low_corners, high_corners)


def _pediment(left: float, right: float, low: float) -> list[Shape]:
    """Brackets, a shelf, and a flat gable above."""
    middle, rise = (left + right) / 2, 0.17 * (right - left)
    shelf = span((0.0, left, low + 0.1), (0.2, right, low + 0.19))
    frieze = span((0.0, left + 0.08, low), (0.06, right - 0.08, low + 0.1))
    brackets = boxes(
        [(0.0, left + 0.04, low - 0.18), (0.0, right - 0.16, low - 0.18)],
        [(0.13, left + 0.16, low + 0.1), (0.13, right - 0.04, low + 0.1)],
    )
    base = low + 0.19
    outline = np.array([(0.16, left, base), (0.16, right, base), (0.16, middle, base + rise)])
    back = outline - [0.16, 0, 0]
    gable = loft(np.array([back, outline]))
    return [shelf, frieze, brackets, gable]


def _louvred_leaf(left: float, right: float, low: float, high: float) -> Shape:
    stile = 0.06
    frame = boxes(
        [(0.012, left, low), (0.012, right - stile, low), (0.012, left + stile, low), (0.012, left + stile, high - stile)],
        [(0.05, left + stile, high), (0.05, right, high), (0.05, right - stile, low + stile), (0.05, right - stile, high)],
    )
    count = max(int((high - low - 2 * stile) / 0.07), 1)
    levels = np.linspace(low + stile, high - stile, count + 1)
    slats = [
        [
            (0.042, left + stile, z),
            (0.042, right - stile, z),
            (0.016, right - stile, z + 0.066),
            (0.016, left + stile, z + 0.066),
        ]
        for z in levels[:-1]
    ]
    from_below = [[slat[3], slat[2], slat[1], slat[0]] for slat in slats]
    return joined([frame, quads(slats), quads(from_below)])


def _door_leaf(left: float, right: float, low: float, high: float, x_m: float) -> Shape:
    """A leaf with a framed pair of panels: the panels lie 15 mm behind the frame."""
    stile, rail = 0.11, low + 0.42 * (high - low)
    bars = [
        (left, left + stile, low, high),
        (right - stile, right, low, high),
        (left + stile, right - stile, low, low + 0.18),
        (left + stile, right - stile, rail, rail + 0.14),
        (left + stile, right - stile, high - stile, high),
    ]
    sheet = [(left + stile, right - stile, low + 0.18, high - stile)]
    low_corners = [(x_m, a, c) for a, _, c, _ in bars] + [(x_m, a, c) for a, _, c, _ in sheet]
    high_corners = [(x_m + 0.045, b, d) for _, b, _, d in bars] + [(x_m + 0.03, b, d) for _, b, _, d in sheet]
    return boxes(low_corners, high_corners)


def solid_spans(
    width_m: float, low_m: float, high_m: float, openings: Sequence[Opening], *, beyond_m: float = 0.0
) -> list[tuple[float, float]]:
    """Return the stretches (left, right) of a band of wall that no opening touches; ends reach `beyond_m` past corners."""
    half = width_m / 2 + beyond_m
    cut = sorted((o.left_m, o.right_m) for o in openings if o.bottom_m < high_m - 1e-6 and o.top_m > low_m + 1e-6)
    spans, start = [], -half
    for left, right in cut:
        if left - start > 0.02:
            spans.append((start, left))
        start = max(start, right)
    if half - start > 0.02:
        spans.append((start, half))
    return spans


def courses(
    width_m: float, low_m: float, high_m: float, openings: Sequence[Opening], *, course_m: float, out_m: float, groove_m: float
) -> Shape:
    """Return courses of stone over a wall between its openings, with grooves (rustication); one course is a plinth."""
    count = max(round((high_m - low_m) / course_m), 1)
    levels = np.linspace(low_m, high_m, count + 1)
    low, high = [], []
    for a, b in itertools.pairwise(levels):
        for left, right in solid_spans(width_m, a, b, openings, beyond_m=out_m):
            low.append((0.0, left, a + groove_m / 2))
            high.append((out_m, right, b - groove_m / 2))
    return boxes(np.array(low).reshape(-1, 3), np.array(high).reshape(-1, 3))
