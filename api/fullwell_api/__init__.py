"""The HTTP API of Fullwell."""
