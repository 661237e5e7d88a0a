"""The files of an export by name: a new prediction removes these, and no others, with its folder.

Both the export and the prediction know them from here.
"""

FOLDER = "export"
"""Where the exports of a result are, in its folder."""

MODEL = "model.osim"
COORDINATES = "coordinates.mot"
FORCES = "ground_reaction.mot"
LOADS = "external_loads.xml"
TORQUES = "joint_torques.sto"
MARKERS_TRC, MARKERS_C3D = "markers.trc", "markers.c3d"
MOTION = "motion.bvh"
ANGLES_TABLE, TORQUES_TABLE = "joint_angles.csv", "joint_torques.csv"
FORCES_TABLE = "ground_reaction.csv"
ROBOT = "human.urdf"
TRAJECTORY_CSV, TRAJECTORY_JSON = "joint_trajectory.csv", "joint_trajectory.json"

FILES = (
    *(MODEL, COORDINATES, FORCES, LOADS, TORQUES, MARKERS_TRC, MARKERS_C3D, MOTION),
    *(ANGLES_TABLE, TORQUES_TABLE, FORCES_TABLE, ROBOT, TRAJECTORY_CSV, TRAJECTORY_JSON),
)
"""All of them."""
