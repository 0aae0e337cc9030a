"""A recipe's frames as FrameDescriptions, and the check of a whole recipe."""

from __future__ import annotations

import dataclasses
import itertools
import json
import math
import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fullwell.core.errors import FieldError
from fullwell.core.hashing import canonical_json, digest_of
from fullwell.schema.errors import RecipeError
from fullwell.schema.kept_scene import KeptScene
from fullwell.schema.loading import document_of
from fullwell.schema.paths import with_values
from fullwell.schema.v1.recipe import LabelsDocument, QualityDocument, RecipeDocument
from fullwell.schema.variation import TIME_PATH, clip_times, extreme_values, frame_values

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from fullwell.radiometry.grid import WavelengthGrid
    from fullwell.scene import Film
    from fullwell.scene.motion import DrivingFacts, Motion
    from fullwell.schema.assets import StoredAssetFiles
    from fullwell.schema.conversion.context import Context, RecipeFiles
    from fullwell.schema.conversion.scenes import PlacedScene
    from fullwell.schema.conversion.traffic import StreetView, Viewpoint
    from fullwell.schema.frame import CameraRig, FrameDescription, Quality, View
    from fullwell.schema.v1.cameras import PoseDocument
    from fullwell.schema.v1.common import MotionDocument

__all__ = ["RecipeBuilder", "build_frame", "frame_document", "validate", "varied_document"]

_BUILT_VALUES = 200
"""Varied values that `validate` builds completely; the others are read and checked against the document's ranges."""
_READ_VALUES = 5000
_MOST_VIEWS = 64
"""Views of one light that its sampling looks after; each costs a glance at the whole image per round."""

DEFAULT_NOISE_RATIO = 0.5
"""The variance of the picture's noise is then 25 % more than the sensor's alone, wherever the cap is not reached."""


def build_frame(
    document: RecipeDocument, index: int = 0, *, base_dir: Path | None = None, assets: StoredAssetFiles | None = None
) -> FrameDescription:
    """Return frame `index` of a recipe, resolved and checked.

    `base_dir` is the folder of its files (default: that of the recipe's file; a recipe that was not read from there may name
    only files within it), `assets` is the store that assets are drawn from.
    For many frames of one recipe make one `RecipeBuilder`, which keeps the models it read. Raises RecipeError.
    """
    return RecipeBuilder(document, base_dir=base_dir, assets=assets).frame(index)


def validate(
    document: RecipeDocument, *, base_dir: Path | None = None, assets: StoredAssetFiles | None = None
) -> tuple[str, ...]:
    """Return the warnings of a recipe after building its first frame and checking every value that `vary` can set.

    Nothing is rendered. Raises RecipeError for the first thing that is wrong.
    """
    return RecipeBuilder(document, base_dir=base_dir, assets=assets).validate()


def frame_document(document: RecipeDocument, index: int) -> RecipeDocument:
    """Return the recipe of one frame, with `vary` applied and removed."""
    return varied_document(document, frame_values(document, index))


_LONGEST_RUN_S = 300.0
"""Moments farther apart than this have runs of their own."""


def varied_document(document: RecipeDocument, values: dict[str, Any]) -> RecipeDocument:
    """Return the recipe with `values` at their paths, and without `vary`."""
    plain = document.plain()
    plain.pop("vary", None)
    return document_of(with_values(plain, values), base_dir=document.base_dir) if values else _without_vary(document)


def _without_vary(document: RecipeDocument) -> RecipeDocument:
    return document if document.vary is None else document.model_copy(update={"vary": None})


