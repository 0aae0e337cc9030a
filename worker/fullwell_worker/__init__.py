"""The queue worker of Fullwell."""
