"""Products as bytes (`encode`), and the picture of all products of a frame (`contact`)."""
