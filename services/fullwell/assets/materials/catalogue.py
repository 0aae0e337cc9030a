"""All materials by name, like "paint/red": what names exist, and one of them."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from types import MappingProxyType

from fullwell.assets.materials.coatings import coating_materials
from fullwell.assets.materials.lamps import lamp_materials
from fullwell.assets.materials.metals import metal_materials
from fullwell.assets.materials.model import SpectralMaterial
from fullwell.assets.materials.natural import natural_materials
from fullwell.assets.materials.textiles import textile_materials
from fullwell.core.errors import FieldError, unknown_name_message

__all__ = ["asset_material", "asset_material_names", "asset_materials"]


def asset_material(name: str, path: str = "") -> SpectralMaterial:
    """Return the material of a name like "paint/red", in any case; valid 380 to 1000 nm.

    Raises FieldError with the nearest names where there is none; `path` is the field that asked, for the error.
    """
    known = asset_materials()
    found = known.get(str(name).strip().casefold())
    if found is None:
        raise FieldError(unknown_name_message("material", str(name), known), path=path, value=name)
    return found


def asset_material_names() -> tuple[str, ...]:
    """Return all names, family by family."""
    return tuple(asset_materials())


@cache
def asset_materials() -> Mapping[str, SpectralMaterial]:
    """Return all materials by name; made on first use, in some hundredths of a second."""
    entries = (*coating_materials(), *metal_materials(), *natural_materials(), *textile_materials(), *lamp_materials())
    families = list(dict.fromkeys(_family(entry.name) for entry in entries))
    ordered = sorted(entries, key=lambda entry: families.index(_family(entry.name)))
    return MappingProxyType({entry.name: entry for entry in ordered})


def _family(name: str) -> str:
    return name.partition("/")[0]
