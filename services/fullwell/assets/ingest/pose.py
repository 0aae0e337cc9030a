"""How large a model is, which way is up, and which way it looks: from its file, its class, and the names of its parts."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final

import numpy as np
from numpy.typing import NDArray

from fullwell.assets.classes import asset_class, size_problems
from fullwell.assets.ingest.options import FORWARD_AXES, ForwardAxis, IngestOptions
from fullwell.assets.model import AXES, LoadedModel, LoadedPart, UpAxis, turn_up
from fullwell.assets.records import Check, CheckState

__all__ = ["UNITS_M", "Pose", "find_pose", "posed_part"]

Array = NDArray[np.float64]
Triple = tuple[float, float, float]

UNITS_M: Final = ((1.0, "metres"), (0.01, "centimetres"), (0.001, "millimetres"), (0.0254, "inches"), (0.3048, "feet"))
"""Units that models are made in, likeliest first, with their names."""

_CONVENTION: Final[dict[str, ForwardAxis]] = {".glb": "z", ".gltf": "z"}
"""glTF 2.0, section 3.4: the front of an asset faces +z. No other format says."""

_FRONTLESS_GROUPS: Final = frozenset({"vegetation"})
_FRONTLESS: Final = frozenset({"road", "cone", "bin", "barrier", "clutter", "other", "bike_rack"})
_DOUBTFUL_FRONT: Final = frozenset({"building", "call_box", "bench"})
"""Classes that have a front, but for which a wrong one does no harm that a person must prevent."""

_FRONT_WORDS: Final = frozenset(
    ("front", "headlight", "headlights", "headlamp", "headlamps", "hood", "bonnet", "grille", "grill", "handlebar")
    + ("handlebars", "fork", "windshield", "windscreen")
)
_REAR_WORDS: Final = frozenset(
    ("rear", "back", "taillight", "taillights", "taillamp", "brakelight", "brakelights", "trunk", "boot", "tailgate")
)
_LAMP_WORDS: Final = frozenset(["light", "lights", "lamp", "lamps"])
_SIDE_LAMP_WORDS: Final = frozenset(["orange", "yellow", "indicator", "turn", "blinker", "roof", "interior"])
_WHEEL_WORDS: Final = frozenset(["wheel", "wheels", "tire", "tires", "tyre", "tyres", "rim"])
_LEAST_LEAN: Final = 0.15
"""Distance between what names place at the front and at the rear, over the model's extent, from which it counts."""

_CLEARLY_LONGER: Final = 1.15


@dataclass(frozen=True, slots=True, eq=False)
class Pose:
    """What turns loaded vertices into the canonical pose: `vertices * scale @ turn.T + shift`; and how it was found.

    Attributes
    ----------
    turn
        (3, 3) rotation.
    unit_m, up_axis, forward_axis
        Of the file.
    size_m
        Extents along x, y, z in the pose.
    """

    scale: float
    turn: Array
    shift_m: Array
    unit_m: float
    up_axis: UpAxis
    forward_axis: ForwardAxis
    size_m: Triple
    checks: tuple[Check, ...]


def find_pose(model: LoadedModel, options: IngestOptions, *, suffix: str) -> Pose:
    """Return the canonical pose of a model that was loaded in the unit and up axis that its file states or its format assumes.

    Checks "unit", "up_axis", "forward_axis", "size" and "pivot" say what was taken from where, and what a person must decide.
    """
    frame = _Frame(model, suffix)
    up, up_check = _up_axis(frame, options)
    unit, unit_check = _unit(frame, options, up)
    forward, forward_check = _forward_axis(frame, options, up)
    if options.length_m is not None:
        extent = frame.extent(up, forward)[0]
        unit = options.length_m / extent
        unit_check = Check(
            "unit",
            "ok",
            f"Scaled to the stated length of {options.length_m:g} m: {unit:.4g} m for each unit of the file.",
            {"unit_m": unit, "length_m": options.length_m},
        )
    turn = _to_canonical(up, forward) @ turn_up(model.up_axis).T
    scale = unit / model.unit_m
    low, high = _bounds(model.parts, turn)
    low, high = low * scale, high * scale
    shift = np.array([-(low[0] + high[0]) / 2, -(low[1] + high[1]) / 2, -low[2]])
    size = _triple(high - low)
    checks = (unit_check, up_check, forward_check, _size_check(options, size), _pivot_check(shift))
    return Pose(scale, turn, shift, unit, up, forward, size, checks)