class RecipeBuilder:
    """Builds the frames of one recipe; model files and digests are kept between frames.

    `kept` is for builders of several recipes with the same scene: see `KeptScene`.
    """

    def __init__(
        self,
        document: RecipeDocument,
        *,
        base_dir: Path | None = None,
        assets: StoredAssetFiles | None = None,
        kept: KeptScene | None = None,
    ) -> None:
        self._document = document
        self._base_dir = document.base_dir if base_dir is None else base_dir
        self._assets = assets
        self._files: RecipeFiles | None = None
        self._kept = kept or KeptScene()
        self._kept_elsewhere = kept is not None
        self._views: list[tuple[tuple[Film, View], ...]] | None = None

    def frame(self, index: int) -> FrameDescription:
        """Return frame `index`, resolved and checked. Raises RecipeError, or FieldError where there is no such frame."""
        values = frame_values(self._document, index)
        try:
            return self._build(varied_document(self._document, values), values, index)
        except RecipeError as error:
            if not values:
                raise
            varied = ", ".join(f"{path} = {_scalar(value)}" for path, value in values.items())
            raise _told(error, f"In frame {index} vary sets {varied}.") from error

    def validate(self) -> tuple[str, ...]:
        """See the function `validate`."""
        first = self.frame(0)
        _check_renderable(first)
        vary = self._document.vary
        if vary is None:
            return first.warnings
        values = frame_values(self._document, 0)
        for number, (where, path, value) in enumerate(extreme_values(vary)):
            if number >= _READ_VALUES:
                break
            try:
                changed = varied_document(self._document, {**values, path: value})
                if number < _BUILT_VALUES:
                    _check_renderable(self._build(changed, values, 0))
            except RecipeError as error:
                raise _told(error, f"{where} sets {path}.") from error
        return first.warnings

    def _build(self, recipe: RecipeDocument, values: dict[str, Any], index: int) -> FrameDescription:
        # Imported late: a recipe that is refused needs neither arrays nor tables.
        from fullwell.radiometry.grid import WavelengthGrid  # noqa: PLC0415
        from fullwell.schema.conversion.cameras import camera_rig  # noqa: PLC0415
        from fullwell.schema.conversion.context import Context, RecipeFiles  # noqa: PLC0415
        from fullwell.schema.frame import FrameDescription  # noqa: PLC0415

        if self._files is None:
            # The owner of a recipe file may name any file; a recipe from elsewhere only those of the folder it is given.
            confined = self._base_dir != self._document.base_dir
            self._files = RecipeFiles(self._base_dir, self._document.files, confined=confined)
        grid = WavelengthGrid(recipe.spectral.first_nm, recipe.spectral.last_nm, recipe.spectral.step_nm)
        context = Context(grid, self._files, self._assets, recipe, recipe.seed)
        if recipe.scene.traffic is not None:
            from fullwell.schema.conversion.traffic import street_view  # noqa: PLC0415

            context.moments_s = _moments(self._document)
            context.street = street_view(recipe.scene.traffic, context)
        street_files = dict(context.used_files)
        cameras = tuple(
            camera_rig(camera, f"cameras[{i}]", recipe.quality.oversampling, context) for i, camera in enumerate(recipe.cameras)
        )
        plain = recipe.plain()
        placed, of_scene = self._placed(recipe, plain, grid, cameras, street=context.street, street_files=street_files)
        _check_light_groups(recipe, placed)
        if self._views is None:
            self._views = self._shared_views(context)
        _check_cameras_outside(cameras, placed)
        driving = _driving(recipe, context.street, cameras)
        cameras = tuple(
            dataclasses.replace(rig, motion=_camera_motion(camera.pose, rig, driving))
            for camera, rig in zip(recipe.cameras, cameras, strict=True)
        )
        _name_drawn(plain, of_scene.drawn_assets)
        plain |= {"files": dict(sorted((of_scene.used_files | context.used_files).items()))}
        return FrameDescription(
            recipe_name=recipe.name,
            seed=recipe.seed,
            index=index,
            count=self._document.frame_count(),
            varied=tuple((path, _scalar(value)) for path, value in values.items()),
            scene=placed.description,
            cameras=cameras,
            grid=grid,
            outputs=tuple(recipe.outputs),
            quality=_quality(recipe.quality),
            warnings=tuple(dict.fromkeys((*context.all_warnings(), *of_scene.all_warnings()))),
            recipe_json=canonical_json(plain).decode(),
            group_weights=tuple(sorted(recipe.scene.light_groups.items())),
            views=_views_on(self._views, cameras, tuple(sorted(recipe.scene.light_groups.items()))),
            driving=driving,
            flow_interval_s=(recipe.labels or LabelsDocument()).flow_interval_s,
            motions=_motions(recipe, placed, driving),
        )

    def _placed(
        self,
        recipe: RecipeDocument,
        plain: dict[str, Any],
        grid: WavelengthGrid,
        cameras: tuple[CameraRig, ...],
        *,
        street: StreetView | None,
        street_files: dict[str, str],
    ) -> tuple[PlacedScene, Context]:
        """Return the scene, the very object of the frame before where it is the same: what was loaded of it is used again.

        `street_files` are {name: SHA-256} of what the street was made of.
        """
        from fullwell.schema.assets import is_pinned  # noqa: PLC0415
        from fullwell.schema.conversion.context import Context  # noqa: PLC0415
        from fullwell.schema.conversion.scenes import scene_of  # noqa: PLC0415

        assert self._files is not None
        scene = {name: value for name, value in plain["scene"].items() if name != "light_groups"}
        contents = {"scene": scene, "spectral": plain.get("spectral"), "files": plain.get("files")}
        if any(_asset_geometries(scene)):  # drawn by the seed, among the pins
            contents |= {"seed": recipe.seed, "assets": plain.get("assets")}
        viewpoints = _viewpoints(cameras) if street is not None else ()
        if street is not None:
            contents |= {"seed": recipe.seed, "assets": plain.get("assets"), "views": [repr(view) for view in viewpoints]}
            contents |= {"street_files": street_files}
        # Draws from whatever the store has at the moment are not another recipe's to use.
        kept = self._kept if not self._kept_elsewhere or is_pinned(recipe) else KeptScene()
        key = canonical_json(contents)
        known = kept.get(key, self._files)
        if known is None:
            context = Context(grid, self._files, self._assets, recipe, recipe.seed, street=street)
            known = scene_of(recipe.scene, context, viewpoints), context
            kept.put(key, *known)
        return known

    def _shared_views(self, context: Context) -> list[tuple[tuple[Film, View], ...]]:
        """Return the views that frames of the recipe have, for each camera with the film it is on; none if `vary` changes none.

        All combinations where they are few; otherwise every value by itself.
        """
        from fullwell.schema.conversion.cameras import camera_rig  # noqa: PLC0415
        from fullwell.schema.frame import View  # noqa: PLC0415

        vary = self._document.vary
        extremes: dict[str, list[Any]] = {}
        for _, path, value in () if vary is None else extreme_values(vary):
            if _changes_only_the_view(path):
                extremes.setdefault(path, []).append(value)
        if not extremes:
            return []
        base = frame_values(self._document, 0)
        if math.prod(len(values) for values in extremes.values()) <= _MOST_VIEWS:
            changes = [dict(zip(extremes, chosen, strict=True)) for chosen in itertools.product(*extremes.values())]
        else:
            changes = [{path: value} for path, values in extremes.items() for value in values][:_MOST_VIEWS]
        found: dict[str, tuple[tuple[Film, View], ...]] = {}
        for change in changes:
            recipe = varied_document(self._document, base | change)
            weights = tuple(sorted(recipe.scene.light_groups.items()))
            rigs = [camera_rig(c, f"cameras[{i}]", recipe.quality.oversampling, context) for i, c in enumerate(recipe.cameras)]
            views = tuple((rig.camera.film, View(rig.sensors, weights)) for rig in rigs)
            looks = [[film, [[s.model, s.exposure] for s in view.sensors]] for film, view in views]
            found.setdefault(digest_of([looks, weights]), views)
        return list(found.values())


