"""What images are worth: edge response, photon transfer, noise, colour difference, exposure, falloff.

Functions follow the definitions; `fullwell.metrics.isetcam` holds ISETCam's versions where they differ.
"""

from fullwell.metrics.colour_difference import delta_e_1976, delta_e_1994, delta_e_2000, xyz_to_lab
from fullwell.metrics.edge_sfr import EdgeResponse, Window, edge_sfr, mosaic_edge_sfr
from fullwell.metrics.exposure import exposure_value, exposure_value_at_iso_100, photometric_exposure_lux_s
from fullwell.metrics.levels import ChannelLevels, PixelRegion, channel_levels, channel_mask
from fullwell.metrics.patches import patch_means
from fullwell.metrics.photon_transfer import ExposedStack, PhotonTransfer, TransferPoint, photon_transfer
from fullwell.metrics.relative_illumination import RelativeIllumination, relative_illumination
from fullwell.metrics.scielab import s_cielab, s_cielab_difference, samples_per_degree, visual_snr
from fullwell.metrics.signal_to_noise import SensorFigures, decibels, sensor_figures, snr_ratio, stops

__all__ = [
    "ChannelLevels",
    "EdgeResponse",
    "ExposedStack",
    "PhotonTransfer",
    "PixelRegion",
    "RelativeIllumination",
    "SensorFigures",
    "TransferPoint",
    "Window",
    "channel_levels",
    "channel_mask",
    "decibels",
    "delta_e_1976",
    "delta_e_1994",
    "delta_e_2000",
    "edge_sfr",
    "exposure_value",
    "exposure_value_at_iso_100",
    "mosaic_edge_sfr",
    "patch_means",
    "photometric_exposure_lux_s",
    "photon_transfer",
    "relative_illumination",
    "s_cielab",
    "s_cielab_difference",
    "samples_per_degree",
    "sensor_figures",
    "snr_ratio",
    "stops",
    "visual_snr",
    "xyz_to_lab",
]
