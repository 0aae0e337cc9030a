"""Fullwell: scene recipes become labelled, physically exact camera data."""

__all__ = ["__version__"]

__version__ = "0.1.0"
