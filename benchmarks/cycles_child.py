"""Runs under Blender's Python: builds the scene that benchmarks.cycles wrote, renders one sample, then each run of the task.

Arguments: the folder with scene.json, scene.npz and task.json; told.json and rgb.npy, (runs, rows, cols, channels), are written
there.
"""

from __future__ import annotations

import json
import math
import statistics
import sys
import time
from pathlib import Path
from typing import Any

import bpy
import numpy as np
from mathutils import Matrix, Vector

_SET_UPS = 7


def shader(name: str, described: dict[str, Any]) -> Any:
    """Return a Blender material."""
    material = bpy.data.materials.new(name)
    material.use_nodes = True
    nodes, links = material.node_tree.nodes, material.node_tree.links
    nodes.clear()
    out = nodes.new("ShaderNodeOutputMaterial")
    kind, colour = described["kind"], (*described.get("color", (1, 1, 1)), 1.0)
    if kind == "diffuse":
        node = nodes.new("ShaderNodeBsdfDiffuse")
        node.inputs["Color"].default_value = colour
    elif kind == "glass":
        node = nodes.new("ShaderNodeBsdfGlass")
        node.inputs["IOR"].default_value = described["ior"]
        node.inputs["Roughness"].default_value = described["roughness"]
    elif kind == "emission":
        node = emission(nodes, links, colour)
        material.cycles.emission_sampling = "FRONT"
    else:
        node = nodes.new("ShaderNodeBsdfPrincipled")
        node.inputs["Base Color"].default_value = colour
        node.inputs["Roughness"].default_value = described["roughness"]
        node.inputs["IOR"].default_value = described["ior"]
        node.inputs["Metallic"].default_value = described["metallic"]
    links.new(node.outputs[0], out.inputs["Surface"])
    return material


def emission(nodes: Any, links: Any, colour: tuple[float, ...]) -> Any:
    """Return an emission node that shines from the front only."""
    node, geometry, flip = nodes.new("ShaderNodeEmission"), nodes.new("ShaderNodeNewGeometry"), nodes.new("ShaderNodeMath")
    strength = max(colour[:3]) or 1.0
    node.inputs["Color"].default_value = (*(c / strength for c in colour[:3]), 1.0)
    flip.operation = "MULTIPLY_ADD"
    links.new(geometry.outputs["Backfacing"], flip.inputs[0])
    flip.inputs[1].default_value, flip.inputs[2].default_value = -strength, strength
    links.new(flip.outputs[0], node.inputs["Strength"])
    return node


def add_meshes(document: dict[str, Any], arrays: Any) -> None:
    """Add one object per material."""
    for number, described in enumerate(document["materials"]):
        vertices, faces, normals = (arrays[f"{kind}{number}"] for kind in "vfn")
        mesh = bpy.data.meshes.new(f"m{number}")
        mesh.from_pydata(vertices.tolist(), [], faces.tolist())
        mesh.materials.append(shader(f"m{number}", described))
        mesh.shade_smooth()
        mesh.normals_split_custom_set_from_vertices(normals.tolist())
        bpy.context.collection.objects.link(bpy.data.objects.new(f"m{number}", mesh))


def add_lights(document: dict[str, Any], arrays: Any) -> None:
    """Add sun, sky or a constant environment; without either the world is black."""
    world = bpy.data.worlds.new("world")
    bpy.context.scene.world = world
    world.use_nodes = True
    nodes, links = world.node_tree.nodes, world.node_tree.links
    background = nodes["Background"]
    background.inputs["Color"].default_value = (0, 0, 0, 1)
    for number, light in enumerate(document["lights"]):
        if light["kind"] == "constant":
            strength = max(light["color"]) or 1.0
            background.inputs["Color"].default_value = (*(c / strength for c in light["color"]), 1.0)
            background.inputs["Strength"].default_value = strength
        elif light["kind"] == "sky":
            sky = arrays["sky"]
            image = bpy.data.images.new("sky", sky.shape[1], sky.shape[0], float_buffer=True)
            image.colorspace_settings.name = "Non-Color"
            image.pixels.foreach_set(np.concatenate([sky, np.ones_like(sky[..., :1])], axis=-1).ravel())
            image.pack()
            node = nodes.new("ShaderNodeTexEnvironment")
            node.image = image
            links.new(node.outputs["Color"], background.inputs["Color"])
        else:
            add_sun(number, light)


