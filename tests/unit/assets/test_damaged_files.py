"""Files with bytes changed, cut and removed: each is read or refused with a ModelError, quickly, and never crashes."""

from __future__ import annotations

import random
import time
from pathlib import Path

import pytest

from fullwell.assets import ModelError, load_model

trimesh = pytest.importorskip("trimesh")
pytest.importorskip("pxr")

LONGEST_S = 20.0
"""What takes this long hangs; alone, a damaged file takes well under 2 s."""

DAMAGES_PER_FORMAT = 150
DAMAGED_CRATES = 12


def write_usd(file: Path) -> None:
    from pxr import Gf, Usd, UsdGeom

    stage = Usd.Stage.CreateNew(str(file))
    UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    mesh = UsdGeom.Mesh.Define(stage, "/Ball")
    ball = trimesh.creation.icosphere(1)
    mesh.CreatePointsAttr([Gf.Vec3f(*point) for point in ball.vertices.tolist()])
    mesh.CreateFaceVertexCountsAttr([3] * len(ball.faces))
    mesh.CreateFaceVertexIndicesAttr(ball.faces.reshape(-1).tolist())
    stage.GetRootLayer().Save()


def damaged(content: bytes, rng: random.Random) -> bytes:
    changed = bytearray(content)
    kind = rng.random()
    if kind < 0.25:
        return content[: rng.randrange(len(content))]
    if kind < 0.75:
        # Headers matter most: half of the changes go there.
        reach = len(changed) if rng.random() < 0.5 else min(len(changed), 300)
        for _ in range(rng.choice([1, 3, 20])):
            changed[rng.randrange(reach)] = rng.randrange(256)
        return bytes(changed)
    start = rng.randrange(len(changed))
    del changed[start : start + rng.randrange(1, 200)]
    return bytes(changed)


@pytest.mark.slow
@pytest.mark.parametrize("suffix", [".glb", ".obj", ".ply", ".stl", ".usda", ".usdc"])
def test_damaged_files_are_read_or_refused(suffix: str, tmp_path: Path) -> None:
    whole = tmp_path / f"whole{suffix}"
    if suffix.startswith(".usd"):
        write_usd(whole)
    else:
        trimesh.creation.icosphere(1).export(whole)
    assert load_model(whole).triangle_count == 80
    rng = random.Random(20240229)
    refused, slowest_s = 0, 0.0
    # Binary USD is read in a child process first, which takes half a second each time.
    for number in range(DAMAGES_PER_FORMAT if suffix != ".usdc" else DAMAGED_CRATES):
        file = tmp_path / f"damaged_{number}{suffix}"
        file.write_bytes(damaged(whole.read_bytes(), rng))
        started = time.perf_counter()
        try:
            load_model(file)
        except ModelError:
            refused += 1
        slowest_s = max(slowest_s, time.perf_counter() - started)
    assert refused > 0
    assert slowest_s < LONGEST_S


def test_a_crate_that_asks_for_all_memory_is_refused(tmp_path: Path) -> None:
    """Found by changing bytes at random: this one made USD ask for terabytes."""
    whole = tmp_path / "whole.usdc"
    write_usd(whole)
    rng = random.Random(20240229)
    for _ in range(148):
        content = damaged(whole.read_bytes(), rng)
    file = tmp_path / "greedy.usdc"
    file.write_bytes(content)
    with pytest.raises(ModelError, match="damaged"):
        load_model(file)
