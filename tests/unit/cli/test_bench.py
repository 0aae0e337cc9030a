"""The built-in benchmark: scenes that resolve, shares that add up, wrong options refused, the checkout's benchmark called."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import typer
from typer.testing import CliRunner

from fullwell.cli import bench
from fullwell.core.errors import FieldError, NotFoundError
from fullwell.schema import build_frame, load_recipe

ROUNDING = 1e-9


def _app() -> typer.Typer:
    app = typer.Typer()
    app.callback()(lambda: None)
    bench.register(app)
    return app


@pytest.mark.parametrize("name", sorted(bench._SCENES))
def test_a_built_in_scene_needs_no_files(name: str) -> None:
    frame = build_frame(load_recipe(bench._SCENES[name]((16, 8))))
    film = frame.cameras[0].camera.film
    assert (film.cols, film.rows) == (16, 8)
    assert frame.quality.noise_ratio == bench.NOISE_RATIO


def test_many_lamps_are_many() -> None:
    lights = bench._many_lamps((16, 8))["scene"]["lights"]
    assert len({light["name"] for light in lights}) == 196


def test_a_small_run_reports_every_figure_as_json(tmp_path: Path) -> None:
    file = tmp_path / "out" / "bench.json"
    options = ["bench", "--scenes", "cornell_box", "--size", "16x16", "--minutes", "0.1", "--json", "-o", str(file)]
    result = CliRunner().invoke(_app(), options)
    assert result.exit_code == 0, result.output
    report = json.loads(result.stdout)
    assert json.loads(file.read_text()) == report
    (scene,) = report["scenes"]
    assert scene["scene"] == "cornell_box"
    assert scene["paths"] == 16 * 16 * 64
    assert scene["mega_paths_per_cpu_s"] == pytest.approx(scene["paths"] / scene["paths_cpu_s"] / 1e6, rel=ROUNDING)
    assert sum(scene["frame_shares"].values()) == pytest.approx(1, rel=ROUNDING)
    assert {"tracing", "labels", "sensor", "isp", "encode"} <= set(scene["frame_shares"])
    assert scene["target_samples"] >= 16
    assert scene["target_met"] == (scene["reached_noise_ratio"] <= bench.NOISE_RATIO)


def test_the_table_has_a_column_for_each_scene() -> None:
    figures: dict[str, Any] = dict.fromkeys(bench.SceneReport.__dataclass_fields__, 1.0)
    figures |= {"size_px": (16, 16), "variant": "v", "target_met": False, "frame_shares": {"tracing": 1.0}}
    report = bench.BenchReport({"fullwell": "1"}, [bench.SceneReport(**figures | {"scene": name}) for name in ("one", "two")])
    app = typer.Typer()
    app.command()(lambda: bench._print(report))
    shown = CliRunner().invoke(app, [], env={"COLUMNS": "200"}).stdout
    assert "one" in shown
    assert "two" in shown
    assert "worst tile" in shown


@pytest.mark.parametrize("size", ["160", "160x", "4x4", "axb", "100000x100000"])
def test_a_wrong_size_names_itself(size: str) -> None:
    with pytest.raises(FieldError, match="--size"):
        bench._size(size)


def test_an_unknown_scene_is_answered_with_the_nearest() -> None:
    with pytest.raises(FieldError, match="cornell_box"):
        bench._names("cornel_box")


def test_full_runs_the_checkout_with_its_own_options(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    called: list[tuple[list[str], Path]] = []

    def run(command: list[str], *, cwd: Path, check: bool) -> Any:
        called.append((command, cwd))
        return SimpleNamespace(returncode=3)

    monkeypatch.setattr(subprocess, "run", run)
    options = ["bench", "--full", "--scenes", "street_day,car_park", "--size", "80x60", "--minutes", "2", "-o", str(tmp_path)]
    assert CliRunner().invoke(_app(), options).exit_code == 3
    ((command, folder),) = called
    assert (folder / "benchmarks" / "error_against_time.py").is_file()
    wanted = ["--size", "80x60", "--minutes", "2", "--scene", "street_day", "--scene", "car_park", "--results", str(tmp_path)]
    assert command[2:] == ["benchmarks.error_against_time", *wanted]


def test_full_without_a_checkout_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(bench, "_checkout", lambda: None)
    with pytest.raises(NotFoundError, match="source checkout"):
        bench._run_full(None, "80x60", 1.0, None)