def posed_part(part: LoadedPart, pose: Pose) -> LoadedPart:
    """Return a loaded part in the pose."""
    vertices = part.vertices_m @ pose.turn.T * pose.scale + pose.shift_m
    normals = None if part.normals is None else part.normals @ pose.turn.T
    return replace(part, vertices_m=vertices, normals=normals)


class _Frame:
    """A loaded model seen in the axes and the unit of its file."""

    def __init__(self, model: LoadedModel, suffix: str) -> None:
        self.model = model
        self.convention = _CONVENTION.get(suffix)
        to_file = turn_up(model.up_axis).T
        low, high = _bounds(model.parts, to_file)
        self.low, self.high = low / model.unit_m, high / model.unit_m
        self._to_file = to_file

    def extent(self, up: UpAxis, forward: ForwardAxis) -> Triple:
        """Extents along forward, sideways, up [units of the file]."""
        size = self.high - self.low
        along, above = AXES.index(_axis(forward)), AXES.index(up)
        return _triple(size[[along, 3 - along - above, above]])

    def centres(self, parts: Sequence[LoadedPart]) -> Array:
        """Mean of the parts' centres of area, in the file's axes [units of the file]."""
        sums, weights = np.zeros(3), 0.0
        for part in parts:
            corners = part.vertices_m[part.faces]
            area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
            sums = sums + (corners.mean(axis=1) * area[:, None]).sum(axis=0)
            weights += float(area.sum())
        return np.asarray(self._to_file @ (sums / max(weights, 1e-300)) / self.model.unit_m)


