"""From a recipe to published frames: plan, stages, keys, cache, frame runner."""

from fullwell.pipeline.cache import LightCache, with_cache_steps
from fullwell.pipeline.frame import MANIFEST_NAME, MANIFEST_SCHEMA, render_frame
from fullwell.pipeline.plan import FramePlan, plan_document, plan_frame
from fullwell.pipeline.progress import CancelCheck, FrameProgress, ProgressCallback
from fullwell.pipeline.run import run_frame
from fullwell.pipeline.stage_store import StageStore
from fullwell.pipeline.steps import PlanStep

__all__ = [
    "MANIFEST_NAME",
    "MANIFEST_SCHEMA",
    "CancelCheck",
    "FramePlan",
    "FrameProgress",
    "LightCache",
    "PlanStep",
    "ProgressCallback",
    "StageStore",
    "plan_document",
    "plan_frame",
    "render_frame",
    "run_frame",
    "with_cache_steps",
]
