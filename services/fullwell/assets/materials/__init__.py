"""Spectral materials of assets: the catalogue, and the rules that choose from it."""
