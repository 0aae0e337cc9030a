"""Recipe sources to validated documents; validation errors to sentences with paths."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from fullwell.core.errors import nearest_names
from fullwell.schema.errors import Problem, RecipeError
from fullwell.schema.paths import apply_override, format_path
from fullwell.schema.reading import parse_value, read_source
from fullwell.schema.v1.recipe import SCHEMA_NAME, RecipeDocument

__all__ = ["document_of", "load_recipe"]

_MAX_PROBLEMS = 50


def load_recipe(
    source: Path | str | bytes | Mapping[str, Any], *, overrides: Mapping[str, Any] | None = None
) -> RecipeDocument:
    """Return the validated recipe of a file (Path, or text that is a path), of YAML or JSON text, or of plain data.

    `overrides` (path: value, as in ``--set``) are applied first; text values are read as YAML, None removes a value.
    Nothing is rendered and no file that the recipe names is read. Raises RecipeError (all problems in ``errors``), or
    NotFoundError where the recipe's file does not exist.
    """
    recipe, base_dir = read_source(source)
    for path, value in (overrides or {}).items():
        apply_override(recipe, path, parse_value(value) if isinstance(value, str) else value)
    return document_of(recipe, base_dir=base_dir)


def document_of(recipe: dict[str, Any], *, base_dir: Path | None = None) -> RecipeDocument:
    """Return the document of plain recipe data. Raises RecipeError."""
    _check_schema(recipe)
    try:
        document = RecipeDocument.model_validate(recipe)
    except ValidationError as error:
        raise RecipeError.of(_problems(error, recipe)) from None
    document._base_dir = base_dir  # the only writer; documents are frozen for everyone else
    return document


def _check_schema(recipe: dict[str, Any]) -> None:
    given = recipe.get("schema")
    if given is None:
        raise RecipeError(f"schema is missing; must be {SCHEMA_NAME}. Start the recipe with 'schema: {SCHEMA_NAME}'.", "schema")
    if given != SCHEMA_NAME:
        raise RecipeError(f"schema is {given!r}; this version reads {SCHEMA_NAME}.", "schema", given)


def _problems(error: ValidationError, recipe: dict[str, Any]) -> tuple[Problem, ...]:
    found: list[Problem] = []
    for details in error.errors(include_url=False)[:_MAX_PROBLEMS]:
        context = details.get("ctx") or {}
        steps = (*_real_steps(details["loc"], recipe, missing=details["type"] == "missing"), *context.get("at", ()))
        if str(context.get("discriminator", "")).startswith("'"):  # a union told apart by a key: name the key
            steps = (*steps, context["discriminator"].strip("'"))
        path = format_path(steps) or "the recipe"
        value = context.get("given", details["input"]) if details["type"] == "recipe" else details["input"]
        shown = value if isinstance(value, str | int | float | bool | type(None)) else repr(value)[:200]
        found.append(Problem(path, f"{path} {_sentence(details, context)}", shown))
    return tuple(found)


def _real_steps(loc: tuple[str | int, ...], recipe: Any, *, missing: bool) -> tuple[str | int, ...]:
    """Return the location without the names of union branches, which are no part of the document."""
    steps: list[str | int] = []
    here = recipe
    for number, step in enumerate(loc):
        found, inner = _part(here, step)
        if found:
            here = inner
        elif not (missing and number == len(loc) - 1):
            continue
        steps.append(step)
    return tuple(steps)


def _part(holder: Any, step: str | int) -> tuple[bool, Any]:
    if isinstance(holder, dict) and step in holder:
        return True, holder[step]
    if isinstance(holder, list) and isinstance(step, int) and step < len(holder):
        return True, holder[step]
    return False, None


def _sentence(details: Any, context: dict[str, Any]) -> str:
    kind, value = details["type"], details["input"]
    shown = repr(value) if len(repr(value)) <= 80 else repr(value)[:77] + "..."
    match kind:
        case "recipe":
            return str(context["sentence"])
        case "missing":
            return "is missing; give it."
        case "union_tag_invalid":
            return _unknown_choice(context["tag"], [tag.strip("'") for tag in context["expected_tags"].split(", ")])
        case "wrong_form":
            return f"is {shown}; {details['msg']}."
        case "union_tag_not_found":
            return "is missing; give it."
        case "model_attributes_type" | "model_type" | "dict_type":
            return f"is {shown}; must be a mapping."
        case "literal_error":
            return _unknown_choice(value, [text.strip("'") for text in context["expected"].replace(" or ", ", ").split(", ")])
        case "too_short":
            return f"has {context['actual_length']} entries; must have at least {context['min_length']}."
        case "too_long":
            return f"has too many entries; must have at most {context['max_length']}."
        case _:
            return f"is {shown}; {details['msg'][:1].lower()}{details['msg'][1:]}."


def _unknown_choice(value: Any, choices: list[str]) -> str:
    close = nearest_names(str(value), choices)
    advice = f" Did you mean {' or '.join(close)}?" if close else ""
    return f"is {value!r}; must be one of {', '.join(choices)}.{advice}"
