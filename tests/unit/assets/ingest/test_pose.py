"""Unit, up and forward axis: from the file, the class and the names of parts; and what a person must decide."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fullwell.assets.ingest.options import IngestOptions
from fullwell.assets.ingest.pose import Pose, find_pose, posed_part
from fullwell.assets.model import LoadedModel, LoadedPart, UpAxis, turn_up
from fullwell.assets.records import Check
from fullwell.core.errors import FieldError
from ingest_models import part

_SIDES = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
BOX_FACES = np.concatenate([_SIDES[:, [0, 1, 2]], _SIDES[:, [0, 2, 3]]])


def box(size: Sequence[float], centre: Sequence[float] = (0.0, 0.0, 0.0), **changes: object) -> LoadedPart:
    """A box in the axes and the unit of a file."""
    corners = np.array(list(itertools.product((-0.5, 0.5), repeat=3))) * size + centre
    return part(corners, BOX_FACES, **changes)


def loaded(parts: Sequence[LoadedPart], *, up: UpAxis = "y", unit_m: float = 1.0, states: bool = True) -> LoadedModel:
    """What reading a file of such boxes gives."""
    turn = turn_up(up)
    world = tuple(
        part(item.vertices_m @ turn.T * unit_m, item.faces, name=item.name, base_color_srgb=item.base_color_srgb)
        for item in parts
    )
    points = np.concatenate([item.vertices_m for item in world])
    bounds = np.array([points.min(axis=0), points.max(axis=0)])
    return LoadedModel(world, bounds, unit_m, up, (), states_unit=states, states_up_axis=states)


def options(asset_class: str = "car", **changes: object) -> IngestOptions:
    return IngestOptions(id="thing", asset_class=asset_class, **changes)  # type: ignore[arg-type]


def check(pose: Pose, name: str) -> Check:
    return next(entry for entry in pose.checks if entry.name == name)


CAR = (1.8, 1.4, 4.5)
"""x, y, z of a car in a glTF file: y up, z forward."""


class TestUnit:
    def test_a_plausible_stated_unit_is_taken(self) -> None:
        pose = find_pose(loaded([box(CAR)]), options(), suffix=".glb")
        assert pose.unit_m == 1.0
        assert check(pose, "unit").state == "ok"
        assert_allclose(pose.size_m, (4.5, 1.8, 1.4))

    @pytest.mark.parametrize(("per_metre", "unit_m"), [(100, 0.01), (1000, 0.001), (1 / 0.0254, 0.0254), (1 / 0.3048, 0.3048)])
    def test_the_unit_that_makes_the_class_plausible_is_proposed(self, per_metre: float, unit_m: float) -> None:
        model = loaded([box(np.array(CAR) * per_metre)])
        pose = find_pose(model, options(), suffix=".glb")
        assert pose.unit_m == unit_m
        assert_allclose(pose.size_m, (4.5, 1.8, 1.4), rtol=1e-6)
        assert check(pose, "unit").state == "decide", "the file said metres, so a person must confirm"
        assert check(pose, "size").state == "ok"

    def test_a_file_that_states_nothing_gets_the_proposal_with_a_warning(self) -> None:
        pose = find_pose(loaded([box(np.array(CAR) * 100)], states=False), options(), suffix=".obj")
        assert pose.unit_m == 0.01
        assert check(pose, "unit").state == "warning"

    def test_a_toy_keeps_its_size_and_is_told_the_factor_it_would_need(self) -> None:
        pose = find_pose(loaded([box((0.8, 0.7, 1.9))]), options(tags=("sedan",)), suffix=".glb")
        found = check(pose, "unit")
        assert pose.unit_m == 1.0
        assert found.state == "decide"
        typical = np.sqrt(3.5 * 5.5)
        assert found.numbers["scale_to_typical"] == pytest.approx(typical / 1.9)
        assert check(pose, "size").state == "decide"

    def test_a_stated_length_scales_to_it(self) -> None:
        pose = find_pose(loaded([box((0.8, 0.7, 1.9))]), options(length_m=4.2), suffix=".glb")
        assert pose.size_m[0] == pytest.approx(4.2)
        assert pose.unit_m == pytest.approx(4.2 / 1.9)
        assert check(pose, "unit").state == "ok"

    def test_a_given_unit_is_taken_whatever_comes_of_it(self) -> None:
        pose = find_pose(loaded([box(CAR)]), options(unit_m=0.01), suffix=".glb")
        assert pose.size_m[0] == pytest.approx(0.045)
        assert check(pose, "unit").state == "ok"
        assert check(pose, "size").state == "decide"

    def test_the_units_of_a_loaded_model_do_not_count_twice(self) -> None:
        pose = find_pose(loaded([box(np.array(CAR) * 100)], unit_m=0.01), options(), suffix=".usda")
        assert (pose.unit_m, pose.scale) == (0.01, 1.0)
        assert_allclose(pose.size_m, (4.5, 1.8, 1.4))


class TestUp:
    def test_what_the_file_states_is_taken(self) -> None:
        pose = find_pose(loaded([box((4.5, 1.8, 1.4))], up="z"), options(), suffix=".usda")
        assert pose.up_axis == "z"
        assert check(pose, "up_axis").state == "ok"

    def test_the_axis_that_makes_the_size_plausible_is_found(self) -> None:
        """A person 1.8 high along z in an OBJ file, for which y up is usual."""
        pose = find_pose(loaded([box((0.3, 0.5, 1.8))], states=False), options("pedestrian"), suffix=".obj")
        assert pose.up_axis == "z"
        assert check(pose, "up_axis").state == "warning"
        assert_allclose(pose.size_m, (0.3, 0.5, 1.8))

    def test_where_nothing_tells_the_usual_axis_is_taken_with_a_warning(self) -> None:
        pose = find_pose(loaded([box((1, 1, 1))], states=False), options("other"), suffix=".obj")
        assert pose.up_axis == "y"
        assert check(pose, "up_axis").state == "warning"

    def test_a_given_axis_is_taken(self) -> None:
        pose = find_pose(loaded([box((4.5, 1.8, 1.4))]), options(up_axis="z"), suffix=".glb")
        assert pose.up_axis == "z"
        assert_allclose(pose.size_m, (4.5, 1.8, 1.4))


class TestForward:
    @pytest.mark.parametrize(("front", "rear"), [("wheel_front_left", "wheel-rear-left"), ("HeadLight.L", "tailLight.L")])
    @pytest.mark.parametrize(("sign", "axis"), [(1, "z"), (-1, "-z")])
    def test_names_tell_the_front(self, front: str, rear: str, sign: int, axis: str) -> None:
        parts = [
            box(CAR),
            box((0.2, 0.2, 0.2), (0, 0, sign * 1.5), name=front),
            box((0.2, 0.2, 0.2), (0, 0, -sign * 1.5), name=rear),
        ]
        pose = find_pose(loaded(parts), options(), suffix=".obj")
        assert pose.forward_axis == axis
        assert check(pose, "forward_axis").state == "ok"

    def test_lamps_tell_it_by_their_colour(self) -> None:
        parts = [
            box((4.5, 1.4, 1.8)),
            box((0.1, 0.2, 0.2), (-2.2, 0, 0.5), name="lights", base_color_srgb=(1.0, 1.0, 0.9)),
            box((0.1, 0.2, 0.2), (2.2, 0, 0.5), name="lights.001", base_color_srgb=(0.8, 0.05, 0.05)),
        ]
        pose = find_pose(loaded(parts, states=False), options(), suffix=".obj")
        assert pose.forward_axis == "-x"

    def test_gltf_says_z_where_no_part_does(self) -> None:
        pose = find_pose(loaded([box(CAR)]), options(), suffix=".glb")
        assert pose.forward_axis == "z"
        assert check(pose, "forward_axis").state == "warning"

    def test_without_names_or_convention_a_person_must_decide(self) -> None:
        pose = find_pose(loaded([box((4.5, 1.4, 1.8))], states=False), options(), suffix=".obj")
        assert pose.forward_axis in ("x", "-x"), "the long axis"
        assert check(pose, "forward_axis").state == "decide"

    def test_names_against_the_long_axis_are_put_to_a_person(self) -> None:
        parts = [box((1.5, 1.4, 4.5)), box((0.2, 0.2, 0.2), (0.6, 0, 0), name="front")]
        pose = find_pose(loaded(parts), options(), suffix=".glb")
        assert check(pose, "forward_axis").state == "decide"

    def test_trees_need_no_front(self) -> None:
        pose = find_pose(loaded([box((3, 6, 3))]), options("tree"), suffix=".obj")
        assert check(pose, "forward_axis").state == "ok"

    def test_a_given_axis_is_taken(self) -> None:
        pose = find_pose(loaded([box(CAR)]), options(forward_axis="-z"), suffix=".glb")
        assert pose.forward_axis == "-z"
        assert check(pose, "forward_axis").state == "ok"


@pytest.mark.parametrize("up", ["x", "y", "z"])
@pytest.mark.parametrize("forward", ["x", "-x", "y", "-y", "z", "-z"])
def test_every_pair_of_axes_ends_in_the_same_pose(up: UpAxis, forward: str) -> None:
    """A car with its nose at the front, made in any axes: x forward, y left, z up, standing centred on the ground."""
    axes = "xyz"
    if forward[-1] == up:
        with pytest.raises(FieldError, match="forward_axis"):
            options(up_axis=up, forward_axis=forward)
        return
    ahead, above = np.zeros(3), np.zeros(3)
    ahead[axes.index(forward[-1])] = -1 if forward.startswith("-") else 1
    above[axes.index(up)] = 1
    columns = np.stack([ahead, np.cross(above, ahead), above], axis=1)  # canonical axes in the file's
    body = box((4.5, 1.8, 1.4), (10, -3, 7))
    nose = box((0.2, 0.3, 0.2), (12.3, -2.5, 7), name="nose")
    in_file = [part(item.vertices_m @ columns.T, item.faces, name=item.name) for item in (body, nose)]
    model = loaded(in_file, up=up)
    pose = find_pose(model, options(up_axis=up, forward_axis=forward), suffix=".obj")
    posed = [posed_part(item, pose) for item in model.parts]
    points = np.concatenate([item.vertices_m for item in posed])
    assert_allclose([points.min(axis=0), points.max(axis=0)], [[-2.325, -0.9, 0], [2.325, 0.9, 1.4]], atol=1e-9)
    assert_allclose(posed[1].vertices_m.mean(axis=0), [2.225, 0.5, 0.7], atol=1e-9)
    a, b, c = (posed[0].vertices_m[posed[0].faces[:, k]] for k in range(3))
    turned = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
    assert abs(turned) == pytest.approx(4.5 * 1.8 * 1.4), "a rotation keeps volume and handedness"
    assert np.linalg.det(pose.turn) == pytest.approx(1.0)
