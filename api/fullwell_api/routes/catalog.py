"""Names that recipes may use."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum

from fastapi import APIRouter
from pydantic import BaseModel

__all__ = ["router"]

router = APIRouter(tags=["catalog"])


class CatalogKind(StrEnum):
    """What there are catalogues of."""

    SENSORS = "sensors"
    ILLUMINANTS = "illuminants"
    REFLECTANCES = "reflectances"
    MATERIALS = "materials"


class CatalogOut(BaseModel):
    """Names in alphabetical order."""

    items: list[str]


@router.get("/catalog/{kind}", summary="Names that recipes may use")
def catalog(kind: CatalogKind) -> CatalogOut:
    """Return the names of one catalogue."""
    return CatalogOut(items=sorted(_names(kind)))


def _names(kind: CatalogKind) -> Sequence[str]:
    # Imported late: the tables are read when somebody asks for them, not when the service starts.
    from fullwell import radiometry, sensor  # noqa: PLC0415

    match kind:
        case CatalogKind.SENSORS:
            return list(sensor.sensor_names())
        case CatalogKind.ILLUMINANTS:
            return list(radiometry.illuminant_names())
        case CatalogKind.REFLECTANCES:
            return list(radiometry.reflectance_names())
        case CatalogKind.MATERIALS:
            return list(radiometry.metal_names())
