"""Independent checks of a gait, from its file alone."""
