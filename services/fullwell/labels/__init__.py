"""Masks, boxes, depth and visibility, through the same camera as the image."""

from fullwell.labels.document import labels_document
from fullwell.labels.driving import driving_document
from fullwell.labels.flow import optical_flow
from fullwell.labels.make import make_labels
from fullwell.labels.model import Box3D, Labels, ObjectLabel

__all__ = ["Box3D", "Labels", "ObjectLabel", "driving_document", "labels_document", "make_labels", "optical_flow"]
