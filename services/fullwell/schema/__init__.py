"""Recipes: read, validated, varied, and turned once into the dataclasses that the numerics see."""

from fullwell.schema.building import RecipeBuilder, build_frame, frame_document, validate
from fullwell.schema.errors import Problem, RecipeError
from fullwell.schema.kept_scene import KeptScene
from fullwell.schema.loading import load_recipe
from fullwell.schema.paths import apply_override
from fullwell.schema.v1.recipe import RecipeDocument

__all__ = [
    "KeptScene",
    "Problem",
    "RecipeBuilder",
    "RecipeDocument",
    "RecipeError",
    "apply_override",
    "build_frame",
    "frame_document",
    "load_recipe",
    "validate",
]
