"""The walk as an optimisation problem: objective, constraints, control points."""
