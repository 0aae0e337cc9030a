"""What all documents share: unknown keys answered with the nearest one, finite numbers with ranges, vectors."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Annotated, Any, NoReturn

from pydantic import BaseModel, BeforeValidator, ConfigDict, GetCoreSchemaHandler, GetJsonSchemaHandler, model_validator
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from fullwell.core.errors import nearest_names

__all__ = [
    "Count",
    "Direction",
    "Document",
    "Fraction",
    "Group",
    "Id",
    "Length",
    "MatrixRows",
    "MotionDocument",
    "Name",
    "NonNegative",
    "Number",
    "Point",
    "Positive",
    "PositiveOrInf",
    "Range",
    "Text",
    "TextPattern",
    "Whole",
    "refuse",
]

MAX_COORDINATE_M = 1e7
"""Beyond this, float64 millimetres are fine but no scene is meant: it is a slip of units."""
_LARGEST = 1e30
"""Squares and sums of this stay finite in float64; nothing physical in a recipe is larger."""
_EXPONENT_NUMBER = re.compile(r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)[eE][-+]?\d+")
_INFINITIES = {"inf": math.inf, "+inf": math.inf, ".inf": math.inf, "Infinity": math.inf, "infinity": math.inf}


def refuse(sentence: str, *at: str | int, value: Any = None) -> NoReturn:
    """Raise the validation error that reads "<path> <sentence>"; `at` leads from the validated value to the bad one."""
    raise PydanticCustomError("recipe", "{sentence}", {"sentence": sentence, "at": list(at), "given": value})


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 80 else text[:77] + "..."


def _as_number(value: Any, *, infinite: bool = False) -> float | None:
    """Return numbers as float; text such as "1e-3" (which YAML 1.1 readers leave as text) counts as a number."""
    if isinstance(value, str) and _EXPONENT_NUMBER.fullmatch(value):
        return float(value)
    if isinstance(value, str) and infinite and value in _INFINITIES:
        return _INFINITIES[value]
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        return float(value)
    except OverflowError:
        return math.inf


@dataclass(frozen=True, slots=True)
class Range:
    """The legal range of a float or int field, told completely in its error.

    `gt`, `ge`, `lt`, `le` bound it; `infinite` lets +inf through (written ``.inf`` or "inf").
    """

    gt: float | None = None
    ge: float | None = None
    lt: float | None = None
    le: float | None = None
    infinite: bool = False
    whole: bool = False

    @property
    def legal(self) -> str:
        """The range in words."""
        low = self._bound(">", self.gt) or self._bound(">=", self.ge)
        high = self._bound("<", self.lt) or self._bound("<=", self.le)
        bounds = " and ".join(part for part in (low, high) if part)
        return bounds or ("a whole number" if self.whole else "a finite number")

    def _bound(self, sign: str, value: float | None) -> str:
        if value is None:
            return ""
        return f"{sign} {int(value)}" if self.whole else f"{sign} {value:g}"

    def check(self, value: Any) -> float | int:
        """Return the number, or raise the validation error."""
        number: float | None = _as_number(value, infinite=self.infinite)
        kind = "a whole number" if self.whole else "a number"
        if number is None:
            refuse(f"is {_shown(value)}; must be {kind}{self._with_bounds()}.", value=value)
        if math.isnan(number) or (math.isinf(number) and not (self.infinite and number > 0)):
            refuse(
                f"is {number}; must be {'finite' if not self._with_bounds() else 'finite and ' + self.legal}.",
                value=str(number),
            )
        outside = (
            (self.gt is not None and not number > self.gt)
            or (self.ge is not None and not number >= self.ge)
            or (self.lt is not None and not number < self.lt)
            or (self.le is not None and not number <= self.le and not (self.infinite and math.isinf(number)))
        )
        if self.whole:
            if number != math.floor(number):
                refuse(f"is {_shown(value)}; must be a whole number{self._with_bounds()}.", value=value)
            number = value if isinstance(value, int) else int(number)
        if outside:
            refuse(f"is {_shown(value)}; must be {self.legal}.", value=value)
        if _LARGEST < abs(number) < math.inf:
            refuse(f"is {_shown(value)}; no quantity is larger than {_LARGEST:g}.", value=value)
        return number

    def _with_bounds(self) -> str:
        return "" if all(bound is None for bound in (self.gt, self.ge, self.lt, self.le)) else " " + self.legal

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self.check)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        names = {"gt": "exclusiveMinimum", "ge": "minimum", "lt": "exclusiveMaximum", "le": "maximum"}
        bounds = {names[key]: getattr(self, key) for key in names if getattr(self, key) is not None}
        number: dict[str, Any] = {"type": "integer" if self.whole else "number", **bounds}
        return {"anyOf": [number, {"const": "inf"}]} if self.infinite else number


@dataclass(frozen=True, slots=True)
class TextPattern:
    """Text that must match a pattern, described in words."""

    pattern: str
    words: str

    def check(self, value: Any) -> str:
        """Return the text, or raise the validation error."""
        if not isinstance(value, str) or re.fullmatch(self.pattern, value) is None:
            hint = " Put it in quotes." if isinstance(value, int | float) else ""
            refuse(f"is {_shown(value)}; must be {self.words}.{hint}", value=value)
        return value

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self.check)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {"type": "string", "pattern": f"^(?:{self.pattern})$"}


_SHORTEST_DIRECTION = 1e-12


@dataclass(frozen=True, slots=True)
class _Vector:
    """A list of exactly `length` numbers, each within `bounds`; `nonzero` refuses the null vector."""

    length: int
    bounds: Range
    nonzero: bool = False

    def check(self, value: Any) -> tuple[float, ...]:
        if not isinstance(value, list | tuple) or len(value) != self.length:
            refuse(f"is {_shown(value)}; must be a list of {self.length} numbers.", value=value)
        numbers = []
        for position, item in enumerate(value):
            try:
                numbers.append(float(self.bounds.check(item)))
            except PydanticCustomError as error:
                context = error.context or {}
                refuse(str(context["sentence"]), position, value=context.get("given"))
        if self.nonzero and not max(abs(number) for number in numbers) >= _SHORTEST_DIRECTION:
            refuse(f"is {_shown(value)}; must not be the null vector.", value=value)
        return tuple(numbers)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(self.check)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        items = self.bounds.__get_pydantic_json_schema__(schema, handler)
        return {"type": "array", "items": items, "minItems": self.length, "maxItems": self.length}


def _true_or_false(value: Any) -> Any:
    if not isinstance(value, bool):
        refuse(f"is {_shown(value)}; must be true or false.", value=value)
    return value


_COORDINATE = Range(ge=-MAX_COORDINATE_M, le=MAX_COORDINATE_M)

Number = Annotated[float, Range()]
Positive = Annotated[float, Range(gt=0)]
PositiveOrInf = Annotated[float, Range(gt=0, infinite=True)]
NonNegative = Annotated[float, Range(ge=0)]
Fraction = Annotated[float, Range(ge=0, le=1)]
Length = Annotated[float, Range(gt=0, le=MAX_COORDINATE_M)]
Whole = Annotated[int, Range(whole=True)]
Count = Annotated[int, Range(ge=1, whole=True)]
Point = Annotated[tuple[float, float, float], _Vector(3, _COORDINATE)]
Direction = Annotated[tuple[float, float, float], _Vector(3, Range(ge=-1e9, le=1e9), nonzero=True)]
Vector = Annotated[tuple[float, float, float], _Vector(3, Range())]
Sizes2 = Annotated[tuple[float, float], _Vector(2, Range(gt=0, le=MAX_COORDINATE_M))]
Sizes3 = Annotated[tuple[float, float, float], _Vector(3, Range(gt=0, le=MAX_COORDINATE_M))]
SrgbTriple = Annotated[tuple[float, float, float], _Vector(3, Range(ge=0, le=1))]
_Row = Annotated[tuple[float, float, float, float], _Vector(4, Range())]
MatrixRows = tuple[_Row, _Row, _Row, _Row]
Flag = Annotated[bool, BeforeValidator(_true_or_false)]
Text = Annotated[str, TextPattern(r"[^\x00]{1,4096}", "text")]
Name = Annotated[
    str, TextPattern(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}", "1 to 64 letters, digits, _ or -, the first a letter or digit")
]
Id = Annotated[
    str,
    TextPattern(r"[A-Za-z0-9_][A-Za-z0-9_.:/#-]{0,127}", "1 to 128 letters, digits or _.:/#-, the first a letter, digit or _"),
]
Class = Annotated[str, TextPattern(r"[^\x00-\x1f\x7f]{0,64}", "text of up to 64 characters")]
Group = Annotated[str, TextPattern(r"[a-z][a-z0-9_-]{0,31}", "up to 32 lower-case letters, digits, _ or -, the first a letter")]


class Document(BaseModel):
    """Base of all documents: closed, unchangeable, and helpful about unknown keys."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _known_keys(cls, given: Any) -> Any:
        if isinstance(given, BaseModel):
            return given
        if not isinstance(given, dict):
            keys = ", ".join(cls.keys())
            refuse(f"is {_shown(given)}; must be a mapping with the keys {keys}.", value=given)
        known = cls.keys()
        for key in given:
            if key not in known:
                close = nearest_names(str(key), known)
                advice = f"did you mean {' or '.join(close)}?" if close else f"known keys are {', '.join(known)}."
                refuse(f"is not a known key; {advice}", str(key), value=key)
        return {key: value for key, value in given.items() if value is not None}

    @classmethod
    def keys(cls) -> list[str]:
        """Return the keys that the document may have, as they are written."""
        return [field.alias or name for name, field in cls.model_fields.items()]


class MotionDocument(Document):
    """How a rigid thing moves while the picture is taken. The recipe says where it is at the frame's own time.

    `velocity_m_s` is along the world's axes; `yaw_rate_deg_per_s` turns it about the vertical through its own origin,
    counter-clockwise from above.
    """

    velocity_m_s: Annotated[tuple[float, float, float], _Vector(3, Range(ge=-1e4, le=1e4))] = (0.0, 0.0, 0.0)
    yaw_rate_deg_per_s: Annotated[float, Range(ge=-36_000, le=36_000)] = 0.0


def exactly_one(document: Document, *keys: str) -> str:
    """Return the one of `keys` that is set; refuse none or several of them."""
    given = [key for key in keys if getattr(document, key) is not None]
    if len(given) == 1:
        return given[0]
    choices = f"{', '.join(keys[:-1])} or {keys[-1]}"
    if not given:
        refuse(f"has none of {choices}; give exactly one of them.")
    refuse(f"has {' and '.join(given)}; give exactly one of {choices}.", given[1])
