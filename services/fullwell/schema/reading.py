"""Recipe text to plain data: bounded, without surprises, and with duplicate keys refused.

YAML is read by the rules of YAML 1.2: only ``true`` and ``false`` are booleans (``no`` and ``on`` are text), ``1e-3`` is a
number, ``12:30:00`` and dates are text. Aliases and merge keys work, but may not blow up: the document is measured with
all of them expanded before anything is built from it.
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from fullwell.core.errors import NotFoundError
from fullwell.schema.errors import RecipeError

__all__ = ["MAX_BYTES", "MAX_DEPTH", "MAX_JSON_NODES", "MAX_YAML_NODES", "parse_text", "parse_value", "read_source"]

MAX_BYTES = 10_000_000
MAX_YAML_NODES = 100_000
"""Scalars, lists and mappings of a YAML recipe, aliases expanded: about a second of reading."""
MAX_JSON_NODES = 2_000_000
MAX_DEPTH = 64

_BaseLoader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class _Loader(_BaseLoader):  # type: ignore[misc]
    """A safe loader with the scalars of YAML 1.2 and unique text keys."""

    yaml_implicit_resolvers: dict[str, Any] = {}  # noqa: RUF012 - PyYAML's own class-level protocol

    def construct_mapping(self, node: Any, deep: bool = False) -> dict[str, Any]:
        if not isinstance(node, yaml.MappingNode):
            raise yaml.constructor.ConstructorError(None, None, "expected a mapping", node.start_mark)
        seen: set[str] = set()
        for key_node, _ in node.value:
            if key_node.tag == "tag:yaml.org,2002:merge":
                continue
            if not isinstance(key_node, yaml.ScalarNode):
                raise yaml.constructor.ConstructorError(None, None, "a key must be text", key_node.start_mark)
            if key_node.value in seen:
                problem = f"the key {key_node.value!r} occurs twice in one mapping; keep one of them"
                raise yaml.constructor.ConstructorError(None, None, problem, key_node.start_mark)
            seen.add(key_node.value)
            key_node.tag = "tag:yaml.org,2002:str"
        return super().construct_mapping(node, deep=deep)  # type: ignore[no-any-return]


def _resolve(kind: str, pattern: str, first: str) -> None:
    _Loader.add_implicit_resolver(f"tag:yaml.org,2002:{kind}", re.compile(f"^(?:{pattern})$"), list(first))


_resolve("bool", "true|True|TRUE|false|False|FALSE", "tTfF")
_resolve("int", "[-+]?[0-9]+", "-+0123456789")
_resolve("float", r"[-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?", "-+.0123456789")
_resolve("float", r"[-+]?\.(?:inf|Inf|INF)|\.(?:nan|NaN|NAN)", "-+.")
_resolve("null", "~|null|Null|NULL|", "~nN\0")
_Loader.yaml_implicit_resolvers.setdefault("", []).append(("tag:yaml.org,2002:null", re.compile("^$")))
_resolve("merge", "<<", "<")


def _construct_int(loader: Any, node: Any) -> int:
    text = loader.construct_scalar(node)
    if len(text) > 40:  # decimal conversion of a megabyte of digits is quadratic (and refused by Python)
        raise yaml.constructor.ConstructorError(None, None, "a number has more than 40 digits", node.start_mark)
    return int(text)


def _construct_float(loader: Any, node: Any) -> float:
    text = loader.construct_scalar(node).lower()
    return float(text.replace(".inf", "inf").replace(".nan", "nan"))


_Loader.add_constructor("tag:yaml.org,2002:int", _construct_int)
_Loader.add_constructor("tag:yaml.org,2002:float", _construct_float)


def read_source(source: Path | str | bytes | Mapping[str, Any]) -> tuple[dict[str, Any], Path | None]:
    """Return a recipe as plain data (a copy) and the folder its files are relative to (None unless it came from a file).

    A ``str`` that holds a line break or starts with ``{`` is the text of a recipe, any other one is a path. Raises
    RecipeError, or NotFoundError where the file does not exist.
    """
    if isinstance(source, Mapping):
        return dict(_measured(source)), None
    if isinstance(source, str) and not ("\n" in source or source.lstrip().startswith("{")):
        source = Path(source)
    if isinstance(source, Path):
        return _top_level(parse_text(_file_bytes(source))), source.resolve().parent
    return _top_level(parse_text(source)), None


def _file_bytes(path: Path) -> bytes:
    if not path.is_file():
        raise NotFoundError(f"recipe file {str(path)!r} does not exist or is not a file. Check the path.")
    with path.open("rb") as stream:
        return stream.read(MAX_BYTES + 1)


def _top_level(data: Any) -> dict[str, Any]:
    if not isinstance(data, dict):
        given = "empty" if data is None else f"a {type(data).__name__}"
        raise RecipeError(f"the recipe is {given}; must be a mapping that starts with 'schema: fullwell/recipe/v1'.")
    return data


def parse_value(text: str) -> Any:
    """Return what a command-line value means, read as YAML: ``0.01``, ``true``, ``[1, 2]``, ``{auto: {}}``, ``text``."""
    return parse_text(text)


def parse_text(text: str | bytes) -> Any:
    """Return the plain data of YAML or JSON text. Raises RecipeError with line and column where there is one."""
    if len(text) > MAX_BYTES:
        raise RecipeError(f"the recipe is longer than {MAX_BYTES // 10**6} MB; put meshes and tables into files.")
    if isinstance(text, bytes):
        try:
            text = text.decode("utf-8-sig")
        except UnicodeDecodeError as error:
            raise RecipeError(f"the recipe is not UTF-8 text (byte {error.start}); save it as UTF-8.") from None
    if text.lstrip().startswith(("{", "[")):
        try:
            return _measured(json.loads(text, object_pairs_hook=_unique_keys))
        except (json.JSONDecodeError, RecursionError):
            pass  # flow-style YAML may also start with a brace; the YAML reader has the better message for both
        except ValueError as error:
            raise RecipeError(f"the recipe cannot be read: {error}.") from None
    return _parse_yaml(text)


def _unique_keys(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    mapping = dict(pairs)
    if len(mapping) != len(pairs):
        keys = [key for key, _ in pairs]
        twice = next(key for key in keys if keys.count(key) > 1)
        raise ValueError(f"the key {twice!r} occurs twice in one mapping; keep one of them")
    return mapping


def _parse_yaml(text: str) -> Any:
    try:
        _check_events(text)
        loader = _Loader(text)
        try:
            node = loader.get_single_node()
            if node is None:
                return None
            _check_expanded(node)
            # A copy, because aliases share their objects and overrides change single places.
            return _measured(loader.construct_document(node))
        finally:
            loader.dispose()
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = "" if mark is None else f" at line {mark.line + 1}, column {mark.column + 1}"
        raise RecipeError(f"the recipe cannot be read{where}: {error.problem or error.context}.") from None
    except yaml.YAMLError as error:
        raise RecipeError(f"the recipe cannot be read: {' '.join(str(error).split())}.") from None
    except ValueError as error:
        raise RecipeError(f"the recipe cannot be read: {error}.") from None


def _check_events(text: str) -> None:
    """Refuse text that nests or lists too much before the recursive composer sees it."""
    depth = 0
    for count, event in enumerate(yaml.parse(text, Loader=_BaseLoader)):
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
            if depth > MAX_DEPTH:
                raise _too_deep()
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1
        if count > 2 * MAX_YAML_NODES:
            raise _too_many(MAX_YAML_NODES)


def _check_expanded(root: Any) -> None:
    """Refuse aliases that expand without measure (each node counts as often as it is referred to) or refer to themselves."""
    sizes: dict[int, int] = {}
    open_nodes: set[int] = set()

    def size(node: Any) -> int:
        known = sizes.get(id(node))
        if known is not None:
            return known
        if id(node) in open_nodes:
            raise RecipeError("an alias in the recipe refers to what it is part of; write the value out.")
        open_nodes.add(id(node))
        total = 1
        if isinstance(node, yaml.SequenceNode):
            total += sum(size(child) for child in node.value)
        elif isinstance(node, yaml.MappingNode):
            total += sum(size(key) + size(value) for key, value in node.value)
        open_nodes.discard(id(node))
        sizes[id(node)] = total
        if total > MAX_YAML_NODES:
            raise _too_many(MAX_YAML_NODES)
        return total

    size(root)


def _measured(data: Any) -> Any:
    """Return a copy of plain data, refused where it is too large or too deep. Arrays become lists, numpy numbers numbers."""
    count = 0

    def copy(value: Any, depth: int) -> Any:
        nonlocal count
        count += 1
        if count > MAX_JSON_NODES:
            raise _too_many(MAX_JSON_NODES)
        if depth > MAX_DEPTH:
            raise _too_deep()
        if isinstance(value, Mapping):
            return {_text_key(key): copy(item, depth + 1) for key, item in value.items()}
        if isinstance(value, list | tuple):
            return [copy(item, depth + 1) for item in value]
        if hasattr(value, "tolist"):
            return copy(value.tolist(), depth)
        return value

    return copy(data, 0)


def _text_key(key: Any) -> str:
    if not isinstance(key, str):
        raise RecipeError(f"the key {key!r} is not text; every key of a recipe is.")
    return key


def _too_many(limit: int) -> RecipeError:
    return RecipeError(f"the recipe has more than {limit} values; put meshes and tables into files.")


def _too_deep() -> RecipeError:
    return RecipeError(f"the recipe nests deeper than {MAX_DEPTH} levels; no legal recipe does.")
