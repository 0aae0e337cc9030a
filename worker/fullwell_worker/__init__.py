"""The queue worker of Fullwell: takes a lease on a frame, runs it, records how it ended."""

__all__: list[str] = []
