"""The body as a Pinocchio model, its order of DOF asserted and the points of the feet named."""

import numpy as np
import pinocchio as pin

from human_gait.body import skeleton
from human_gait.body.dh import link_to_dh
from human_gait.body.links import GRAVITY, SIDES, Body
from human_gait.body.urdf import JOINT_NAMES, urdf_text
from human_gait.exceptions import ModelError


def build_model(body: Body) -> pin.Model:
    """Return the Pinocchio model of a body: nq = nv = 55 in the paper's order, gravity along -y.

    The contact points are frames named ``heel_r``, ``ball_medial_r``, ..., ``toe_l``, each in the
    axes of its URDF link.

    Raises
    ------
    ModelError
        If Pinocchio numbers the joints in another order.
    """
    model = pin.buildModelFromXML(urdf_text(body))
    _check_order(model)
    model.gravity.linear = GRAVITY
    _add_contact_frames(model, body)
    return model


def _check_order(model: pin.Model) -> None:
    names = tuple(model.names)[1:]
    in_order = [model.joints[j].idx_v for j in range(1, model.njoints)] == list(
        range(skeleton.N_DOF)
    )
    if names != JOINT_NAMES or not in_order:
        raise ModelError(f"Pinocchio numbers the joints {names}, expected {JOINT_NAMES}")


def _add_contact_frames(model: pin.Model, body: Body) -> None:
    to_dh = link_to_dh(body.table)
    for side, links, points in zip(SIDES, body.contact.links, body.contact.points, strict=True):
        for name, i, point in zip(body.contact.names, links, points, strict=True):
            position = to_dh[i, :3, :3] @ point + to_dh[i, :3, 3]
            joint = int(i) + 1
            placement = pin.SE3(np.eye(3), position)
            model.addFrame(pin.Frame(f"{name}_{side}", joint, placement, pin.FrameType.OP_FRAME))
