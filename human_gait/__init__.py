"""Optimization-based prediction of human walking."""
