"""Python client of the service: submit recipes, watch their frames, fetch verified products. Loads nothing heavy."""

from fullwell.client.client import FullwellClient
from fullwell.client.errors import ApiError, ApiProblem
from fullwell.client.records import Attempt, Event, Fetched, Frame, FrameCounts, FrameDetail, Job, Product, Verdict

__all__ = [
    "ApiError",
    "ApiProblem",
    "Attempt",
    "Event",
    "Fetched",
    "Frame",
    "FrameCounts",
    "FrameDetail",
    "FullwellClient",
    "Job",
    "Product",
    "Verdict",
]
