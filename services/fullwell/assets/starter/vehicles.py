"""The vehicles of the starter library."""

from __future__ import annotations

from typing import Final

from fullwell.assets.starter.building import StarterEntry
from fullwell.assets.starter.cars import car
from fullwell.assets.starter.vehicle_models import CAR_MODELS

__all__ = ["VEHICLES"]

VEHICLES: Final[tuple[StarterEntry, ...]] = (
    *(StarterEntry(name, title, car, {"spec": spec}, seed) for seed, (name, title, spec) in enumerate(CAR_MODELS, start=1)),
)
"""All entries."""
