"""Version 1 of the documents."""
