"""The scene as the numerics see it: frozen dataclasses, metres, z up, spectra in absolute units."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fullwell.core.hashing import Unchanging
from fullwell.radiometry.spectrum import Spectrum

__all__ = [
    "BeamPattern",
    "Conductor",
    "ConstantEnvironment",
    "Cube",
    "Cylinder",
    "Dielectric",
    "Diffuse",
    "DirectionalLight",
    "Disk",
    "Emission",
    "Fog",
    "Geometry",
    "GoniometricLight",
    "ImageEnvironment",
    "Light",
    "Material",
    "Mesh",
    "Mirror",
    "Part",
    "PointLight",
    "Principled",
    "Rectangle",
    "RoughPlastic",
    "SceneDescription",
    "SceneObject",
    "Sphere",
    "SpotLight",
    "SunSky",
    "Texture",
    "Translucent",
]


# Geometry, in the part's own coordinates -----------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Sphere:
    """Sphere of `radius_m` about the origin."""

    radius_m: float = 1.0


@dataclass(frozen=True, slots=True)
class Rectangle:
    """Rectangle in the xy plane, centred, `size_m` = (x, y) edge lengths; its normal is +z."""

    size_m: tuple[float, float] = (1.0, 1.0)


@dataclass(frozen=True, slots=True)
class Disk:
    """Disk in the xy plane of `radius_m`; its normal is +z."""

    radius_m: float = 1.0


@dataclass(frozen=True, slots=True)
class Cube:
    """Box of edge lengths `size_m` = (x, y, z), centred on the origin."""

    size_m: tuple[float, float, float] = (1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True)
class Cylinder:
    """Open cylinder of `radius_m` along z, from -height_m/2 to +height_m/2, normals outwards."""

    radius_m: float = 1.0
    height_m: float = 1.0


@dataclass(frozen=True, slots=True, eq=False)
class Mesh(Unchanging):
    """Triangles. `normals` and `uv` are per vertex, or None (then shading is flat / untextured)."""

    vertices_m: NDArray[np.float64]
    faces: NDArray[np.uint32]
    normals: NDArray[np.float64] | None = None
    uv: NDArray[np.float64] | None = None


Geometry: TypeAlias = Sphere | Rectangle | Disk | Cube | Cylinder | Mesh


# Materials -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class Texture(Unchanging):
    """An sRGB colour image, (rows, cols, 3) uint8, row 0 at v = 1; upsampled to reflectance by the renderer."""

    pixels: NDArray[np.uint8]


@dataclass(frozen=True, slots=True, eq=False)
class Diffuse:
    """Lambertian; reflectance in [0, 1]. Two-sided."""

    reflectance: Spectrum | Texture


@dataclass(frozen=True, slots=True, eq=False)
class Translucent:
    """A thin sheet such as a leaf: Lambertian on both sides, for light from either; reflectance + transmittance in [0, 1]."""

    reflectance: Spectrum
    transmittance: Spectrum


@dataclass(frozen=True, slots=True, eq=False)
class RoughPlastic:
    """Diffuse base under a rough dielectric coat (GGX, `roughness` = alpha in (0, 1])."""

    reflectance: Spectrum | Texture
    roughness: float = 0.1
    interior_index: float = 1.5


@dataclass(frozen=True, slots=True, eq=False)
class Principled:
    """The metallic-roughness model of asset formats."""

    base_color: Spectrum | Texture
    roughness: float = 0.5
    metallic: float = 0.0
    specular: float = 0.5


@dataclass(frozen=True, slots=True, eq=False)
class Conductor:
    """Metal with complex index eta + i k; roughness 0 is a perfect mirror surface."""

    eta: Spectrum
    k: Spectrum
    roughness: float = 0.0


@dataclass(frozen=True, slots=True)
class Dielectric:
    """Clear refracting body; roughness 0 is polished. An index that is a spectrum bends each wavelength its own way."""

    interior_index: float | Spectrum = 1.5046
    exterior_index: float = 1.000277
    roughness: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Mirror:
    """Ideal specular reflector of the given reflectance."""

    reflectance: Spectrum


Material: TypeAlias = Diffuse | RoughPlastic | Principled | Conductor | Dielectric | Mirror | Translucent


# Objects -------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class BeamPattern:
    """How a lamp spreads its light: shares of its intensity over directions, bilinear between even steps, 0 outside.

    Attributes
    ----------
    shares
        (rows, cols), >= 0 and at least 2 each; rows go up in elevation, columns in azimuth.
    azimuth_deg
        (first, last) column, about the lamp's up, 0 forward and positive to its left, within [-180, 180].
    elevation_deg
        (first, last) row, from the plane of forward and left towards up, within [-90, 90].
    """

    shares: NDArray[np.float32]
    azimuth_deg: tuple[float, float]
    elevation_deg: tuple[float, float]

    def azimuths_rad(self) -> NDArray[np.float64]:
        """Return (cols,) azimuths [rad]."""
        return np.radians(np.linspace(*self.azimuth_deg, self.shares.shape[1]))

    def elevations_rad(self) -> NDArray[np.float64]:
        """Return (rows,) elevations [rad]."""
        return np.radians(np.linspace(*self.elevation_deg, self.shares.shape[0]))

    def steps_rad(self) -> tuple[float, float]:
        """Return the steps of azimuth and elevation [rad]."""
        rows, cols = self.shares.shape
        (left, right), (low, high) = np.radians(self.azimuth_deg), np.radians(self.elevation_deg)
        return float(right - left) / (cols - 1), float(high - low) / (rows - 1)

    def directions(self) -> NDArray[np.float64]:
        """Return (rows, cols, 3) unit vectors in (forward, left, up)."""
        elevation, azimuth = np.meshgrid(self.elevations_rad(), self.azimuths_rad(), indexing="ij")
        flat = np.cos(elevation)
        return np.stack([flat * np.cos(azimuth), flat * np.sin(azimuth), np.sin(elevation)], axis=-1)

    def share(self, azimuth_deg: ArrayLike, elevation_deg: ArrayLike) -> NDArray[np.float64]:
        """Return the shares in directions, as the renderer mixes them."""
        rows, cols = self.shares.shape
        col, row = (
            (np.asarray(angle, dtype=np.float64) - first) / (last - first) * (count - 1)
            for angle, (first, last), count in (
                (azimuth_deg, self.azimuth_deg, cols),
                (elevation_deg, self.elevation_deg, rows),
            )
        )
        inside = (col >= 0) & (col <= cols - 1) & (row >= 0) & (row <= rows - 1)
        side = np.clip(np.floor(col), 0, cols - 2).astype(np.int64)
        top = np.clip(np.floor(row), 0, rows - 2).astype(np.int64)
        across, down = np.clip(col - side, 0, 1), np.clip(row - top, 0, 1)
        table = np.asarray(self.shares, dtype=np.float64)
        low = table[top, side] * (1 - across) + table[top, side + 1] * across
        high = table[top + 1, side] * (1 - across) + table[top + 1, side + 1] * across
        return np.where(inside, low * (1 - down) + high * down, 0.0)

    def solid_angle_sr(self) -> float:
        """Return flux over the intensity of a share of 1 [sr]: midpoints of the table's cells."""
        table = np.asarray(self.shares, dtype=np.float64)
        middle = (table[1:, 1:] + table[:-1, 1:] + table[1:, :-1] + table[:-1, :-1]) / 4
        sine = np.sin(self.elevations_rad())
        return float((middle * np.diff(sine)[:, None]).sum() * self.steps_rad()[0])


