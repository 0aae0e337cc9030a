"""The curation page: look at assets, decide about them, import more."""

from fullwell_api.web.curation.mounting import mount_curation

__all__ = ["mount_curation"]
