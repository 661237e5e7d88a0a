"""A constraint of one's own: a wall beside the walker that the hands must not pass.

Walls stand on both sides, since a walk is its own mirror image. Pinocchio gives the place of each
hand and its partials; second derivatives are taken as differences. All solvers honour it.

    python docs/examples/wall.py [newton|snopt|ipopt]
"""

import sys

import numpy as np
import pinocchio as pin

import human_gait as hg

SCENARIO = hg.load_scenario("preferred").replace(formulation="effort")  # its arms swing wide
WALL = 0.35  # [m] from the middle of the path; the hands of the walk as it is swing further out

model = hg.pinocchio_model(SCENARIO)
data = model.createData()
HANDS = {"right hand": ("l41_hand_r", -1.0), "left hand": ("l50_hand_l", 1.0)}  # x is to the left


def outwards(motion: hg.Motion) -> hg.Rows:
    """Return how far each hand is from the middle of the path, (K, 2) with partials by q, [m]."""
    value = np.zeros((len(motion.q), len(HANDS)))
    by_q = np.zeros((*value.shape, model.nv))
    for k, q in enumerate(motion.q):
        pin.computeJointJacobians(model, data, q)
        for row, (link, side) in enumerate(HANDS.values()):
            frame = model.getFrameId(link)
            place = pin.updateFramePlacement(model, data, frame)
            J = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
            value[k, row], by_q[k, row] = side * place.translation[0], side * J[0]
    return hg.Rows(value, by_q=by_q)


def widest(gait: hg.Gait) -> float:
    """Return how far out a hand swings, [m]."""
    t = np.linspace(0.0, gait.step_time, 60)
    motion = hg.Motion(t, gait.q(t), gait.v(t), gait.a(t), gait.muscle_torque(t))
    return float(outwards(motion).value.max())


if __name__ == "__main__":
    solver = sys.argv[1] if len(sys.argv) > 1 else "newton"
    wall = hg.PathConstraint("wall", outwards, upper=WALL, unit="m", what=list(HANDS))
    for name, constraints in (("as it is", []), (f"between walls at {WALL} m", [wall])):
        gait = hg.predict(SCENARIO, solver=solver, constraints=constraints)
        print(f"{name}: hands up to {widest(gait):.3f} m from the middle of the path")
