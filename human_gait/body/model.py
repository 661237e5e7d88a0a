"""The body as a Pinocchio model, its order of DOF asserted and the points of the feet named."""

import numpy as np
import pinocchio as pin

from human_gait.body import skeleton
from human_gait.body.dh import link_to_dh
from human_gait.body.links import GRAVITY, Links
from human_gait.body.urdf import JOINT_NAMES
from human_gait.exceptions import ModelError


def build_model(urdf: str, links: Links) -> pin.Model:
    """Return the Pinocchio model of a body: nq = nv = 55 in the paper's order, gravity along -y.

    The contact points are frames named ``heel_r``, ``ball_medial_r``, ..., ``toe_l``, each in the
    axes of its URDF link.

    Parameters
    ----------
    urdf : str
        The text that `urdf_text` makes of the links.
    links : Links

    Raises
    ------
    ModelError
        If Pinocchio numbers the joints in another order.
    """
    model = pin.buildModelFromXML(urdf)
    _check_order(model)
    model.gravity.linear = GRAVITY
    _add_contact_frames(model, links)
    return model


def _check_order(model: pin.Model) -> None:
    names = tuple(model.names)[1:]
    in_order = [model.joints[j].idx_v for j in range(1, model.njoints)] == list(
        range(skeleton.N_DOF)
    )
    if names != JOINT_NAMES or not in_order:
        raise ModelError(f"Pinocchio numbers the joints {names}, expected {JOINT_NAMES}")


def _add_contact_frames(model: pin.Model, links: Links) -> None:
    to_dh = link_to_dh(links.table)
    for side, on, points in zip(
        skeleton.SIDES, links.contact.links, links.contact.points, strict=True
    ):
        for name, i, point in zip(links.contact.names, on, points, strict=True):
            position = to_dh[i, :3, :3] @ point + to_dh[i, :3, 3]
            joint = int(i) + 1
            placement = pin.SE3(np.eye(3), position)
            model.addFrame(pin.Frame(f"{name}_{side}", joint, placement, pin.FrameType.OP_FRAME))
