"""Whatever stands in whatever place of a recipe: it is read, or refused with a RecipeError; nothing else happens."""

from __future__ import annotations

import copy
from collections.abc import Iterator
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fullwell.schema import RecipeError, load_recipe, validate

RICH: dict[str, Any] = {
    "schema": "fullwell/recipe/v1",
    "name": "rich",
    "seed": 1,
    "spectral": {"first_nm": 400, "last_nm": 700, "step_nm": 20},
    "scene": {
        "classes": ["a"],
        "materials": {
            "m1": {"kind": "rough_plastic", "reflectance": {"name": "cornell:red", "scale": 0.5}, "roughness": 0.2},
            "m2": {"kind": "conductor", "eta": 0.2, "k": {"wavelength_nm": [400, 700], "values": [2, 3]}},
            "m3": {"kind": "principled", "base_color": {"srgb": [0.1, 0.2, 0.3]}, "metallic": 0.5},
        },
        "objects": [
            {
                "id": "tetrahedron",
                "class": "a",
                "geometry": {
                    "kind": "mesh",
                    "vertices_m": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
                    "faces": [[0, 2, 1], [0, 1, 3]],
                },
                "material": "m1",
                "transform": [{"scale": 2}, {"rotate_deg": {"axis": [0, 1, 1], "angle_deg": 30}}, {"translate_m": [0, 0, 1]}],
            },
            {
                "id": "table",
                "parts": [
                    {"name": "top", "geometry": {"kind": "cube", "size_m": [1, 1, 0.1]}, "material": "m2"},
                    {"geometry": {"kind": "cylinder", "radius_m": 0.1, "height_m": 1}, "material": "m3"},
                ],
                "transform": {"look_at": {"origin_m": [0, 0, 0], "target_m": [0, 1, 0]}},
            },
        ],
        "lights": [
            {"name": "sun", "kind": "sun_sky", "time_utc": "2024-06-21T12:00:00Z", "latitude_deg": 48, "longitude_deg": 8},
            {
                "name": "spot",
                "kind": "spot",
                "position_m": [0, 0, 3],
                "target_m": [0, 0, 0],
                "beam_deg": 10,
                "cutoff_deg": 20,
                "luminous_flux_lm": 100,
                "spd": "blackbody:3000K",
            },
        ],
    },
    "cameras": [
        {
            "pose": {"origin_m": [5, 5, 5], "target_m": [0, 0, 0], "up": [0, 0, 1]},
            "lens": {"kind": "thin_lens", "f_number": 2, "focal_length_m": 0.005, "focus_distance_m": 7, "transmittance": 0.9},
            "sensors": [{"model": "ideal-rgb", "rows": 8, "cols": 8, "exposure": {"auto": {"method": "mean", "level": 0.2}}}],
        }
    ],
    "outputs": ["raw.npz"],
    "quality": {"samples_per_pixel": 4, "max_depth": 3, "oversampling": 2},
    "vary": {
        "grid": {"scene.materials.m1.roughness": [0.1, 0.2]},
        "random": {"frames": 2, "values": {"seed": {"distribution": "integer", "low": 0, "high": 9}}},
        "repeat": 2,
    },
}


def _places(value: Any, steps: tuple[str | int, ...] = ()) -> Iterator[tuple[str | int, ...]]:
    children = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, item in children:
        yield (*steps, key)
        yield from _places(item, (*steps, key))


PLACES = list(_places(RICH))
JUNK = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(max_size=8),
    st.sampled_from(["1e-3", "inf", "d65", "gold", "#ff0000", "../x", "asset:x", "sumo:x", "blackbody:nanK"]),
    st.sampled_from([[], {}, [[]], 1e308, 10**400]),
    st.lists(st.floats(), max_size=4),
    st.dictionaries(st.sampled_from(["kind", "name", "srgb", "values", "x"]), st.text(max_size=3) | st.floats(), max_size=2),
)  # fmt: skip


def test_the_rich_recipe_is_legal() -> None:
    validate(load_recipe(RICH))


@settings(max_examples=400, deadline=None)
@given(place=st.sampled_from(PLACES), junk=JUNK, replace=st.booleans())
@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_junk_in_any_place_is_read_or_refused(place: tuple[str | int, ...], junk: Any, replace: bool) -> None:
    recipe = copy.deepcopy(RICH)
    holder: Any = recipe
    for step in place[:-1]:
        holder = holder[step]
    if replace:
        holder[place[-1]] = junk
    elif isinstance(holder, list):
        holder.append(junk)
    else:
        holder["x" if isinstance(junk, float) else f"{place[-1]}s"] = junk
    problem: RecipeError | None = None
    try:
        validate(load_recipe(recipe))
    except RecipeError as error:
        problem = error
    assert problem is None or (len(problem.message) < 1000 and (problem.path or "recipe" in problem.message))
