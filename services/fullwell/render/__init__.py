"""The renderer behind one door: light through a camera, and surface queries. Importing this package does not load Mitsuba."""

from fullwell.render.adaptive import NoiseTarget, SamplingGoal, tile_errors
from fullwell.render.exposure_moments import MotionRequest, count_moments
from fullwell.render.light import LightRequest, RenderedLight, RenderStatistics, render_light
from fullwell.render.radiance import render_radiance
from fullwell.render.surfaces import query_depth, query_surfaces
from fullwell.render.transport.progressive import REPLICAS
from fullwell.render.variant import VariantChoice, activate, choose_variant

__all__ = [
    "REPLICAS",
    "LightRequest",
    "MotionRequest",
    "NoiseTarget",
    "RenderStatistics",
    "RenderedLight",
    "SamplingGoal",
    "VariantChoice",
    "activate",
    "choose_variant",
    "count_moments",
    "query_depth",
    "query_surfaces",
    "render_light",
    "render_radiance",
    "tile_errors",
]
