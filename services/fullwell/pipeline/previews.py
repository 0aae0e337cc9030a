"""Pictures of an asset for people: a turntable of eight views, and a chart of its materials, by the engine itself."""

from __future__ import annotations

import io
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, Protocol

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFilter

from fullwell.assets.materials.catalogue import asset_material
from fullwell.assets.materials.colours import spectrum_points
from fullwell.assets.records import AssetManifest, MaterialChoice
from fullwell.assets.store import PREVIEW_PREFIX, preview_key
from fullwell.core.hashing import digest_of
from fullwell.dataset.drawing import BACKGROUND, FAINT, INK, PANEL, font, nice_ticks
from fullwell.pipeline.frame import MANIFEST_NAME
from fullwell.pipeline.run import run_frame
from fullwell.radiometry import reflectance_from_srgb
from fullwell.schema import RecipeBuilder, RecipeDocument, load_recipe
from fullwell.schema.assets import StoredAssetFiles
from fullwell.storage import ObjectStore

__all__ = ["PREVIEW_NAMES", "PreviewRunner", "preview_recipe", "render_previews"]

VIEWS: Final = 8
PREVIEW_NAMES: Final = ("thumb", *(f"view_{number}" for number in range(VIEWS)), "turntable", "chart")
"""Pictures of an asset, each ``assets/previews/<look digest>/<name>.png`` in the store."""

_VIEW_PX: Final = (256, 192)
_FINER: Final = 2
"""Sensor pixels along each side of a picture's pixel: the mosaic of the colour filters is averaged away."""
_SAMPLES: Final = 8
_ELEVATION_DEG: Final = 14.0
_FIRST_AZIMUTH_DEG: Final = 40.0
_HFOV_DEG: Final = 32.0
_MARGIN: Final = 1.08
_SKY_CD_M2: Final = 3000.0
_KEY_LUX: Final = 12_000.0
_KEY_DIRECTION: Final = (-0.45, 0.35, -0.82)
_MOST_MATERIALS: Final = 12
_BALLS_PX: Final = 96
_ROW_PX: Final = (640, 110)


class PreviewRunner(Protocol):
    """What renders a recipe's frame: a worker's isolated runner, for example."""

    def __call__(
        self,
        document: RecipeDocument,
        index: int,
        store: ObjectStore,
        prefix: str,
        *,
        base_dir: Path | None,
        progress: Callable[[Any], None] | None,
        should_cancel: Callable[[], bool] | None,
    ) -> Any:
        """Return when the frame is in the store."""
        ...


def render_previews(
    manifest: AssetManifest,
    store: ObjectStore,
    *,
    runner: PreviewRunner | None = None,
    assets: StoredAssetFiles | None = None,
    progress: Callable[[float], None] | None = None,
    should_cancel: Callable[[], bool] | None = None,
) -> tuple[str, ...]:
    """Render an asset's previews, put them into the store, and return their keys.

    The asset's manifest and levels are in the store already. `runner` renders elsewhere; without it this process does, with
    the assets that `assets` finds. Nothing is done where all pictures are there: they belong to what can be seen.

    Raises
    ------
    FullwellError
        What rendering raises; nothing is left in the store but the frame's own folder, which the next attempt replaces.
    """
    prefix = f"{PREVIEW_PREFIX}/{manifest.look_digest}"
    keys = tuple(preview_key(manifest.look_digest, name) for name in PREVIEW_NAMES)
    if all(store.exists(key) for key in keys):
        return keys
    steps = [preview_recipe(manifest), materials_recipe(manifest)]
    report = progress or (lambda _: None)
    for number, (name, document) in enumerate(zip(("views", "materials"), steps, strict=True)):
        if document is not None:
            _run(
                document,
                store,
                f"{prefix}/under-way/{name}",
                runner=runner,
                assets=assets,
                should_cancel=should_cancel,
                progress=_part(report, number),
            )
    views = [_picture(store, f"{prefix}/under-way/views/view_{number}/image.png") for number in range(VIEWS)]
    balls = None if steps[1] is None else _picture(store, f"{prefix}/under-way/materials/image.png")
    pictures = {f"view_{number}": view for number, view in enumerate(views)}
    pictures |= {"thumb": views[0], "turntable": _sheet(views), "chart": materials_chart(manifest, balls)}
    for name, key in zip(PREVIEW_NAMES, keys, strict=True):
        store.put(key, _png(pictures[name]), "image/png")
    store.delete_prefix(f"{prefix}/under-way/")
    return keys