def _axis(signed: ForwardAxis) -> UpAxis:
    return AXES[FORWARD_AXES.index(signed) // 2]


def _bounds(parts: Sequence[LoadedPart], turn: Array) -> tuple[Array, Array]:
    turned = [part.vertices_m @ turn.T for part in parts]
    return np.min([v.min(axis=0) for v in turned], axis=0), np.max([v.max(axis=0) for v in turned], axis=0)


def _to_canonical(up: UpAxis, forward: ForwardAxis) -> Array:
    """Rotation from the file's axes that turns `forward` to +x and `up` to +z."""
    ahead, above = np.zeros(3), np.zeros(3)
    ahead[AXES.index(_axis(forward))] = -1.0 if forward.startswith("-") else 1.0
    above[AXES.index(up)] = 1.0
    return np.array([ahead, np.cross(above, ahead), above])


def _horizontal(up: UpAxis) -> tuple[ForwardAxis, ...]:
    return tuple(axis for axis in FORWARD_AXES if _axis(axis) != up)


# Up and unit ---------------------------------------------------------------------------------------------------------


def _problems(frame: _Frame, options: IngestOptions, unit_m: float, up: UpAxis) -> int:
    """Extents that are implausible for the class at a unit, at the better of the two ways to lie."""
    forwards: Iterator[ForwardAxis] = iter(_horizontal(up)[::2])
    if options.forward_axis is not None and _axis(options.forward_axis) != up:
        forwards = iter((options.forward_axis,))
    return min(len(size_problems(options.asset_class, options.tags, _scaled(frame.extent(up, f), unit_m))) for f in forwards)


def _scaled(extent: Triple, unit_m: float) -> Triple:
    return extent[0] * unit_m, extent[1] * unit_m, extent[2] * unit_m


def _units(frame: _Frame, options: IngestOptions) -> list[float]:
    if options.unit_m is not None:
        return [options.unit_m]
    stated = [frame.model.unit_m] if frame.model.states_unit else []
    return list(dict.fromkeys(stated + [unit for unit, _ in UNITS_M]))


def _up_axis(frame: _Frame, options: IngestOptions) -> tuple[UpAxis, Check]:
    model = frame.model
    if options.up_axis is not None:
        return options.up_axis, Check("up_axis", "ok", f"+{options.up_axis} is up, as given.")
    if model.states_up_axis:
        return model.up_axis, Check("up_axis", "ok", f"+{model.up_axis} is up, as the file or its format says.")
    usual = model.up_axis
    candidates: list[UpAxis] = [usual, *(axis for axis in ("y", "z") if axis != usual)]
    if options.forward_axis is not None:
        candidates = [axis for axis in candidates if axis != _axis(options.forward_axis)]
    fewest = {up: min(_problems(frame, options, unit, up) for unit in _units(frame, options)) for up in candidates}
    best = min(candidates, key=lambda up: fewest[up])  # the usual one wins a tie
    if best != usual and usual in candidates:
        message = (
            f"The format does not say which axis is up. +{usual} is usual, but the size is plausible for a "
            f"{options.asset_class} only with +{best} up, which was taken."
        )
        return best, Check("up_axis", "warning", message)
    sure = len(candidates) == 1 or all(fewest[best] < fewest[other] for other in candidates if other != best)
    reason = "the size is plausible only so" if sure else "that is usual for it"
    return best, Check(
        "up_axis", "ok" if sure else "warning", f"The format does not say; +{best} up was taken, since {reason}."
    )


def _unit(frame: _Frame, options: IngestOptions, up: UpAxis) -> tuple[float, Check]:
    model = frame.model
    if options.unit_m is not None:
        return options.unit_m, Check("unit", "ok", f"{options.unit_m:g} m per unit, as given.", {"unit_m": options.unit_m})
    counts = {unit: _problems(frame, options, unit, up) for unit in _units(frame, options)}
    first = model.unit_m if model.states_unit else 1.0
    best = min(counts, key=lambda unit: (counts[unit], unit != first))
    numbers = {"unit_m": best, "stated_unit_m": model.unit_m if model.states_unit else 0.0}
    if options.length_m is None and counts[best] > 0 and counts[best] >= counts[first]:
        return first, _implausible(frame, options, up, first)
    if best == first and model.states_unit:
        return best, Check("unit", "ok", f"{best:g} m per unit, as the file or its format says; the size fits.", numbers)
    said = f"The file states {first:g} m per unit" if model.states_unit else "The format states no unit"
    size = _size_text(_scaled(frame.extent(up, _longest(frame, up)), best))
    others = [name for unit, name in UNITS_M if unit != best and counts.get(unit, 9) == 0]
    if best == first:
        if options.asset_class == "other":
            return best, Check("unit", "decide", f"{said}; 1 m was taken, which makes it {size}. Give unit_m.", numbers)
        also = f" So would be {', '.join(others)}." if others else ""
        message = f"{said}; 1 m was taken, with which {size} is plausible for class {options.asset_class}.{also}"
        return best, Check("unit", "warning" if others else "ok", message, numbers)
    name = dict(UNITS_M)[best]
    first_size = _size_text(_scaled(frame.extent(up, _longest(frame, up)), first))
    message = (
        f"{said}; at {first:g} m it would be {first_size}, implausible for class {options.asset_class}. Read in {name}, "
        f"{best:g} m per unit, it is {size}. Confirm it, or give unit_m or length_m."
    )
    return best, Check("unit", "decide" if model.states_unit or others else "warning", message, numbers)


def _implausible(frame: _Frame, options: IngestOptions, up: UpAxis, unit_m: float) -> Check:
    kind = asset_class(options.asset_class)
    low, high = next((span for tag, span in kind.subclasses if tag in options.tags), kind.length_m)
    forward = options.forward_axis or _longest(frame, up)
    size = _scaled(frame.extent(up, forward), unit_m)
    typical = math.sqrt(low * high)
    factor = typical / max(size[0], 1e-12)
    message = (
        f"At {unit_m:g} m per unit it is {_size_text(size)}, and no usual unit makes that plausible for class {kind.name}. The "
        f"typical length of {typical:.2g} m would need a factor of {factor:.3g}. Give length_m, its real length."
    )
    numbers = {"unit_m": unit_m, "typical_length_m": typical, "scale_to_typical": factor}
    return Check("unit", "decide", message, numbers)


def _longest(frame: _Frame, up: UpAxis) -> ForwardAxis:
    return max(_horizontal(up)[::2], key=lambda axis: frame.extent(up, axis)[0])


def _size_text(size: Triple) -> str:
    return " x ".join(f"{side:.3g}" for side in size) + " m"


def _size_check(options: IngestOptions, size: Triple) -> Check:
    problems = size_problems(options.asset_class, options.tags, size)
    numbers = dict(zip(("length_m", "width_m", "height_m"), size, strict=True))
    if not problems:
        return Check("size", "ok", f"{_size_text(size)} is plausible for class {options.asset_class}.", numbers)
    text = "; ".join(problems)
    return Check("size", "decide", f"{text[0].upper()}{text[1:]}. Give length_m, or another class, or accept it.", numbers)


def _pivot_check(shift_m: Array) -> Check:
    distance = float(np.linalg.norm(shift_m))
    numbers = dict(zip(("shift_x_m", "shift_y_m", "shift_z_m"), shift_m.tolist(), strict=True))
    if distance < 1e-6:
        return Check("pivot", "ok", "It stands on its pivot.", numbers)
    return Check("pivot", "mended", f"Moved by {distance:.3g} m so that it stands centred on its pivot.", numbers)


# Forward -------------------------------------------------------------------------------------------------------------


def _forward_axis(frame: _Frame, options: IngestOptions, up: UpAxis) -> tuple[ForwardAxis, Check]:
    given = options.forward_axis
    if given is not None and _axis(given) != up:
        return given, Check("forward_axis", "ok", f"{given} is forward, as given.")
    usual = frame.convention if frame.convention is not None and _axis(frame.convention) != up else None
    kind = asset_class(options.asset_class)
    if kind.group in _FRONTLESS_GROUPS or kind.name in _FRONTLESS:
        forward = _fitting(frame, options, up, usual)
        return forward, Check("forward_axis", "ok", f"Class {kind.name} has no front; {forward} became forward.")
    lean = _named_front(frame, up)
    if lean is not None:
        return _from_names(frame, up, *lean)
    forward = _fitting(frame, options, up, usual)
    if usual is not None and forward == usual:
        return forward, Check("forward_axis", "warning", f"No part tells the front; {forward} was taken, as glTF demands.")
    state: CheckState = "warning" if kind.name in _DOUBTFUL_FRONT else "decide"
    message = (
        f"No part tells the front. {forward} was taken, which fits the proportions of a {kind.name}, but it may be "
        f"{_opposite(forward)}. Look, and give forward_axis."
    )
    return forward, Check("forward_axis", state, message)


def _from_names(frame: _Frame, up: UpAxis, forward: ForwardAxis, evidence: str, lean: float) -> tuple[ForwardAxis, Check]:
    length, width, _ = frame.extent(up, forward)
    numbers = {"lean": lean}
    if width > _CLEARLY_LONGER * length:
        message = f"{evidence} shows {forward}, but the model is longer sideways. Look, and give forward_axis."
        return forward, Check("forward_axis", "decide", message, numbers)
    return forward, Check("forward_axis", "ok", f"{forward} is forward: {evidence} shows it.", numbers)


def _fitting(frame: _Frame, options: IngestOptions, up: UpAxis, usual: ForwardAxis | None) -> ForwardAxis:
    """The axis with the better proportions: the usual one where both are alike."""
    kind = asset_class(options.asset_class)
    ways = _horizontal(up)[::2]

    def misfit(axis: ForwardAxis) -> float:
        length, width, _ = frame.extent(up, axis)
        wanted = math.sqrt(kind.length_m[0] * kind.length_m[1]) / math.sqrt(kind.width_m[0] * kind.width_m[1])
        return abs(math.log(max(length, 1e-12) / max(width, 1e-12)) - math.log(wanted))

    if usual is not None:
        other = next(axis for axis in ways if _axis(axis) != _axis(usual))
        length, width, _ = frame.extent(up, usual)
        alike = max(length, width) < _CLEARLY_LONGER * min(length, width)
        if alike or misfit(usual) <= misfit(other):
            return usual
    return min(ways, key=misfit)


def _opposite(axis: ForwardAxis) -> ForwardAxis:
    return FORWARD_AXES[FORWARD_AXES.index(axis) ^ 1]


def _named_front(frame: _Frame, up: UpAxis) -> tuple[ForwardAxis, str, float] | None:
    """Axis from what names place at the rear to what they place at the front, with which parts show it and how clearly."""
    parts = frame.model.parts
    fronts = [part for part in parts if _side(part, parts) > 0]
    rears = [part for part in parts if _side(part, parts) < 0]
    if not fronts and not rears:
        return None
    middle = (frame.low + frame.high) / 2
    ahead = frame.centres(fronts) if fronts else middle
    behind = frame.centres(rears) if rears else middle
    lean = (ahead - behind) / np.maximum(frame.high - frame.low, 1e-300)
    lean[AXES.index(up)] = 0.0
    number = int(np.abs(lean).argmax())
    if abs(lean[number]) < _LEAST_LEAN:
        return None
    forward = FORWARD_AXES[2 * number + (lean[number] < 0)]
    names = [repr(group[0].name) for group in (fronts, rears) if group]
    return forward, f"the place of {' and '.join(names)}", float(abs(lean[number]))


def _side(part: LoadedPart, parts: Sequence[LoadedPart]) -> int:
    """1 for what belongs at the front, -1 for what belongs at the rear, 0 for the rest."""
    words = _words(part.name) | _words(part.material_name)
    front, rear = bool(words & _FRONT_WORDS), bool(words & _REAR_WORDS)
    if words & _WHEEL_WORDS:
        front |= bool(words & {"fl", "fr"})
        rear |= bool(words & {"rl", "rr", "bl", "br"})
    if front or rear:
        return int(front) - int(rear)
    if not _plain_lamp(words):
        return 0
    if _reddish(part, words):
        return -1
    # Plain lamps are headlights only where others are red: on their own they may be anything.
    others = [(_words(other.name) | _words(other.material_name), other) for other in parts]
    return int(any(_plain_lamp(said) and _reddish(other, said) for said, other in others))


def _plain_lamp(words: frozenset[str]) -> bool:
    return bool(words & _LAMP_WORDS) and not words & _SIDE_LAMP_WORDS


def _reddish(part: LoadedPart, words: frozenset[str]) -> bool:
    red, green, blue = part.base_color_srgb
    return "red" in words or (red > 0.4 and red > 2 * max(green, blue))


def _words(name: str) -> frozenset[str]:
    """Words of a name, and each two that follow each other as one: "HeadLight.L" holds head, light, headlight."""
    spaced = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name)
    words = re.findall(r"[a-z]+", spaced.casefold())
    return frozenset(words) | frozenset(first + second for first, second in pairwise(words))


def _triple(values: Array) -> Triple:
    first, second, third = (float(value) for value in values)
    return first, second, third