def _moments(document: RecipeDocument) -> tuple[float, ...]:
    """Return the times [s] at which the recipe's frames look at its street, where one run of SUMO may serve them all."""
    vary, traffic = document.vary, document.scene.traffic
    if vary is None or traffic is None:
        return ()
    starts = [start for start in vary.grid.get(TIME_PATH, [traffic.time_s]) if isinstance(start, int | float)]
    times = sorted({time for start in starts for time in clip_times(vary, start)})
    return tuple(times) if times and times[-1] - times[0] <= _LONGEST_RUN_S else ()


def _driving(recipe: RecipeDocument, street: StreetView | None, cameras: tuple[CameraRig, ...]) -> DrivingFacts | None:
    """Return what labels may tell of the street; None without one."""
    from fullwell.schema.conversion.driving import driving_facts  # noqa: PLC0415

    if street is None or recipe.scene.traffic is None:
        return None
    mounted = [camera.name for camera in recipe.cameras if camera.pose.mount is not None]
    places = [rig.camera.camera_to_world[:3, 3] for rig in cameras]
    return driving_facts(street, places_m=places, range_m=recipe.scene.traffic.range_m, mounted=mounted)


def _motions(recipe: RecipeDocument, placed: PlacedScene, driving: DrivingFacts | None) -> dict[str, Motion]:
    """Return the motions of traffic and of the recipe's own objects, by id; what is at rest is left out."""
    found = {} if driving is None else dict(driving.motions())
    places = {item.id: item.to_world[:3, 3] for item in placed.description.objects}
    for item in recipe.scene.objects:
        if item.motion is not None:
            motion = _motion(item.motion, places[item.id])
            if motion.moves:
                found[item.id] = motion
    return found


