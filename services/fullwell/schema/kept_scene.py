"""The last scene that a process made, for the next recipe that asks for the same."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from fullwell.schema.errors import RecipeError

if TYPE_CHECKING:
    from fullwell.schema.conversion.context import Context, RecipeFiles
    from fullwell.schema.conversion.scenes import PlacedScene

__all__ = ["KeptScene"]


@dataclass(frozen=True, slots=True, eq=False)
class _Entry:
    key: bytes
    scene: PlacedScene
    context: Context


class KeptScene:
    """One scene with what its making noted; recipes that differ in cameras' sensors, outputs or quality share it.

    The scene is the very same object, so what was worked out of it (digests, bounds, labels) is not worked out again. A
    builder has one of its own unless it is given another. Not for use by several threads at once.
    """

    def __init__(self) -> None:
        self._entry: _Entry | None = None

    def get(self, key: bytes, files: RecipeFiles) -> tuple[PlacedScene, Context] | None:
        """Return the scene of a key, where the files it was made of are for `files` what they were then; else None."""
        entry = self._entry
        if entry is None or entry.key != key or not _same_files(entry.context, files):
            return None
        return entry.scene, entry.context

    def put(self, key: bytes, scene: PlacedScene, context: Context) -> None:
        """Keep a scene instead of the one before."""
        self._entry = _Entry(key, scene, context)


def _same_files(context: Context, files: RecipeFiles) -> bool:
    if context.files is files:
        return True
    try:
        return all(files.find(name, "files")[1] == digest for name, digest in context.used_files.items())
    except RecipeError:  # not to be read from where this recipe is: making the scene anew says so, or does without
        return False
