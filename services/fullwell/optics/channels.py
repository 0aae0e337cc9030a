"""The optics stage for light that channels have counted already: one picture a channel instead of one a band."""

from __future__ import annotations

import numpy as np

from fullwell.core.errors import FieldError
from fullwell.optics.blur import Blur, DiffractionBlur, NoBlur
from fullwell.optics.camera_equation import projected_solid_angle_sr, working_f_number
from fullwell.optics.parameters import OpticsOptions
from fullwell.optics.relative_illumination import relative_illumination
from fullwell.radiometry.images import ChannelRadiance
from fullwell.scene.camera import Lens
from fullwell.scene.images import ChannelImage

__all__ = ["channels_suffice", "form_channel_image"]


def channels_suffice(options: OpticsOptions) -> bool:
    """Return whether the lens treats wavelengths alike but for diffraction, where a channel's mean one stands for all."""
    return all(part is None for part in (options.psf, options.wavefront, options.aperture, options.depth_z_m))


def form_channel_image(light: ChannelRadiance, lens: Lens, options: OpticsOptions, *, workers: int = 1) -> ChannelImage:
    """Return the image on the sensor plane: camera equation, relative illumination, diffraction.

    The light holds the lens's transmittance already. Each part of a channel is diffracted at its mean wavelength; to first
    order in the spread of its wavelengths that is exact, because the loss of contrast is proportional to the wavelength.

    Raises
    ------
    FieldError
        NaN, Inf or negative light; a lens with effects that need the spectrum (see `channels_suffice`).
    """
    if not channels_suffice(options):
        raise FieldError("the lens's point image depends on the wavelength; render spectral bands.", path="optics")
    low, high = float(np.min(light.electrons)), float(np.max(light.electrons))
    if not (low >= 0 and high < np.inf):
        raise FieldError(
            f"the channels' light ranges from {low} to {high}; must be finite and >= 0. Look for the fault in the rendering "
            "stage.",
            path="electrons",
            value=low,
        )
    _, rows, cols = light.electrons.shape
    pitch_m = light.tangent_pitch * lens.image_distance_m
    falloff = relative_illumination(rows=rows, cols=cols, tangent_pitch=light.tangent_pitch, lens=lens)
    factor = projected_solid_angle_sr(lens.f_number, lens.magnification) * falloff
    planes = light.electrons * factor
    blur: Blur = NoBlur("diffraction: switched off in the lens.")
    if lens.diffraction:
        texture = np.moveaxis(light.electrons, 0, -1)
        f_number = working_f_number(lens.f_number, lens.magnification)
        blur = DiffractionBlur(texture, f_number=f_number, pitch_m=pitch_m, workers=workers)
    electrons = np.zeros((int(light.channel.max()) + 1, rows, cols))
    for plane, wavelength_nm, channel in zip(planes, light.wavelength_nm, light.channel, strict=True):
        electrons[channel] += blur.apply(plane, float(wavelength_nm))
    return ChannelImage(electrons=electrons, sample_pitch_m=pitch_m, notes=blur.notes())