def _part(report: Callable[[float], None], number: int) -> Callable[[Any], None]:
    start, share = (0.0, 0.85) if number == 0 else (0.85, 0.15)
    return lambda at: report(start + share * float(at.fraction))


def _run(
    document: RecipeDocument,
    store: ObjectStore,
    prefix: str,
    *,
    runner: PreviewRunner | None,
    assets: StoredAssetFiles | None,
    should_cancel: Callable[[], bool] | None,
    progress: Callable[[Any], None],
) -> None:
    store.delete(f"{prefix}/{MANIFEST_NAME}")
    if runner is not None:
        runner(document, 0, store, prefix, base_dir=None, progress=progress, should_cancel=should_cancel)
        return
    builder = RecipeBuilder(document, assets=assets)
    run_frame(document, 0, store, prefix, builder=builder, progress=progress, should_cancel=should_cancel)


def preview_recipe(manifest: AssetManifest) -> RecipeDocument:
    """Return the recipe of the eight views: the asset on grey ground under a soft sky and a key light."""
    size = np.asarray(manifest.size_m)
    centre = [0.0, 0.0, float(size[2]) / 2]
    radius_m = float(np.linalg.norm(size)) / 2
    distance_m = _distance_m(size)
    asset = {"kind": "asset", "id": f"{manifest.id}@{manifest.digest}"}
    ground_m = max(400.0 * radius_m, 10.0)
    return _document(
        f"preview {manifest.id}"[:120],
        objects=[
            {"id": "asset", "geometry": asset, "inside_ok": True},
            {
                "id": "ground",
                "geometry": {"kind": "disk", "radius_m": ground_m},
                # Just below: flat assets that lie on the ground must not fight with it.
                "transform": {"translate_m": [0, 0, -0.001 * radius_m]},
                "material": {"kind": "diffuse", "reflectance": _GROUND},
                "inside_ok": True,
            },
        ],
        cameras=[_camera(f"view_{number}", _place(number, distance_m, centre), centre) for number in range(VIEWS)],
        samples=_SAMPLES,
    )


_GROUND: Final = 0.42
"""About as bright under sky and key light as the sky is itself, so that the horizon does not show."""


def _distance_m(size_m: NDArray[np.float64]) -> float:
    """Return the distance [m] from which a box of this size fits into every view, as near as that allows."""
    corners = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)]) * size_m
    tangent = math.tan(math.radians(_HFOV_DEG / 2)) / _MARGIN
    limits = np.array([tangent, tangent * _VIEW_PX[1] / _VIEW_PX[0]])
    needed = 0.0
    for number in range(VIEWS):
        towards = np.array(_direction(number))
        right = np.cross([0.0, 0.0, 1.0], towards)
        right /= np.linalg.norm(right)
        aside = np.abs(corners @ np.stack([right, np.cross(towards, right)], axis=1))
        # A corner that is nearer than the centre by `ahead` needs (distance - ahead) * limit >= aside.
        ahead = corners @ towards
        needed = max(needed, float((aside / limits + ahead[:, None]).max()))
    return needed


def _direction(number: int) -> tuple[float, float, float]:
    """Return the unit vector from the asset towards a view's camera."""
    azimuth, elevation = math.radians(_FIRST_AZIMUTH_DEG + 360.0 * number / VIEWS), math.radians(_ELEVATION_DEG)
    return math.cos(elevation) * math.cos(azimuth), math.cos(elevation) * math.sin(azimuth), math.sin(elevation)


def _place(number: int, distance_m: float, centre_m: list[float]) -> list[float]:
    return [middle + distance_m * towards for middle, towards in zip(centre_m, _direction(number), strict=True)]


