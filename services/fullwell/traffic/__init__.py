"""Road networks, SUMO runs and street objects. Nothing is in it yet: traffic recipes are not read by this version."""

__all__: list[str] = []
