"""The scalar renderer loads a mesh that many objects share once: the same picture and the same labels as with copies."""

from __future__ import annotations

import json
import os
import subprocess
import sys

import pytest

SCRIPT = """
import json, sys
import numpy as np
import fullwell.render.translate as translate
from fullwell.radiometry import Spectrum, WavelengthGrid
from fullwell.render import query_surfaces, render_radiance
from fullwell.scene import (
    Camera, ConstantEnvironment, Diffuse, Film, Lens, Mesh, Part, SceneDescription, SceneObject, Sphere, look_at,
)
from fullwell.scene.tessellate import mesh_of

translate._WORTH_SHARING = float(sys.argv[1])
mesh, grey = mesh_of(Sphere(1.0)), Diffuse(Spectrum.constant(0.4))
objects = []
for number in range(9):
    place = np.eye(4)
    place[:3, 3] = [3.0 * (number % 3) - 3.0, 0.5 * number, 3.0 * (number // 3) - 3.0]
    objects.append(SceneObject(f"ball{number}", "", (Part(mesh, grey),), place))
scene = SceneDescription(tuple(objects), (ConstantEnvironment(Spectrum.constant(1.0)),))
pose = look_at(np.array([0.0, -20.0, 0.0]), np.zeros(3), np.array([0.0, 0.0, 1.0]))
camera = Camera("main", pose, Lens("pinhole", 0.05, 4.0, np.inf, Spectrum.constant(1.0)), Film(24, 32, 1e-3))
image, statistics = render_radiance(scene, camera, WavelengthGrid(500, 600, 50), samples_per_pixel=64, max_depth=4, seed=1)
hits = query_surfaces(scene, camera)
found = {
    "variant": statistics.variant,
    "blocks": image.photons.reshape(4, 6, 4, 8, 3).mean(axis=(1, 3)).ravel().tolist(),
    "objects": hits.object_index.ravel().tolist(),
}
print(json.dumps(found))
"""


def rendered(threshold: str) -> dict[str, object]:
    environment = dict(os.environ) | {"FULLWELL_VARIANT": "scalar_spectral"}
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, threshold], env=environment, capture_output=True, text=True, check=True, timeout=200
    )
    found: dict[str, object] = json.loads(done.stdout.splitlines()[-1])
    return found


@pytest.mark.slow
def test_instances_give_the_picture_and_the_labels_of_copies() -> None:
    instances, copies = rendered("0"), rendered("inf")
    assert instances["variant"] == "scalar_spectral"
    assert instances["objects"] == copies["objects"]
    assert set(range(9)) <= set(instances["objects"])  # type: ignore[call-overload]
    assert instances["blocks"] == pytest.approx(copies["blocks"], rel=1e-3)