def _camera(name: str, origin_m: list[float], target_m: list[float]) -> dict[str, Any]:
    return {
        "name": name,
        "pose": {"origin_m": origin_m, "target_m": target_m},
        "lens": {"hfov_deg": _HFOV_DEG, "f_number": 8, "diffraction": False},
        "sensors": [
            {
                "name": "main",
                "model": "ideal-rgb",
                "cols": _FINER * _VIEW_PX[0],
                "rows": _FINER * _VIEW_PX[1],
                # A white sheet that faces the key light stays below the full well.
                "exposure": {"time_s": _EXPOSURE_S},
            }
        ],
    }


_EXPOSURE_S: Final = 0.026


def _document(name: str, *, objects: list[Any], cameras: list[Any], samples: int) -> RecipeDocument:
    return load_recipe(
        {
            "schema": "fullwell/recipe/v1",
            "name": name,
            "scene": {
                "objects": objects,
                "lights": [
                    {"kind": "constant_environment", "name": "sky", "luminance_cd_m2": _SKY_CD_M2, "spd": "d65"},
                    {
                        "kind": "directional",
                        "name": "key",
                        "direction": _KEY_DIRECTION,
                        "illuminance_lux": _KEY_LUX,
                        "spd": "d55",
                    },
                ],
            },
            "cameras": cameras,
            "outputs": ["image.png"],
            # Glints of lamps and key light on polished parts, seen by way of the ground, would need thousands of samples.
            "quality": {"samples_per_pixel": samples, "max_depth": 5, "max_sample_saturation": 1.5},
        }
    )


# Materials -----------------------------------------------------------------------------------------------------------


def _materials(manifest: AssetManifest) -> list[MaterialChoice]:
    """Return the different materials, those of the largest area first."""
    areas: dict[str, tuple[float, MaterialChoice]] = {}
    for part in manifest.parts:
        choice = part.material
        key = choice.name or digest_of([choice.base_color_srgb, choice.roughness, choice.metallic, choice.origin])
        areas[key] = (areas.get(key, (0.0, choice))[0] + part.area_m2, choice)
    ordered = sorted(areas.items(), key=lambda pair: (-pair[1][0], pair[0]))
    return [choice for _, (_, choice) in ordered[:_MOST_MATERIALS]]


def materials_recipe(manifest: AssetManifest) -> RecipeDocument | None:
    """Return a recipe that shows a ball of each material in a column, None where there are none."""
    choices = _materials(manifest)
    if not choices:
        return None
    objects = [
        {
            "id": f"ball_{number}",
            "geometry": {"kind": "sphere", "radius_m": 0.42},
            "transform": {"translate_m": [0, 0, -float(number)]},
            "material": _ball_material(choice),
            "inside_ok": True,
        }
        for number, choice in enumerate(choices)
    ]
    middle = -(len(choices) - 1) / 2
    camera = _camera("main", [1000.0, 0.0, middle], [0.0, 0.0, middle])
    camera["lens"]["hfov_deg"] = math.degrees(2 * math.atan(0.5 / 1000.0))
    camera["sensors"][0] |= {"cols": _FINER * _BALLS_PX, "rows": _FINER * _BALLS_PX * len(choices)}
    return _document(f"materials {manifest.id}"[:120], objects=objects, cameras=[camera], samples=16)


def _ball_material(choice: MaterialChoice) -> Any:
    if choice.name:
        return choice.name
    colour = {"srgb": list(choice.base_color_srgb)}
    return {
        "kind": "principled",
        "base_color": colour,
        "roughness": max(choice.roughness, 0.05),
        "metallic": choice.metallic,
    }