def _camera_motion(pose: PoseDocument, rig: CameraRig, driving: DrivingFacts | None) -> Motion:
    from fullwell.scene.motion import AT_REST  # noqa: PLC0415

    if pose.motion is not None:
        return _motion(pose.motion, rig.camera.camera_to_world[:3, 3])
    return AT_REST if driving is None else driving.motion_of_camera(rig.camera.name)


def _motion(document: MotionDocument, pivot_m: NDArray[np.float64]) -> Motion:
    import numpy as np  # noqa: PLC0415

    from fullwell.scene.motion import Motion  # noqa: PLC0415

    return Motion(np.array(document.velocity_m_s), math.radians(document.yaw_rate_deg_per_s), np.array(pivot_m))


def _viewpoints(cameras: tuple[CameraRig, ...]) -> tuple[Viewpoint, ...]:
    """Return where cameras are, how finely they see and which way: what levels of detail are chosen by."""
    from fullwell.schema.conversion.traffic import Viewpoint  # noqa: PLC0415

    found = []
    for camera in (rig.camera for rig in cameras):
        pose, film = camera.camera_to_world, camera.film
        half_angle_rad = math.atan(camera.tangent_pitch * math.hypot(film.rows, film.cols) / 2)
        origin_m, forward = tuple(pose[:3, 3].tolist()), tuple(pose[:3, 2].tolist())
        found.append(Viewpoint(origin_m, film.pitch_m / camera.lens.focal_length_m, forward, half_angle_rad))
    return tuple(found)


