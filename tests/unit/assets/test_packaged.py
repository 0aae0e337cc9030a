"""Models inside the eclipse-sumo package, found without importing it."""

from __future__ import annotations

import importlib.util
import subprocess
import sys

import pytest

from fullwell.assets import ModelError, load_model, packaged, packaged_model, packaged_model_names

with_sumo = pytest.mark.skipif(importlib.util.find_spec("sumo") is None, reason="eclipse-sumo is not installed")


@with_sumo
def test_every_packaged_model_can_be_read() -> None:
    names = packaged_model_names()
    assert "sumo:tram.obj" in names
    for name in names:
        model = packaged_model(name)
        loaded = load_model(model.path)
        assert loaded.triangle_count > 0
        assert "EPL-2.0" in model.licence
        assert "Eclipse SUMO" in model.source


@with_sumo
def test_the_ending_may_be_left_away() -> None:
    assert packaged_model("sumo:tram") == packaged_model("sumo:tram.obj")


@with_sumo
def test_an_unknown_name_is_answered_with_the_nearest() -> None:
    with pytest.raises(ModelError, match="did you mean 'sumo:humanResting"):
        packaged_model("sumo:humanresting.ob")


@with_sumo
def test_a_name_cannot_leave_the_package() -> None:
    with pytest.raises(ModelError):
        packaged_model("sumo:../typemap/x")


def test_without_the_package_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(packaged, "find_spec", lambda name: None)
    with pytest.raises(ModelError, match=r"fullwell\[traffic\]") as caught:
        packaged_model("sumo:tram", field_path="scene.objects[0].file")
    assert caught.value.path == "scene.objects[0].file"
    assert packaged_model_names() == []


def test_finding_a_model_imports_no_sumo() -> None:
    # In a process of its own: tests of traffic in this one may have imported it.
    code = "import sys, fullwell.assets; fullwell.assets.packaged_model_names(); sys.exit('sumolib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
