"""The starter library: assets that this project's own parametric generators make."""
