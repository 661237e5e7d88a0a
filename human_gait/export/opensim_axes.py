"""From the axes here (x left, y up, z forward) to those of OpenSim (x forward, y up, z right).

A turn by a right angle about the vertical: x' = z, y' = y, z' = -x. It holds for every vector and
for the axes of segments, of forces and of markers, in all files for OpenSim and in TRC and C3D.
"""

import numpy as np
import numpy.typing as npt

from human_gait.arrays import FloatArray

TURN: FloatArray = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
"""(3, 3) rotation from the axes here to those of OpenSim."""

AXES = {"forward": "+X", "up": "+Y", "right": "+Z"}
"""Where OpenSim's axes point."""


def to_opensim(vectors: npt.ArrayLike) -> FloatArray:
    """Return vectors (..., 3) in the axes of OpenSim."""
    return np.asarray(vectors, dtype=np.float64) @ TURN.T + 0.0  # no -0


def tensor_to_opensim(tensor: FloatArray) -> FloatArray:
    """Return a tensor of inertia (3, 3) in the axes of OpenSim."""
    return TURN @ tensor @ TURN.T + 0.0
