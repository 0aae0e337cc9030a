"""Errors survive the queue; names are answered with the nearest."""

from __future__ import annotations

import copy
import importlib
import inspect
import pickle
import pkgutil

import pytest

import fullwell
from fullwell.core import FieldError, FullwellError, NotFoundError, Registry, nearest_names, unknown_name_message


def _all_errors() -> list[type[FullwellError]]:
    for module in pkgutil.walk_packages(fullwell.__path__, "fullwell."):
        if "render" in module.name or "traffic" in module.name or "migrations" in module.name:
            continue  # optional parts; their errors are the ones of core
        try:
            importlib.import_module(module.name)
        except ModuleNotFoundError as error:
            if (error.name or "").startswith("fullwell"):
                raise

    def below(kind: type[FullwellError]) -> list[type[FullwellError]]:
        return [kind, *(deeper for child in kind.__subclasses__() for deeper in below(child))]

    return [kind for kind in below(FullwellError) if kind.__module__.startswith("fullwell")]


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
def test_every_error_survives_pickling(protocol: int) -> None:
    errors = _all_errors()
    assert len(errors) >= 10
    for kind in errors:
        error = _example(kind)
        for copied in (pickle.loads(pickle.dumps(error, protocol)), copy.copy(error)):
            assert type(copied) is kind
            assert str(copied) == str(error)
            assert vars(copied) == vars(error)


def _example(kind: type[FullwellError]) -> FullwellError:
    """Return an error of a class whose constructor may want more than the message (an HTTP status, say)."""
    parameters = list(inspect.signature(kind).parameters.values())[1:]
    required = [p for p in parameters if p.default is p.empty and p.kind is p.POSITIONAL_OR_KEYWORD]
    return kind("what is wrong; what is legal; what to do.", *(400 for _ in required))


def test_a_field_error_keeps_field_and_value() -> None:
    error = FieldError("f_number is -1; must be > 0.", path="cameras[0].lens.f_number", value=-1.0)
    copied = pickle.loads(pickle.dumps(error))
    assert (copied.message, copied.path, copied.value, copied.code) == (error.message, error.path, -1.0, "invalid_field")


def test_a_field_error_keeps_large_values_short() -> None:
    assert len(FieldError("x", value=[0.0] * 10_000).value) == 200
    assert FieldError("x", value=object).value.startswith("<class")


def test_codes_of_errors_are_distinct() -> None:
    codes = [kind.code for kind in FullwellError.__subclasses__() if kind.__module__ == "fullwell.core.errors"]
    assert len(codes) == len(set(codes))


def test_the_nearest_names_come_first() -> None:
    known = ["D50", "D55", "D65", "LED-B1", "blackbody:3000K"]
    assert nearest_names("d66", known)[0] == "D65"
    assert nearest_names("LEDB1", known) == ["LED-B1"]
    assert nearest_names("zzz", known) == []


def test_an_unknown_name_without_neighbour_is_answered_with_the_list() -> None:
    assert unknown_name_message("lens", "zzz", ["b", "a"]) == "lens 'zzz' is not known; known are: a, b."
    assert unknown_name_message("lens", "zzz", map(str, range(20))).endswith(", ....")


def test_a_registry_makes_entries_once_and_ignores_case() -> None:
    made: list[str] = []
    registry: Registry[str] = Registry("sensor")
    registry.register("IMX363", lambda: made.append("x") or "entry")  # type: ignore[func-returns-value]
    assert registry.get("imx363") == registry.get("IMX363") == "entry"
    assert made == ["x"]
    assert "Imx363" in registry
    assert 3 not in registry
    assert list(registry) == ["IMX363"]
    assert len(registry) == 1


def test_a_registry_answers_an_unknown_name_with_the_nearest() -> None:
    registry: Registry[int] = Registry("sensor")
    registry.register("IMX363", lambda: 1)
    with pytest.raises(FieldError, match="sensor 'IMX336' is not known; did you mean 'IMX363'") as caught:
        registry.get("IMX336", path="cameras[0].sensor")
    assert caught.value.path == "cameras[0].sensor"


def test_a_registry_refuses_a_name_twice() -> None:
    registry: Registry[int] = Registry("sensor")
    registry.register("a", lambda: 1)
    with pytest.raises(ValueError, match="twice"):
        registry.register("A", lambda: 2)


def test_errors_of_one_family_are_caught_together() -> None:
    with pytest.raises(FullwellError):
        raise NotFoundError("no object 'k'.")