@dataclass(frozen=True, slots=True, eq=False)
class Emission:
    """Surface emission: radiance [W sr^-1 m^-2 nm^-1] on the side of the normal, in a named light group.

    With a `pattern` the radiance is that where its share is 1, by direction in the part's own axes: x forward, y left, z up.
    """

    radiance: Spectrum
    group: str = "default"
    pattern: BeamPattern | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Part:
    """One geometry with one material. `to_object` is the (4, 4) affine transform into the object's coordinates."""

    geometry: Geometry
    material: Material
    to_object: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))
    emission: Emission | None = None
    name: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class SceneObject(Unchanging):
    """What a label counts as one thing.

    Attributes
    ----------
    id
        Stable string from the recipe, unique in the scene.
    semantic_class
        For example "car"; "" means unlabelled (semantic id 0; it still has an instance id).
    parts
        At least one.
    to_world
        (4, 4) affine transform from object to world [m].
    licences
        Licence identifiers of the assets it is made of.
    """

    id: str
    semantic_class: str
    parts: tuple[Part, ...]
    to_world: NDArray[np.float64] = field(default_factory=lambda: np.eye(4))
    licences: tuple[str, ...] = ()


# Lights --------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, eq=False)
class PointLight:
    """Radiant intensity [W sr^-1 nm^-1], equal in all directions."""

    position_m: tuple[float, float, float]
    intensity: Spectrum
    group: str = "default"


