"""Measured gait, and how close a walk comes to it."""
