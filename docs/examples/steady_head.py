"""A cost of one's own: people keep their heads steady.

The integral of the squared acceleration of the head is added to the objective. Pinocchio gives the
acceleration of its centre of mass and the partials; second derivatives are those of Gauss and
Newton. All solvers honour it.

    python docs/examples/steady_head.py [newton|snopt|ipopt]
"""

import sys

import numpy as np
import pinocchio as pin

import human_gait as hg

# the formulation `human` has a cost of a steady head already
SCENARIO = hg.load_scenario("preferred").replace(formulation="effort")
WORLD = pin.LOCAL_WORLD_ALIGNED
WEIGHT = 30.0  # [N^2 m^2 per (m/s^2)^2]

model = hg.pinocchio_model(SCENARIO)
head = model.frames[model.getFrameId("l55_head")].parentJoint
centre = pin.SE3(np.eye(3), model.inertias[head].lever)
frame = model.addFrame(pin.Frame("centre of the head", head, centre, pin.FrameType.OP_FRAME))
data = model.createData()


def acceleration(motion: hg.Motion) -> hg.Rows:
    """Return the acceleration of the head (K, 3) with its partials, [m/s^2]."""
    value, by_q, by_v, by_a = [], [], [], []
    for q, v, a in zip(motion.q, motion.v, motion.a, strict=True):
        pin.computeForwardKinematicsDerivatives(model, data, q, v, a)
        found = pin.getFrameClassicalAcceleration(model, data, frame, WORLD)
        partials = pin.getPointClassicAccelerationDerivatives(model, data, head, centre, WORLD)
        _, dq, dv, da = partials
        value.append(found.linear)
        for rows, partial in ((by_q, dq), (by_v, dv), (by_a, da)):
            rows.append(partial)
    return hg.Rows(np.array(value), np.array(by_q), np.array(by_v), np.array(by_a))


def roughness(gait: hg.Gait) -> float:
    """Return the root mean square acceleration of the head over a step, [m/s^2]."""
    t = np.linspace(0.0, gait.step_time, 60, endpoint=False)
    motion = hg.Motion(t, gait.q(t), gait.v(t), gait.a(t), gait.muscle_torque(t))
    return float(np.sqrt(np.mean(np.sum(acceleration(motion).value ** 2, axis=1))))


if __name__ == "__main__":
    solver = sys.argv[1] if len(sys.argv) > 1 else "newton"
    steady = hg.RunningCost("head acceleration", acceleration, weight=WEIGHT)
    for name, costs in (("as it is", []), ("with a steady head", [steady])):
        gait = hg.predict(SCENARIO, solver=solver, costs=costs)
        print(f"{name}: {roughness(gait):.2f} m/s^2 (root mean square)")