def add_sun(number: int, light: dict[str, Any]) -> None:
    """Add a sun lamp; its strength is the irradiance on a surface that faces it."""
    lamp = bpy.data.lights.new(f"sun{number}", "SUN")
    strength = max(light["color"]) or 1.0
    lamp.energy, lamp.color, lamp.angle = strength, [c / strength for c in light["color"]], light["angle"]
    holder = bpy.data.objects.new(f"sun{number}", lamp)
    holder.rotation_mode = "QUATERNION"
    holder.rotation_quaternion = Vector(light["direction"]).to_track_quat("-Z", "Y")
    bpy.context.collection.objects.link(holder)


def add_camera(described: dict[str, Any]) -> None:
    """Add the camera and set the size of the picture."""
    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit, camera.sensor_width = "HORIZONTAL", 36.0
    camera.lens = 18.0 / math.tan(described["angle_x"] / 2)
    camera.clip_start, camera.clip_end = 1e-3, 1e5
    if described["pupil_radius_m"] > 0:
        camera.dof.use_dof, camera.dof.focus_distance = True, described["focus_m"]
        camera.dof.aperture_fstop = camera.lens * 1e-3 / (2 * described["pupil_radius_m"])
    holder = bpy.data.objects.new("camera", camera)
    holder.matrix_world = Matrix(described["pose"])
    bpy.context.collection.objects.link(holder)
    scene = bpy.context.scene
    scene.camera = holder
    scene.render.resolution_x, scene.render.resolution_y, scene.render.resolution_percentage = (
        described["cols"],
        described["rows"],
        100,
    )


def settings(described: dict[str, Any], task: dict[str, Any], file: Path) -> None:
    """Switch off everything that trades bias for speed, but what the task asks for."""
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    cycles = scene.cycles
    cycles.device, cycles.use_adaptive_sampling, cycles.use_denoising = "CPU", False, False
    cycles.use_light_tree, cycles.light_sampling_threshold = task["light_tree"], 0.0
    cycles.sample_clamp_direct, cycles.sample_clamp_indirect = 0.0, task["clamp_indirect"]
    cycles.blur_glossy, cycles.caustics_reflective, cycles.caustics_refractive = task["filter_glossy"], True, True
    bounces = described["max_depth"] - 1
    for name in ("max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces", "transparent_max_bounces"):
        setattr(cycles, name, bounces)
    cycles.pixel_filter_type, cycles.filter_width = "BOX", 1.0
    cycles.use_auto_tile = False
    scene.view_settings.view_transform = "Raw"
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_depth, scene.render.image_settings.color_mode = "32", "RGB"
    scene.render.filepath = str(file)


def timed_render(samples: int, seed: int) -> tuple[float, float]:
    """Render and return (CPU-seconds of all threads, seconds)."""
    cycles = bpy.context.scene.cycles
    cycles.samples, cycles.seed = samples, seed
    cpu, wall = time.process_time(), time.perf_counter()
    bpy.ops.render.render(write_still=True)
    return time.process_time() - cpu, time.perf_counter() - wall


def picture(file: Path) -> Any:
    """Return the picture of a file, (rows, cols, channels) from the top."""
    image = bpy.data.images.load(str(file))
    image.colorspace_settings.name = "Non-Color"
    pixels = np.empty(image.size[0] * image.size[1] * image.channels, dtype=np.float32)
    image.pixels.foreach_get(pixels)
    rows = pixels.reshape(image.size[1], image.size[0], image.channels)[::-1].copy()
    bpy.data.images.remove(image)
    return rows


def main() -> None:
    """Build, warm up, render, tell."""
    folder = Path(sys.argv[-1])
    document = json.loads((folder / "scene.json").read_text())
    task = json.loads((folder / "task.json").read_text())
    bpy.ops.wm.read_factory_settings(use_empty=True)
    with np.load(folder / "scene.npz") as arrays:
        add_meshes(document, arrays)
        add_lights(document, arrays)
    add_camera(document["camera"])
    file = folder / "picture.exr"
    settings(document["camera"], task, file)
    cold_cpu, _ = timed_render(1, 0)
    # Each render sends the scene again and builds its tree anew: the time of some ten samples, and not the same each time.
    one_cpu, one_wall = (
        statistics.median(column) for column in zip(*(timed_render(1, 0) for _ in range(_SET_UPS)), strict=True)
    )
    times, pictures = [], []
    for run in task["runs"]:
        times.append(timed_render(run["samples"], run["seed"]))
        pictures.append(picture(file))
    np.save(folder / "rgb.npy", np.stack(pictures))
    told = {
        "cpu_s": [cpu for cpu, _ in times],
        "wall_s": [wall for _, wall in times],
        "one_sample_cpu_s": one_cpu,
        "one_sample_wall_s": one_wall,
        "cold_cpu_s": cold_cpu,
        "blender": bpy.app.version_string,
    }
    (folder / "told.json").write_text(json.dumps(told))


main()
