"""From scene radiance to irradiance on the sensor: one module per effect, `model` holds their order."""

from fullwell.optics.camera_equation import on_axis_factor_sr, projected_solid_angle_sr, working_f_number
from fullwell.optics.diffraction import airy_radius_m, cutoff_cycles_per_m, diffract_band, diffraction_otf
from fullwell.optics.model import OPTICS_TERMS, OpticsTerm, compute_irradiance
from fullwell.optics.relative_illumination import cos_fourth, disc_falloff, relative_illumination
from fullwell.scene.images import OpticalImage

__all__ = [
    "OPTICS_TERMS",
    "OpticalImage",
    "OpticsTerm",
    "airy_radius_m",
    "compute_irradiance",
    "cos_fourth",
    "cutoff_cycles_per_m",
    "diffract_band",
    "diffraction_otf",
    "disc_falloff",
    "on_axis_factor_sr",
    "projected_solid_angle_sr",
    "relative_illumination",
    "working_f_number",
]
