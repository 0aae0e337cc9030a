"""Routes, one module per kind of resource."""
