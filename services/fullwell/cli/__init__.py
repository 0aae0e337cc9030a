"""The `fullwell` command line. Each command lives in a module of its own; `main` puts them together."""

__all__: list[str] = []
