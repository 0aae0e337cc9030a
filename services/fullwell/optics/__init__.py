"""From scene radiance to irradiance on the sensor: one module per effect, `model` holds their order."""

from fullwell.optics.camera_equation import on_axis_factor_sr, projected_solid_angle_sr, working_f_number
from fullwell.optics.channels import channels_suffice, form_channel_image
from fullwell.optics.defocus import circle_of_confusion_px, defocus, defocus_layers
from fullwell.optics.diffraction import (
    airy_radius_m,
    cutoff_cycles_per_m,
    diffract_band,
    diffraction_otf,
    nyquist_contrast_loss,
)
from fullwell.optics.flare import Aperture, aperture_mask, flare_point_image
from fullwell.optics.model import IDEAL_LENS, MAX_SKIPPED_CONTRAST_LOSS, OPTICS_TERMS, OpticsTerm, compute_irradiance
from fullwell.optics.parameters import OpticsOptions
from fullwell.optics.psf import PointImage, PointSpread, PointSpreadFilter, gaussian_psf, pillbox_psf, read_psf, write_psf
from fullwell.optics.relative_illumination import cos_fourth, disc_falloff, relative_illumination
from fullwell.optics.wavefront import (
    Wavefront,
    defocus_coefficient_m,
    defocus_dioptres,
    strehl_ratio,
    wavefront_point_image,
    zernike,
    zernike_order,
)
from fullwell.scene.images import OpticalImage

__all__ = [
    "IDEAL_LENS",
    "MAX_SKIPPED_CONTRAST_LOSS",
    "OPTICS_TERMS",
    "Aperture",
    "OpticalImage",
    "OpticsOptions",
    "OpticsTerm",
    "PointImage",
    "PointSpread",
    "PointSpreadFilter",
    "Wavefront",
    "airy_radius_m",
    "aperture_mask",
    "channels_suffice",
    "circle_of_confusion_px",
    "compute_irradiance",
    "cos_fourth",
    "cutoff_cycles_per_m",
    "defocus",
    "defocus_coefficient_m",
    "defocus_dioptres",
    "defocus_layers",
    "diffract_band",
    "diffraction_otf",
    "disc_falloff",
    "flare_point_image",
    "form_channel_image",
    "gaussian_psf",
    "nyquist_contrast_loss",
    "on_axis_factor_sr",
    "pillbox_psf",
    "projected_solid_angle_sr",
    "read_psf",
    "relative_illumination",
    "strehl_ratio",
    "wavefront_point_image",
    "working_f_number",
    "write_psf",
    "zernike",
    "zernike_order",
]
