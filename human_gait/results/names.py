"""The names of all files of a result.

A new prediction removes these, and no others, with the result that it replaces: whoever writes a
file into the folder of a result takes its name from here.
"""

from collections.abc import Iterable

GAIT_FILE = "gait.npz"
GAIT_CYCLE = "gait_cycle.csv"
SUMMARY = "summary.json"
EXPLANATION = "explanation.json"
VERIFICATION = "verification.json"
MULTIPLIERS = "multipliers.npz"
PLAYBACK = "playback.html"
REPORT = "report.html"
FILM = "walk.gif"
FILMS = (FILM, "walk.mp4", "walk.png")
"""What the film command writes, unless told otherwise, or told to by these names."""

COMPARISON_JSON, COMPARISON_CSV, COMPARISON_PNG = "compare.json", "compare.csv", "compare.png"
COMPARISON = (COMPARISON_JSON, COMPARISON_CSV, COMPARISON_PNG)
"""What the comparison with people writes."""

STUDY, INDEX, CYCLES, WALKS = "study.toml", "index.parquet", "cycles.parquet", "walks"
"""In the folder of a study: what was asked, a row a walk, their curves, and a file of each."""

PLOTS = (
    *("stick_diagram.png", "joint_torques.png", "joint_angles.png"),
    *("ground_reaction.png", "zmp.png"),
)
PREDICTED = (GAIT_FILE, GAIT_CYCLE, SUMMARY, EXPLANATION, MULTIPLIERS, PLAYBACK, *PLOTS)
"""What a prediction writes into its folder."""

AGREEMENT = "agreement.json"
"""How far the results of several solvers differ; beside their folders."""

EXPORT = "export"
"""Folder of the exports of a result, in its own."""

OPENSIM_MODEL = "model.osim"
OPENSIM_COORDINATES = "coordinates.mot"
OPENSIM_FORCES = "ground_reaction.mot"
OPENSIM_LOADS = "external_loads.xml"
OPENSIM_TORQUES = "joint_torques.sto"
MARKERS_TRC, MARKERS_C3D = "markers.trc", "markers.c3d"
ANIMATION = "motion.bvh"
ANGLES_TABLE, TORQUES_TABLE = "joint_angles.csv", "joint_torques.csv"
FORCES_TABLE = "ground_reaction.csv"
ROBOT = "human.urdf"
TRAJECTORY_CSV, TRAJECTORY_JSON = "joint_trajectory.csv", "joint_trajectory.json"
TRAJECTORY_CONTROLLER = "joint_trajectory_controller.yaml"
MADE_FROM = "made_from.json"
"""What the exports were made from."""

EXPORTED = (
    *(OPENSIM_MODEL, OPENSIM_COORDINATES, OPENSIM_FORCES, OPENSIM_LOADS, OPENSIM_TORQUES),
    *(MARKERS_TRC, MARKERS_C3D, ANIMATION, ANGLES_TABLE, TORQUES_TABLE, FORCES_TABLE),
    *(ROBOT, TRAJECTORY_CSV, TRAJECTORY_JSON, TRAJECTORY_CONTROLLER, MADE_FROM),
)
"""All files in the folder of the exports."""

_OF_ONE_SOLVER = (
    *(GAIT_FILE, GAIT_CYCLE, SUMMARY, EXPLANATION, VERIFICATION, MULTIPLIERS, PLAYBACK, REPORT),
    *(*FILMS, *COMPARISON, *PLOTS, *(f"{EXPORT}/{name}" for name in EXPORTED)),
)


def result_files(solvers: Iterable[str]) -> tuple[str, ...]:
    """Return all that a prediction, or a command about it, writes, as paths in its folder.

    Parameters
    ----------
    solvers : iterable of str
        Of which a result may have a folder each.
    """
    inner = [f"{solver}/{name}" for solver in solvers for name in _OF_ONE_SOLVER]
    return *_OF_ONE_SOLVER, AGREEMENT, *inner
