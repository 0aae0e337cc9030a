"""All that lives, of the starter library."""

from __future__ import annotations

from typing import Final

from fullwell.assets.starter.animals import ANIMALS
from fullwell.assets.starter.building import StarterEntry
from fullwell.assets.starter.cyclists import CYCLISTS
from fullwell.assets.starter.motorcyclists import MOTORCYCLISTS
from fullwell.assets.starter.people import PEOPLE
from fullwell.assets.starter.plants import PLANTS
from fullwell.assets.starter.trees import TREES

__all__ = ["LIVING"]

LIVING: Final[tuple[StarterEntry, ...]] = (*PEOPLE, *CYCLISTS, *MOTORCYCLISTS, *ANIMALS, *TREES, *PLANTS)
"""People, cyclists, motorcyclists, animals, trees, bushes, grass and rocks."""