def materials_chart(manifest: AssetManifest, balls: Image.Image | None) -> Image.Image:
    """Return the chart: for each material its ball, its name, where it comes from, and its spectrum."""
    choices = _materials(manifest)
    width, height = _ROW_PX
    chart = Image.new("RGB", (width, max(1, len(choices)) * height), BACKGROUND)
    pen = ImageDraw.Draw(chart)
    if not choices or balls is None:
        pen.text((12, 12), "no materials", fill=FAINT, font=font(14))
        return chart
    for number, choice in enumerate(choices):
        top = number * height
        ball = balls.crop((0, number * _BALLS_PX, _BALLS_PX, (number + 1) * _BALLS_PX))
        chart.paste(ball, (7, top + (height - _BALLS_PX) // 2))
        pen.text((116, top + 14), _shown_name(choice)[:26], fill=INK, font=font(15))
        pen.text((116, top + 38), _origin(choice), fill=FAINT, font=font(12))
        for line, text in enumerate(_figures(choice)):
            pen.text((116, top + 56 + 16 * line), text, fill=FAINT, font=font(12))
        _plot(pen, (330, top + 8, width - 12, top + height - 22), _curve(choice))
    return chart


def _shown_name(choice: MaterialChoice) -> str:
    return choice.name or ("texture" if choice.origin == "texture" else "colour of the file")


def _origin(choice: MaterialChoice) -> str:
    if choice.name:
        return f"{asset_material(choice.name).kind}, {asset_material(choice.name).basis}, by {choice.origin}"
    return "spectrum made up from sRGB"


def _figures(choice: MaterialChoice) -> list[str]:
    if not choice.name:
        return [f"roughness {choice.roughness:.2f}, metallic {choice.metallic:.2f}"]
    material = asset_material(choice.name)
    figures = [f"roughness {material.roughness:.2f}"] if material.kind != "diffuse" else []
    if material.lamp is not None:
        figures.append(f"lamp: {material.lamp.luminance_cd_m2:,.0f} cd/m2".replace(",", " "))
    return figures


def _curve(choice: MaterialChoice) -> list[tuple[float, float]]:
    if choice.name:
        return [(float(nm), float(value)) for nm, value, *_ in spectrum_points(asset_material(choice.name))]
    wavelengths = np.arange(380.0, 1000.1, 5.0)
    values = reflectance_from_srgb(choice.base_color_srgb).at(wavelengths)
    return [(float(nm), float(value)) for nm, value in zip(wavelengths, values, strict=True)]


def _plot(pen: ImageDraw.ImageDraw, box: tuple[int, int, int, int], points: list[tuple[float, float]]) -> None:
    left, top, right, bottom = box
    pen.rectangle(box, fill=PANEL)
    highest = max(0.1, *(value for _, value in points))
    ceiling = 1.0 if highest > 0.5 else math.ceil(highest * 10) / 10

    def at(nm: float, value: float) -> tuple[float, float]:
        return left + (nm - 380) / 620 * (right - left), bottom - value / ceiling * (bottom - top - 4)

    for nm in (400, 500, 600, 700, 800, 900, 1000):
        x = at(nm, 0)[0]
        pen.line([(x, top), (x, bottom)], fill=(52, 56, 63))
        pen.text((x, bottom + 2), f"{nm}", fill=FAINT, font=font(10), anchor="ma" if nm < 1000 else "ra")
    for tick in nice_ticks(0.0, ceiling, about=2):
        y = at(380, tick)[1]
        pen.line([(left, y), (right, y)], fill=(52, 56, 63))
        pen.text((left - 4, y), f"{tick:g}", fill=FAINT, font=font(10), anchor="rm")
    pen.line([at(nm, value) for nm, value in points], fill=(120, 190, 255), width=2)


# Pictures ------------------------------------------------------------------------------------------------------------


def _picture(store: ObjectStore, key: str) -> Image.Image:
    with Image.open(io.BytesIO(store.get(key))) as picture:
        # For people: the median takes the grain of few rays away, at the finer resolution, so that edges stay.
        return picture.convert("RGB").filter(ImageFilter.MedianFilter(3)).reduce(_FINER)


def _sheet(views: list[Image.Image]) -> Image.Image:
    """Return the views in two rows."""
    width, height = views[0].size
    sheet = Image.new("RGB", (4 * width, 2 * height))
    for number, view in enumerate(views):
        sheet.paste(view, (number % 4 * width, number // 4 * height))
    return sheet


def _png(picture: Image.Image) -> bytes:
    stream = io.BytesIO()
    picture.save(stream, format="PNG", compress_level=6)
    return stream.getvalue()
