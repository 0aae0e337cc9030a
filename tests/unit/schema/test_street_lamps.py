"""Lamps of street assets: which lamp, how bright, and the same for every level of detail."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fullwell.assets.materials.catalogue import asset_material
from fullwell.assets.model import LoadedPart
from fullwell.radiometry import luminance_cd_m2, scale_to_luminance
from fullwell.scene import Emission
from fullwell.schema.conversion.street_lamps import INTENSITY_CD, bright_as_its_kind, lamp_material
from fullwell.schema.v1.traffic import TrafficDocument
from fullwell.traffic.placement import PlacedAsset
from street_assets import manifest


def document(**changes: object) -> TrafficDocument:
    return TrafficDocument.model_validate({"network": {"layout": "straight"}, "lamps": "night", **changes})


def placed(name: str, asset_class: str, **changes: object) -> PlacedAsset:
    role = "light" if asset_class == "street_light" else "mover"
    asset = replace(manifest(name, asset_class, (4.5, 1.8, 1.5)), **changes)  # type: ignore[arg-type]
    return PlacedAsset(name, asset, role, np.zeros(3), 0.0)


def lens(name: str, side_m: float, cells: int, normal: tuple[float, float, float]) -> LoadedPart:
    """A square of `cells` squared pairs of triangles that faces along `normal`."""
    edge = np.linspace(-side_m / 2, side_m / 2, cells + 1)
    u, v = np.meshgrid(edge, edge, indexing="ij")
    n = np.array(normal)
    first = np.array([0.0, 1.0, 0.0]) if abs(n[1]) < 0.5 else np.array([1.0, 0.0, 0.0])
    vertices = u.ravel()[:, None] * first + v.ravel()[:, None] * np.cross(n, first)
    corner = np.arange((cells + 1) ** 2).reshape(cells + 1, cells + 1)
    a, b, c, d = (corner[i : i + cells, j : j + cells].ravel() for i, j in ((0, 0), (1, 0), (1, 1), (0, 1)))
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.uint32)
    return LoadedPart(
        name=name,
        vertices_m=vertices,
        faces=faces,
        normals=None,
        uv=None,
        base_color_srgb=(0.5, 0.5, 0.5),
        base_color_texture=None,
        roughness=0.5,
        metallic=0.0,
        emissive_srgb=None,
        double_sided=False,
    )


def emitted(lamp: str) -> Emission:
    entry = asset_material(lamp).lamp
    assert entry is not None
    return Emission(scale_to_luminance(entry.spd, entry.luminance_cd_m2), entry.group)


@pytest.mark.parametrize(
    ("part", "lamp"),
    [
        ("taillight_left", "tail"),
        ("brakelight_left", "brake"),
        ("indicator_rear_left", "indicator"),
        ("light_red", "traffic_red"),
    ],
)
@pytest.mark.parametrize("side_m", [0.04, 0.12, 0.25])
def test_a_lamps_intensity_stays_within_what_its_kind_may_have(part: str, lamp: str, side_m: float) -> None:
    least, most = next(limits for start, limits in INTENSITY_CD.items() if part.startswith(start))
    item = placed("sedan", "car")
    seen = [
        luminance_cd_m2(
            bright_as_its_kind(emitted(f"lamp/{lamp}"), f"lamp/{lamp}", lens(part, side_m, n, (-1, 0, 0)), item).radiance
        )
        for n in (1, 7)
    ]
    assert seen[0] == pytest.approx(seen[1], rel=1e-9)  # whatever the level of detail
    intensity = seen[0] * side_m**2
    unchanged = luminance_cd_m2(emitted(f"lamp/{lamp}").radiance)
    bounded = unchanged / 8 <= seen[0] * (1 + 1e-9) and seen[0] <= unchanged * 8 * (1 + 1e-9)
    assert bounded
    if unchanged / 7.9 < seen[0] < unchanged * 7.9:
        assert least * (1 - 1e-9) <= intensity <= most * (1 + 1e-9)


@pytest.mark.parametrize(("lamp", "leaving"), [("street_led", 1.0), ("street_hps", 0.75), ("street_mercury", 0.75)])
def test_street_lights_have_the_flux_of_their_asset(lamp: str, leaving: float) -> None:
    item = placed("light", "street_light", attributes={"luminous_flux_lm": 6500.0})
    emission = bright_as_its_kind(emitted(f"lamp/{lamp}"), f"lamp/{lamp}", lens("lamp", 0.3, 2, (0, 0, -1)), item)
    assert luminance_cd_m2(emission.radiance) * np.pi * 0.09 == pytest.approx(6500.0 * leaving, rel=1e-6)
    assert emission.pattern is not None
    assert emission.group == "streetlights"


def test_lanterns_whose_lenses_stand_upright_shine_to_all_sides() -> None:
    item = placed("light", "street_light", attributes={"luminous_flux_lm": 3000.0})
    emission = bright_as_its_kind(emitted("lamp/street_mh"), "lamp/street_mh", lens("lamp", 0.3, 2, (1, 0, 0)), item)
    assert emission.pattern is None


def test_floodlights_of_billboards_are_no_street_lights() -> None:
    item = replace(placed("light", "street_light"), role="furniture")
    assert (
        bright_as_its_kind(emitted("lamp/street_led"), "lamp/street_led", lens("lamp", 0.3, 2, (0, 0, -1)), item).pattern
        is None
    )


def test_cars_have_led_or_halogen_headlamps_by_the_seed() -> None:
    cars = [replace(placed("sedan", "car"), id=f"car{n}") for n in range(200)]
    drawn = [lamp_material("lamp/headlight_led", car, document(), 5) for car in cars]
    assert drawn == [lamp_material("lamp/headlight_halogen", car, document(), 5) for car in cars]
    assert 0.25 < np.mean([name == "lamp/headlight_halogen" for name in drawn]) < 0.55
    assert lamp_material("lamp/headlight_led", placed("bus", "bus"), document(), 5) == "lamp/headlight_led"


def test_street_lamps_replaces_what_is_in_street_lights_only() -> None:
    light = placed("light", "street_light")
    assert lamp_material("lamp/street_led", light, document(), 1) == "lamp/street_led"
    assert lamp_material("lamp/street_led", light, document(street_lamps="mercury"), 1) == "lamp/street_mercury"
    assert lamp_material("lamp/sign_panel", light, document(street_lamps="sodium"), 1) == "lamp/sign_panel"
    assert lamp_material("metal/aluminium", light, document(street_lamps="sodium"), 1) == "metal/aluminium"
