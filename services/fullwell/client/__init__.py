"""Python client of the service: submit recipes, watch their frames, fetch verified products. Loads nothing heavy."""

from fullwell.client.assets import Asset, AssetClient, AssetEvent, AssetPage, Import, Ingestion
from fullwell.client.client import FullwellClient
from fullwell.client.errors import ApiError, ApiProblem
from fullwell.client.records import Attempt, Event, Fetched, Frame, FrameCounts, FrameDetail, Job, Product, Verdict

__all__ = [
    "ApiError",
    "ApiProblem",
    "Asset",
    "AssetClient",
    "AssetEvent",
    "AssetPage",
    "Attempt",
    "Event",
    "Fetched",
    "Frame",
    "FrameCounts",
    "FrameDetail",
    "FullwellClient",
    "Import",
    "Ingestion",
    "Job",
    "Product",
    "Verdict",
]
