"""What is built and made, of the starter library: buildings, street furniture, lights, signs, clutter."""

from __future__ import annotations

from fullwell.assets.starter.building import StarterEntry
from fullwell.assets.starter.buildings import BUILDINGS
from fullwell.assets.starter.clutter import CLUTTER
from fullwell.assets.starter.furniture import FURNITURE
from fullwell.assets.starter.lights import LIGHTS
from fullwell.assets.starter.signs import SIGNS

__all__ = ["BUILT"]

BUILT: tuple[StarterEntry, ...] = (*BUILDINGS, *LIGHTS, *SIGNS, *FURNITURE, *CLUTTER)
"""All entries made here, with unique ids."""
