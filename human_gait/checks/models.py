"""The body as a model of Pinocchio or Drake, for who wants to go on with these."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from human_gait.body.person import Body, make_body
from human_gait.checks import engines
from human_gait.scenario import Scenario, Subject, scenario_of
from human_gait.walk.gait import Gait

if TYPE_CHECKING:
    import pinocchio as pin
    from pydrake.multibody.plant import MultibodyPlant

Walker = Body | Gait | Scenario | Subject | str | Path


def pinocchio_model(who: Walker) -> pin.Model:
    """Return the Pinocchio model of a body with its load.

    Parameters
    ----------
    who : Body, Gait, Scenario, Subject, str or Path
        A path is that of a scenario file, or the name of a scenario that comes with the package. A
        subject carries nothing.

    Returns
    -------
    pinocchio.Model
        nq = nv = 55 in the order of `Gait.joint_names`, so that ``gait.q(t)``, ``v`` and ``a`` are
        its configuration, velocity and acceleration [rad], [m]. y is up, gravity 9.81 m/s^2. The
        contact points of the feet are frames ``heel_r``, ``ball_medial_r``, ..., ``toe_l``. It is
        the caller's own.

    Raises
    ------
    ScenarioError
        If a scenario file cannot be read or used.
    """
    return _body(who).pinocchio_model()


def drake_plant(who: Walker) -> MultibodyPlant:
    """Return the MultibodyPlant of a body with its load, finalized.

    Parameters
    ----------
    who : Body, Gait, Scenario, Subject, str or Path
        A path is that of a scenario file, or the name of a scenario that comes with the package. A
        subject carries nothing.

    Returns
    -------
    pydrake.multibody.plant.MultibodyPlant
        Continuous, with 55 positions and velocities in the order of `Gait.joint_names`, so that
        ``plant.SetPositions(context, gait.q(t))`` poses it [rad], [m]. y is up, gravity 9.81 m/s^2.

    Raises
    ------
    ScenarioError
        If a scenario file cannot be read or used.
    """
    return engines.drake_plant(_body(who))


def _body(who: Walker) -> Body:
    if isinstance(who, Body):
        return who
    if isinstance(who, Gait):
        return who.body
    if isinstance(who, Subject):
        return make_body(who)
    task = scenario_of(who)
    return make_body(task.subject, task.load)
