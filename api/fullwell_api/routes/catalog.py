"""Names that recipes may use."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum

from fastapi import APIRouter
from pydantic import BaseModel

from fullwell.core import FieldError, NotFoundError

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


class CurveOut(BaseModel):
    """A curve from 380 to 1000 nm by 5 nm."""

    label: str
    wavelength_nm: list[float]
    values: list[float]


class LampOut(BaseModel):
    """Emission of a lit part."""

    luminance_cd_m2: float
    range_cd_m2: tuple[float, float]
    group: str


class MaterialOut(BaseModel):
    """An entry of the material catalogue, with what it sends back (lamps: emits) by wavelength."""

    name: str
    title: str
    kind: str
    basis: str
    source: str
    roughness: float
    interior_index: float
    tags: list[str]
    retroreflective: bool
    srgb: tuple[float, float, float]
    lamp: LampOut | None
    curve: CurveOut


@router.get("/catalog/materials/{family}/{name}", summary="A material and its spectrum")
def material(family: str, name: str) -> MaterialOut:
    """Return a material of the catalogue, such as paint/red: where its figures are from, and its curve to plot."""
    from fullwell.assets.materials.catalogue import asset_material  # noqa: PLC0415
    from fullwell.assets.materials.colours import display_srgb, spectrum_points  # noqa: PLC0415

    try:
        found = asset_material(f"{family}/{name}")
    except FieldError as error:
        raise NotFoundError(str(error)) from None
    points = spectrum_points(found)
    lamp = found.lamp
    return MaterialOut(
        name=found.name,
        title=found.title,
        kind=found.kind,
        basis=found.basis,
        source=found.source,
        roughness=found.roughness,
        interior_index=found.interior_index,
        tags=list(found.tags),
        retroreflective=found.retroreflective,
        srgb=display_srgb(found),
        lamp=None
        if lamp is None
        else LampOut(luminance_cd_m2=lamp.luminance_cd_m2, range_cd_m2=lamp.range_cd_m2, group=lamp.group),
        curve=CurveOut(
            label=points[0][2],
            wavelength_nm=[round(point[0], 3) for point in points],
            values=[round(point[1], 6) for point in points],
        ),
    )


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
            from fullwell.assets.materials.catalogue import asset_material_names  # noqa: PLC0415

            # Entries of the catalogue by their two-part names, and the metals of `kind: conductor`.
            return [*asset_material_names(), *radiometry.metal_names()]