@dataclass(frozen=True, slots=True, eq=False)
class SpotLight:
    """Radiant intensity [W sr^-1 nm^-1] on the axis, full within `beam_deg`, linear in angle to 0 at `cutoff_deg`.

    Both are half angles from the axis, 0 < beam_deg < cutoff_deg < 90. `carrier` is the id of the object, in the scene or left
    out of it, that it moves with; "" stands still.
    """

    position_m: tuple[float, float, float]
    direction: tuple[float, float, float]
    intensity: Spectrum
    beam_deg: float
    cutoff_deg: float
    group: str = "default"
    carrier: str = ""


@dataclass(frozen=True, slots=True, eq=False)
class GoniometricLight:
    """A point that shines by a pattern: `intensity` [W sr^-1 nm^-1] where its share is 1.

    `up` need not be at right angles to `forward`, but not along it. `carrier` is the id of the object, in the scene or left out
    of it, that it moves with; "" stands still.
    """

    position_m: tuple[float, float, float]
    forward: tuple[float, float, float]
    up: tuple[float, float, float]
    pattern: BeamPattern
    intensity: Spectrum
    group: str = "default"
    carrier: str = ""

    def frame(self) -> NDArray[np.float64]:
        """Return (3, 3) unit columns forward, left and up in the world."""
        forward = np.asarray(self.forward, dtype=np.float64) / np.linalg.norm(self.forward)
        left = np.cross(np.asarray(self.up, dtype=np.float64), forward)
        left /= np.linalg.norm(left)
        return np.column_stack([forward, left, np.cross(forward, left)])


@dataclass(frozen=True, slots=True, eq=False)
class DirectionalLight:
    """Irradiance [W m^-2 nm^-1] on a surface facing the light; `direction` is the way the light travels."""

    direction: tuple[float, float, float]
    irradiance: Spectrum
    group: str = "default"


@dataclass(frozen=True, slots=True, eq=False)
class ConstantEnvironment:
    """The same radiance [W sr^-1 m^-2 nm^-1] from every direction."""

    radiance: Spectrum
    group: str = "default"


@dataclass(frozen=True, slots=True, eq=False)
class ImageEnvironment:
    """A latitude-longitude image times a spectrum.

    `pixels` (rows, cols, 3) float32 linear sRGB, row 0 at the zenith (+z), relative; the pixel colour is upsampled, and
    a pixel of (1, 1, 1) has the radiance `radiance` [W sr^-1 m^-2 nm^-1]. `azimuth_deg` turns it about +z.
    """

    pixels: NDArray[np.float32]
    radiance: Spectrum
    azimuth_deg: float = 0.0
    group: str = "default"


@dataclass(frozen=True, slots=True, eq=False)
class SunSky:
    """Sun and clear sky in absolute units. `sun_direction` points from the scene to the sun, not below the horizon.

    `group` is the light group of the sky, `sun_group` that of the sun's disk; the sky's where it is empty.
    """

    sun_direction: tuple[float, float, float]
    turbidity: float = 3.0
    ground_albedo: float = 0.2
    sun_weight: float = 1.0
    sky_weight: float = 1.0
    group: str = "default"
    sun_group: str = ""


@dataclass(frozen=True, slots=True)
class Fog:
    """A layer of droplets, even in itself and without end to the sides.

    Attributes
    ----------
    extinction_per_m
        Share of the light that is scattered or absorbed per metre [m^-1], > 0, the same at all wavelengths: droplets are larger
        than these.
    albedo
        Share of that which is scattered, in [0, 1].
    asymmetry
        Mean cosine of the angle of scattering, in (-1, 1); Henyey and Greenstein's phase function.
    bottom_m, top_m
        Heights of its ends [m], world z.
    """

    extinction_per_m: float
    albedo: float = 0.999
    asymmetry: float = 0.85
    bottom_m: float = -1e4
    top_m: float = 100.0


Light: TypeAlias = (
    PointLight | SpotLight | GoniometricLight | DirectionalLight | ConstantEnvironment | ImageEnvironment | SunSky
)


@dataclass(frozen=True, slots=True, eq=False)
class SceneDescription(Unchanging):
    """Everything the renderer needs but the camera."""

    objects: tuple[SceneObject, ...]
    lights: tuple[Light, ...] = ()
    semantic_classes: tuple[str, ...] = ()
    """Names in the order of their semantic ids: ``semantic_classes[i]`` has id i + 1; 0 is unlabelled."""
    fog: Fog | None = None
