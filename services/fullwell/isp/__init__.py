"""From raw digital numbers to a picture: one module per step, `model` holds their order."""

from fullwell.isp.calibration import ColourCalibration, calibrate
from fullwell.isp.model import DisplayImage, develop
from fullwell.isp.parameters import ColourMatrixFit, IspSettings, ToneCurve
from fullwell.isp.scene_light import scene_illuminant

__all__ = [
    "ColourCalibration",
    "ColourMatrixFit",
    "DisplayImage",
    "IspSettings",
    "ToneCurve",
    "calibrate",
    "develop",
    "scene_illuminant",
]
