"""Paths such as ``cameras[0].sensors[main].exposure.time_s`` into the plain data of a recipe.

A list item is addressed by its position or by its ``id`` or ``name``. A key that holds dots is written in quotes:
``scene.materials."oak.dark".roughness``.
"""

from __future__ import annotations

import copy
import re
from collections.abc import Mapping
from typing import Any

from fullwell.core.errors import unknown_name_message
from fullwell.schema.errors import RecipeError

__all__ = ["apply_override", "format_path", "parse_path", "with_values"]

_STEP = re.compile(r'(?:^|\.)(?:(?P<key>[^.\[\]"]+)|"(?P<quoted>[^"]+)")|\[(?P<item>[^\[\]]+)\]')
_PLAIN_KEY = re.compile(r"[A-Za-z_][A-Za-z0-9_-]*")


def format_path(steps: tuple[str | int, ...]) -> str:
    """Return the text of a path: keys joined by dots, positions in brackets, odd keys in quotes."""
    text = ""
    for step in steps:
        if isinstance(step, int):
            text += f"[{step}]"
        else:
            key = step if _PLAIN_KEY.fullmatch(step) else f'"{step}"'
            text += f".{key}" if text else key
    return text


def parse_path(path: str) -> tuple[str, ...]:
    """Return the steps of a path; raises RecipeError where it is not one."""
    steps: list[str] = []
    position = 0
    while position < len(path):
        match = _STEP.match(path, position)
        if match is None:
            break
        steps.append(match["key"] or match["quoted"] or match["item"])
        position = match.end()
    if position != len(path) or not steps:
        raise RecipeError(
            f"{path!r} is not a path into a recipe; write it like cameras[0].lens.f_number.", path=path[:200], value=path
        )
    return tuple(steps)


def apply_override(recipe: dict[str, Any], path: str, value: Any) -> None:
    """Set the value at `path` of plain recipe data, in place; None removes it.

    Mappings on the way that do not exist yet are made, so that optional sections can be set; what they may hold is
    checked when the recipe is validated. Raises RecipeError where the path leads through a value that has no parts, or to
    a list item that does not exist.
    """
    steps = parse_path(path)
    holder: Any = recipe
    walked: tuple[str | int, ...] = ()
    for step in steps[:-1]:
        key = _key_in(holder, step, walked, path)
        if isinstance(holder, dict) and holder.get(str(key)) is None:
            holder[str(key)] = {}
        holder = holder[key]
        walked = (*walked, key)
    key = _key_in(holder, steps[-1], walked, path)
    if value is None:
        _remove(holder, key)
    else:
        holder[key] = copy.deepcopy(value)


def with_values(recipe: dict[str, Any], values: Mapping[str, Any]) -> dict[str, Any]:
    """Return a copy of plain recipe data with a value set at each path."""
    changed = copy.deepcopy(recipe)
    for path, value in values.items():
        apply_override(changed, path, value)
    return changed


def _remove(holder: Any, key: str | int) -> None:
    if isinstance(holder, dict):
        holder.pop(str(key), None)
    else:
        del holder[int(key)]


def _key_in(holder: Any, step: str, walked: tuple[str | int, ...], path: str) -> str | int:
    here = format_path(walked) or "the recipe"
    if isinstance(holder, dict):
        return str(step)
    if isinstance(holder, list):
        return _position_in(holder, step, here, path)
    raise RecipeError(f"{path} does not exist: {here} is {holder!r} and has no parts.", path=path, value=str(step))


def _position_in(holder: list[Any], step: str, here: str, path: str) -> int:
    if re.fullmatch(r"[0-9]{1,9}", step):
        position = int(step)
        if position < len(holder):
            return position
        raise RecipeError(f"{path} does not exist: {here} has {len(holder)} items, counted from 0.", path=path, value=position)
    names = [str(item.get("id", item.get("name", ""))) if isinstance(item, dict) else "" for item in holder]
    if step in names:
        return names.index(step)
    known = [name for name in names if name]
    what = unknown_name_message("item", step, known) if known else f"give the position of an item, as in {here}[0]."
    raise RecipeError(f"{path} does not exist in {here}: {what}", path=path, value=step)
