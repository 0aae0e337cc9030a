"""The renderer for machines without LLVM gives the same radiance, within its own noise."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

STANDARD_ERROR = 2e-3
"""Of the mean over 31 bands, 768 pixels and 64 samples, whose wavelengths are drawn by chance."""

SCENES = """
import sys; sys.path.insert(0, sys.argv[1])
import numpy as np
import test_analytic_scenes as t
scenes = [
    t.SceneDescription((t.thing(t.Rectangle((10, 10)), 0.0, emission=t.Emission(t.ONE)),)),
    t.SceneDescription((t.thing(t.Rectangle((100, 100)), 0.37),), (t.ConstantEnvironment(t.ONE),)),
    t.SceneDescription((t.thing(t.Sphere(1.0), 1.0),), (t.ConstantEnvironment(t.ONE),)),
]
print(*(t.radiance_w(scene, t.camera(), depth=64).mean() for scene in scenes))
"""


def test_scalar_renderer_meets_the_closed_forms_within_its_noise() -> None:
    command = [sys.executable, "-c", SCENES, str(Path(__file__).parent)]
    environment = {**os.environ, "FULLWELL_VARIANT": "scalar_spectral"}
    printed = subprocess.run(command, env=environment, check=True, capture_output=True, text=True).stdout
    assert [float(word) for word in printed.split()] == pytest.approx([1.0, 0.37, 1.0], rel=4 * STANDARD_ERROR)
