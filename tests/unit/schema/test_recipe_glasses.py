"""Refractive indices in a recipe: numbers, glasses by name, n_d and Abbe number."""

from __future__ import annotations

from typing import Any

import pytest

from fullwell.radiometry.glasses import glass, glass_from_abbe
from fullwell.scene import Dielectric
from fullwell.schema import RecipeError, build_frame, load_recipe


def scene_glass(recipe: dict[str, Any], index: Any) -> Dielectric:
    recipe["scene"]["materials"]["paint"] = {"kind": "dielectric", "interior_index": index}
    material = build_frame(load_recipe(recipe)).scene.objects[0].parts[0].material
    assert isinstance(material, Dielectric)
    return material


@pytest.mark.parametrize("written", [1.6, "1.6e0"])
def test_a_number_is_the_same_at_every_wavelength(recipe: dict[str, Any], written: Any) -> None:
    assert scene_glass(recipe, written).interior_index == 1.6


def test_a_name_is_the_glass_of_the_catalogue(recipe: dict[str, Any]) -> None:
    assert scene_glass(recipe, "glass:N-BK7").interior_index is glass("N-BK7")


def test_an_abbe_number_makes_a_cauchy_curve(recipe: dict[str, Any]) -> None:
    index = scene_glass(recipe, {"n_d": 1.58, "abbe": 30}).interior_index
    assert not isinstance(index, float)
    assert index.at(486.0) == glass_from_abbe(1.58, 30).at(486.0)


@pytest.mark.parametrize(
    ("written", "path", "words"),
    [
        ("glass:N-BK8", "interior_index", "did you mean 'N-BK7'"),
        (0.5, "interior_index", ">= 1"),
        ({"n_d": 1.5}, "interior_index.abbe", "is missing"),
        ({"n_d": 9, "abbe": 30}, "interior_index.n_d", "<= 5"),
        ({"n_d": 1.5, "abbe": 0}, "interior_index.abbe", ">= 10"),
        ({"nd": 1.5, "abbe": 30}, "interior_index.nd", "did you mean n_d"),
        (True, "interior_index", "must be a number"),
        ([1.5], "interior_index", "must be a number"),
    ],
)
def test_nonsense_is_refused_where_it_stands(recipe: dict[str, Any], written: Any, path: str, words: str) -> None:
    with pytest.raises(RecipeError) as caught:
        scene_glass(recipe, written)
    told = [(str(error), getattr(error, "path", "")) for error in getattr(caught.value, "errors", None) or [caught.value]]
    assert any(words in text and where == f"scene.materials.paint.{path}" for text, where in told), told
