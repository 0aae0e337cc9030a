"""Road networks, SUMO runs and street objects. Recipes do not read them yet."""

__all__: list[str] = []
