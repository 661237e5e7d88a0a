"""Measured trials: read from the files of laboratories, named and cut into gait cycles."""
