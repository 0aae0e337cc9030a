"""From raw digital numbers to a picture: one module per step, `model` holds their order."""

from fullwell.isp.model import DisplayImage, develop
from fullwell.isp.parameters import IspSettings

__all__ = ["DisplayImage", "IspSettings", "develop"]
