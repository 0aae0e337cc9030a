"""Mitsuba behind one door: radiance images and surface queries. Importing this package does not load the renderer."""

from fullwell.render.radiance import RenderStatistics, render_radiance
from fullwell.render.surfaces import query_surfaces
from fullwell.render.variant import VariantChoice, activate, choose_variant

__all__ = ["RenderStatistics", "VariantChoice", "activate", "choose_variant", "query_surfaces", "render_radiance"]
