"""Benchmarks: scenes, engines to compare, error measures and references. Development tools, no part of the distribution."""
