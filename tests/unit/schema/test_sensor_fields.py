"""A recipe describes any sensor and exposure; what cannot be is answered with its path, range and nearest name."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from fullwell.schema import RecipeError, apply_override, build_frame, load_recipe, validate
from fullwell.sensor import (
    ArrheniusLaw,
    AutoExposure,
    BracketExposure,
    BurstExposure,
    ChannelExposure,
    ChiefRayFalloff,
    DoublingLaw,
    RadialFalloff,
    sensor,
    sensor_names,
)

KERNEL = [[0, 0.02, 0], [0.02, 0.92, 0.02], [0, 0.02, 0]]
SENSOR = "cameras[0].sensors[0]"


def rig(recipe: dict[str, Any], **fields: Any) -> Any:
    recipe["cameras"][0]["sensors"][0] |= fields
    return build_frame(load_recipe(recipe)).cameras[0].sensors[0]


@pytest.mark.parametrize("name", sensor_names())
def test_every_sensor_of_the_catalogue_can_be_asked_for(recipe: dict[str, Any], name: str) -> None:
    assert rig(recipe, model=name).model.name == name


def test_a_named_pattern_takes_its_channels_from_a_named_set(recipe: dict[str, Any]) -> None:
    model = rig(recipe, cfa={"pattern": "ryycy", "channels": "representative", "ir_cut_nm": 650}).model
    assert model.cfa.pattern == (("R", "Y"), ("Y", "Cy"))
    assert set(model.cfa.channel_names) == {"R", "Y", "Cy"}
    assert dict(model.cfa.channels)["R"].at(700.0) < 0.01


def test_any_pattern_takes_any_channels(recipe: dict[str, Any]) -> None:
    table = {"wavelength_nm": [500, 600], "values": [0.2, 0.8]}
    model = rig(recipe, cfa={"pattern": [["A", "B", "A"]], "channels": {"A": table, "B": 0.5}, "filters": [0.5]}).model
    channels = dict(model.cfa.channels)
    np.testing.assert_allclose(channels["A"].at([490, 500, 550, 600, 610]), [0, 0.1, 0.25, 0.4, 0], atol=1e-12)
    assert channels["B"].at(900.0) == pytest.approx(0.25)


def test_what_a_filter_array_leaves_out_stays_as_the_model_has_it(recipe: dict[str, Any]) -> None:
    model = rig(recipe, model="imx363", cfa={"pattern": "bggr"}).model
    assert model.cfa.pattern == (("B", "G"), ("G", "R"))
    assert dict(model.cfa.channels)["G"] is dict(sensor("imx363").cfa.channels)["G"]


def test_numbers_and_laws_reach_the_model(recipe: dict[str, Any]) -> None:
    model = rig(
        recipe,
        model="imx363",
        temperature_k=320,
        dark_activation_energy_ev=0.6,
        dcnu_fraction=0.1,
        hot_pixel_fraction=1e-4,
        hot_pixel_dark_current_e_per_s=500,
        reset_noise_e=20,
        readout_sampling="correlated_double",
        column_offset_v=1e-4,
        row_noise_v=2e-4,
        line_time_s=1e-5,
        photodetector_offset_m=[0.0, 0.0],
        crosstalk={"kernel": KERNEL, "channels": [[0.9, 0, 0], [0.05, 1, 0.05], [0, 0, 0.9]]},
        microlens={"exponent": 3, "exit_pupil_distance_m": 0.005},
    ).model
    assert model.dark_current_law == ArrheniusLaw(0.6)
    assert (model.temperature_k, model.reset_noise_e, model.row_noise_v, model.line_time_s) == (320, 20, 2e-4, 1e-5)
    assert model.readout_sampling == "correlated_double"
    assert model.crosstalk_kernel is not None
    assert model.microlens == ChiefRayFalloff(3, 0.005, math.inf)
    assert rig(recipe, dark_activation_energy_ev=None, dark_doubling_k=6).model.dark_current_law == DoublingLaw(6)
    assert rig(recipe, microlens={"radius_m": [0, 1e-3], "ratio": [1, 0.8]}).model.microlens == RadialFalloff(
        (0, 1e-3), (1, 0.8)
    )


def test_photodiodes_and_their_readouts_reach_the_model(recipe: dict[str, Any]) -> None:
    high, low = ({"name": n, "conversion_gain_v_per_e": g, "read_noise_e": 2} for n, g in (("high", 6e-5), ("low", 1e-5)))
    photodiodes = [
        {"name": "large", "fill_factor": 0.8, "well_capacity_e": 5e4, "readouts": [high, low]},
        {"name": "small", "fill_factor": 0.1, "well_capacity_e": 2e4, "readouts": [low], "qe_ratio": 0.1},
    ]
    model = rig(recipe, photodiodes=photodiodes, combination="select").model
    assert [(p.name, len(p.readouts), p.qe_ratio) for p in model.photodiodes] == [("large", 2, 1.0), ("small", 1, 0.1)]
    assert model.photodiodes[0].readouts[0].well_capacity_e == math.inf
    assert model.combination == "select"
    assert rig(recipe, model="imx490", photodiodes=[], well_capacity_e=9e4).model.well_capacity_e == 9e4


def test_exposures_of_several_captures_reach_the_sensor(recipe: dict[str, Any]) -> None:
    bracket = rig(recipe, exposure={"time_s": 0.01, "bracket": {"ratios": [1, 0.25]}}).exposure
    assert isinstance(bracket, BracketExposure)
    assert (bracket.ratios, bracket.combination) == ((1, 0.25), "weighted")
    burst = rig(recipe, exposure={"auto": {"method": "area", "area": [0, 0, 0.5, 0.5]}, "burst": {"count": 4}}).exposure
    assert isinstance(burst, BurstExposure)
    assert burst.base.area == (0, 0, 0.5, 0.5)  # type: ignore[union-attr]
    ratios = rig(recipe, model="imx363", exposure={"time_s": 0.01, "channel_ratios": {"R": 2}}).exposure
    assert isinstance(ratios, ChannelExposure)
    assert rig(recipe, exposure={"auto": {}, "channel_ratios": "auto"}).exposure == ChannelExposure(AutoExposure())


READOUT = {"name": "a", "conversion_gain_v_per_e": 1e-5, "read_noise_e": 1}
PHOTODIODE = {"name": "a", "fill_factor": 0.5, "well_capacity_e": 1e4, "readouts": [READOUT]}

CASES: list[tuple[dict[str, Any], str, str]] = [
    ({"cfa.pattern": "rcc"}, "cfa.pattern", "did you mean 'rccc'"),
    ({"cfa.pattern": [["R", "G"], ["G"]]}, "cfa.pattern", "rectangle"),
    ({"cfa.pattern": [["R", "X"]]}, "cfa.pattern", "channel 'X' is not known"),
    ({"cfa.pattern": 5}, "cfa.pattern", "rows of channel names"),
    ({"cfa.channels": "representativ"}, "cfa.channels", "did you mean 'representative'"),
    ({"cfa.channels": {"R": 0.5}}, "cfa.pattern", "channel 'G' is not known"),
    ({"cfa.channels": {"R": 1.5, "G": 1, "B": 1}}, "cfa.channels.R", "<= 1"),
    ({"cfa.filters": [2]}, "cfa.filters[0]", "<= 1"),
    ({"cfa.ir_cut_nm": 100}, "cfa.ir_cut_nm", ">= 400"),
    ({"cfa.patern": "rggb"}, "cfa.patern", "did you mean pattern"),
    ({"microlens": {"exponent": 2}}, "microlens", "is incomplete"),
    ({"microlens": {"exponent": 2, "ratio": [1]}}, "microlens", "twice"),
    ({"microlens": {"radius_m": [0, 0], "ratio": [1, 1]}}, "microlens.radius_m", "strictly increasing"),
    ({"microlens": {"radius_m": [0, 1], "ratio": [1]}}, "microlens.ratio", "as many"),
    ({"crosstalk": {}}, "crosstalk", "none of kernel and channels"),
    ({"crosstalk": {"kernel": [[1, 1, 1]] * 3}}, "crosstalk.kernel", "not make them"),
    ({"crosstalk": {"kernel": [[1, 1, 1]]}}, "crosstalk.kernel", "at least 3"),
    ({"crosstalk": {"channels": [[1, 0], [0, 1]]}}, "crosstalk.channels", "3 rows of 3 numbers"),
    ({"crosstalk": {"channels": [[9, 0, 0], [0, 9, 0], [0, 0, 9]]}}, "crosstalk.channels", "within 0 to 1"),
    ({"temperature_k": 20}, "temperature_k", ">= 50"),
    ({"dark_doubling_k": 8, "dark_activation_energy_ev": 0.5}, "dark_activation_energy_ev", "one of them"),
    ({"hot_pixel_fraction": 2}, "hot_pixel_fraction", "<= 1"),
    ({"readout_sampling": "double"}, "readout_sampling", "correlated_double"),
    ({"photodetector_offset_m": [1e-6, 0]}, "photodetector_offset_m", "stays within the pixel"),
    ({"photodiodes": [{**PHOTODIODE, "readouts": []}]}, "photodiodes[0].readouts", "at least 1"),
    ({"photodiodes": [PHOTODIODE, PHOTODIODE]}, "photodiodes", "differently"),
    ({"photodiodes": [{**PHOTODIODE, "readouts": [READOUT, READOUT]}]}, "photodiodes[0].readouts", "differently"),
    ({"photodiodes": [{**PHOTODIODE, "fill_factor": 1.2}]}, "photodiodes[0].fill_factor", "<= 1"),
    ({"model": "imx490", "read_noise_e": 2}, "read_noise_e", "has no effect"),
    ({"analog_offset_v": 9}, "analog_offset_v", "below voltage_swing_v"),
    ({"well_capacity_e": 1e12}, "well_capacity_e", "at most 1e+09"),
    ({"exposure": {"time_s": 1, "burst": {"count": 1}}}, "exposure.burst.count", ">= 2"),
    ({"exposure": {"time_s": 1, "bracket": {"ratios": [1]}}}, "exposure.bracket.ratios", "at least 2"),
    ({"exposure": {"time_s": 1, "bracket": {"ratios": [1, 0]}}}, "exposure.bracket.ratios[1]", "> 0"),
    ({"exposure": {"time_s": 1, "bracket": {"ratios": [1, 2]}, "burst": {"count": 2}}}, "exposure.burst", "at most one"),
    ({"exposure": {"time_s": 1, "channel_ratios": "auto"}}, "exposure.channel_ratios", "full, mean or percentile"),
    ({"exposure": {"time_s": 1, "channel_ratios": "red"}}, "exposure.channel_ratios", "number by channel name"),
    ({"exposure": {"time_s": 1, "channel_ratios": {"Z": 2}}}, "exposure.channel_ratios.Z", "it has R, G, B"),
    ({"model": "imx490", "exposure": {"time_s": 1, "channel_ratios": {"R": 2}}}, "exposure.channel_ratios", "several"),
    ({"exposure": {"auto": {"method": "area", "area": [0.5, 0, 0.6, 1]}}}, "exposure.auto.area", "every edge"),
    ({"exposure": {"auto": {"area": [0, 0, 1, 1]}}}, "exposure.auto.area", "belongs to method: area"),
    ({"exposure": {"auto": {"method": "luminence"}}}, "exposure.auto.method", "Did you mean luminance"),
]


@pytest.mark.parametrize(("changes", "path", "words"), CASES, ids=[f"{path}-{k}" for k, (_, path, _) in enumerate(CASES)])
def test_a_sensor_that_cannot_be_is_refused_with_its_path(
    recipe: dict[str, Any], changes: dict[str, Any], path: str, words: str
) -> None:
    apply_override(recipe, f"{SENSOR}.model", "imx363")
    for key, value in changes.items():
        apply_override(recipe, f"{SENSOR}.{key}", value)
    with pytest.raises(RecipeError) as caught:
        validate(load_recipe(recipe))
    assert caught.value.path == f"{SENSOR}.{path}"
    assert words in caught.value.message
