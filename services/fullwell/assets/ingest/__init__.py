"""Ingestion: model files and generated things become assets with levels of detail, materials and a report."""

from fullwell.assets.ingest.canonical import read_level, write_level
from fullwell.assets.ingest.options import IngestError, IngestLimits, IngestOptions
from fullwell.assets.ingest.prepare import IngestProgress, prepare_built, prepare_file
from fullwell.assets.ingest.process import IngestProcess, prepare_in_child

__all__ = [
    "IngestError",
    "IngestLimits",
    "IngestOptions",
    "IngestProcess",
    "IngestProgress",
    "prepare_built",
    "prepare_file",
    "prepare_in_child",
    "read_level",
    "write_level",
]
