"""The HTTP API of Fullwell."""

from fullwell_api.app import create_app

__all__ = ["create_app"]