def _asset_geometries(scene: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield (path, geometry) of each asset in a scene of plain data."""
    for index, item in enumerate(scene["objects"]):
        path = f"scene.objects[{index}]"
        parts = enumerate(item.get("parts", []))
        places = [(f"{path}.geometry", item), *((f"{path}.parts[{number}].geometry", part) for number, part in parts)]
        for where, holder in places:
            if holder.get("geometry", {}).get("kind") == "asset":
                yield where, holder["geometry"]


def _name_drawn(plain: dict[str, Any], drawn: dict[str, str]) -> None:
    """Replace draws by what was drawn: a frame's recipe names each asset, and makes the same scene without any catalogue."""
    for path, geometry in _asset_geometries(plain["scene"]):
        kept = {name: geometry[name] for name in ("kind", "level", "lit") if name in geometry}
        geometry.clear()
        geometry.update(kept | {"id": drawn[path]})
    if plain["scene"].get("traffic") is None:  # a street draws among many, by rules: its pins stay
        plain["assets"] = {}


def _views_on(
    found: list[tuple[tuple[Film, View], ...]], cameras: tuple[CameraRig, ...], weights: tuple[tuple[str, float], ...]
) -> tuple[tuple[View, ...], ...]:
    """Return for each camera those of the views that its own film serves: pixels of another pitch are rendered anew."""
    from fullwell.schema.frame import View  # noqa: PLC0415

    if not found:
        return ()
    fitting = (
        tuple(view for film, view in (views[position] for views in found) if film == rig.camera.film)
        for position, rig in enumerate(cameras)
    )
    return tuple(views or (View(rig.sensors, weights),) for views, rig in zip(fitting, cameras, strict=True))


def _changes_only_the_view(path: str) -> bool:
    """Return whether a varied place changes how light is looked at, not the light."""
    return path.startswith("scene.light_groups") or re.match(r"cameras\[\d+\]\.sensors\b", path) is not None


def _quality(document: QualityDocument) -> Quality:
    """Return the quality; where a recipe says nothing, the error of the light is half of the sensor's own noise."""
    from fullwell.schema.frame import Quality  # noqa: PLC0415

    ratio = document.noise_ratio
    if ratio is None and document.samples_per_pixel is None:
        ratio = DEFAULT_NOISE_RATIO
    return Quality(
        noise_ratio=ratio,
        samples_per_pixel=document.samples_per_pixel,
        max_samples_per_pixel=document.max_samples_per_pixel,
        time_limit_s=document.time_limit_s,
        max_sample_saturation=document.max_sample_saturation,
        max_depth=document.max_depth,
        motion_blur_px=document.motion_blur_px,
    )


def _check_light_groups(recipe: RecipeDocument, placed: PlacedScene) -> None:
    """Refuse weights for groups that no light is in."""
    from fullwell.core.errors import unknown_name_message  # noqa: PLC0415
    from fullwell.scene.groups import group_names  # noqa: PLC0415
    from fullwell.schema.conversion.context import fail  # noqa: PLC0415
    from fullwell.schema.conversion.traffic import STREET_GROUPS  # noqa: PLC0415

    known = group_names(placed.description)
    if recipe.scene.traffic is not None:  # whatever is lit at the moment of the frame
        known = tuple(sorted({*known, *STREET_GROUPS}))
    for name in recipe.scene.light_groups:
        if name not in known:
            fail(f"scene.light_groups.{name}", unknown_name_message("light group", name, known), name)


def _told(error: RecipeError, circumstance: str) -> RecipeError:
    shown = circumstance if len(circumstance) <= 300 else circumstance[:297] + "..."
    return RecipeError(f"{error.message} ({shown})", error.path, error.value)


def _check_renderable(frame: FrameDescription) -> None:
    """Raise RecipeError for what the renderer would refuse when its turn comes: the same checks, before any work."""
    from fullwell.scene.validate import check_camera, check_scene  # noqa: PLC0415

    try:
        check_scene(frame.scene)
        for rig in frame.cameras:
            check_camera(rig.camera)
    except FieldError as error:
        raise RecipeError(error.message, error.path, error.value) from error


def _scalar(value: Any) -> str | int | float | bool:
    if isinstance(value, str | int | float | bool):
        return value
    return json.dumps(value, sort_keys=True, separators=(",", ":"))


def _check_cameras_outside(cameras: tuple[CameraRig, ...], placed: PlacedScene) -> None:
    from fullwell.schema.conversion.context import fail  # noqa: PLC0415
    from fullwell.schema.conversion.inside import is_inside_opaque  # noqa: PLC0415

    for index, rig in enumerate(cameras):
        origin = rig.camera.camera_to_world[:3, 3]
        for item, path, inside_ok in zip(placed.description.objects, placed.paths, placed.inside_ok, strict=True):
            if not inside_ok and any(is_inside_opaque(part, item.to_world, origin) for part in item.parts):
                fail(
                    f"cameras[{index}].pose",
                    f"puts the camera at {origin.tolist()}, inside the opaque object {item.id!r} ({path}), where it sees "
                    f"nothing. Move the camera, or set {path}.inside_ok: true if the object is a room.",
                    item.id,
                )
