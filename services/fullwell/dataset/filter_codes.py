"""Colour filters by the codes of TIFF/EP and DNG."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["cfa_codes", "standard_codes"]

_CODES = {"r": 0, "g": 1, "gr": 1, "gb": 1, "b": 2, "cy": 3, "cyan": 3, "m": 4, "y": 5, "w": 6, "clear": 6}
"""ISO 12234-2:2001, tag CFAPattern."""

_CLEAR, _CYAN = 6, 3
_GREENS = frozenset({"g", "gr", "gb"})
_CODES_BY_NEED = (6, 1, 2, 0, 3, 4, 5, *range(7, 256))
"""For filters that the standard has no name for, such as near infrared; names end at 6."""


def standard_codes(channel_names: Sequence[str]) -> tuple[int | None, ...]:
    """Return the standard's code of each channel name, None where it has none; G, Gr and Gb share theirs.

    "C" is clear, and cyan only beside magenta or yellow filters where none is named "Cy".
    """
    folded = [name.casefold() for name in channel_names]
    cyan = bool({"m", "y"} & set(folded)) and not {"cy", "cyan"} & set(folded)
    known = _CODES | {"c": _CYAN if cyan else _CLEAR}
    return tuple(known.get(name) for name in folded)


def cfa_codes(channel_names: Sequence[str]) -> tuple[int, ...]:
    """Return a code for each channel name: the standard's, or a free one where it has none or another filter has it."""
    standard = standard_codes(channel_names)
    codes: list[int] = []
    for position, code in enumerate(standard):
        name = channel_names[position].casefold()
        others = {codes[k] for k in range(position) if not (name in _GREENS and channel_names[k].casefold() in _GREENS)}
        if code is not None and code not in others:
            codes.append(code)
        else:
            codes.append(next(free for free in _CODES_BY_NEED if free not in others and free not in standard))
    return tuple(codes)
