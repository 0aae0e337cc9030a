"""Model files: reading, checking, and the models that installed packages carry."""

from fullwell.assets.meshes import MODEL_SUFFIXES, load_model
from fullwell.assets.model import LoadedModel, LoadedPart, ModelError
from fullwell.assets.packaged import SUMO_PREFIX, PackagedModel, packaged_model, packaged_model_names

__all__ = [
    "MODEL_SUFFIXES",
    "SUMO_PREFIX",
    "LoadedModel",
    "LoadedPart",
    "ModelError",
    "PackagedModel",
    "load_model",
    "packaged_model",
    "packaged_model_names",
]
