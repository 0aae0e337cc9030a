"""Documents to dataclasses: the one place where units, names and files of a recipe are resolved."""
