"""The job function that service and command line share: a recipe document and a frame number in, a published frame out."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from fullwell.pipeline.cache import LightCache
from fullwell.pipeline.frame import render_frame
from fullwell.pipeline.progress import CancelCheck, FrameProgress, ProgressCallback
from fullwell.pipeline.stage_store import StageStore
from fullwell.schema import KeptScene, RecipeBuilder, RecipeDocument
from fullwell.storage import ObjectStore

__all__ = ["run_frame"]

_process_cache = LightCache()
"""One per process: successive frames of a job that share their radiance render once."""

_process_scene = KeptScene()
"""One per process: successive recipes of the same scene make it once."""


def run_frame(
    document: RecipeDocument,
    index: int,
    store: ObjectStore,
    prefix: str,
    *,
    base_dir: Path | None = None,
    builder: RecipeBuilder | None = None,
    stages: StageStore | None = None,
    skip: bool = True,
    progress: ProgressCallback | None = None,
    should_cancel: CancelCheck | None = None,
) -> dict[str, Any]:
    """Build frame `index` of the recipe, make it, publish it under `prefix` and return its manifest.

    `base_dir` is the folder that the recipe's file names are relative to; `builder`, made once for the same document, spares
    successive frames from reading its models again; `stages` keeps rendered light for later runs and other workers; without
    `skip` the planner leaves nothing out. Errors and idempotence are those of `render_frame`; a frame number that the recipe
    does not have is a FieldError.
    """
    if progress is not None:
        progress(FrameProgress("load", 0.0))
    frame = (builder or RecipeBuilder(document, base_dir=base_dir, kept=_process_scene)).frame(index)
    return render_frame(
        frame, store, prefix, cache=_process_cache, stages=stages, skip=skip, progress=progress, should_cancel=should_cancel
    )
