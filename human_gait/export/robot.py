"""The body as URDF for programs of others: physics engines, kinematics libraries, parsers.

The package's own URDF (`urdf.urdf_text`) marks every DH frame by a massless link: libraries that
follow the first child end there. The file for others has no marks, its links are completed
(`robot_links`), and its limits are those of the scenario.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET

from human_gait.body.person import Body, make_body
from human_gait.body.urdf import JOINT_NAMES, numbers
from human_gait.export.notes import Note
from human_gait.export.ranges import JointRanges, joint_ranges
from human_gait.export.robot_links import BEAD_MASS, complete_links
from human_gait.scenario import Ground, Scenario, Subject

_WORDS = (
    "axes: x left, y up, z forward; gravity is no part of URDF: (0, -9.81, 0) m/s^2 here",
    f"links between two segments have {BEAD_MASS:g} kg each, taken from the segment behind them",
    "two specks in each segment span the box of its inertia, for engines that take it from there",
)


def robot_text(
    body: Body, ranges: JointRanges, friction: float = Ground.friction, note: Note | None = None
) -> str:
    """Return the URDF of a body for other programs.

    Parameters
    ----------
    body : Body
    ranges : JointRanges
        What stands in the limits of the joints.
    friction : float
        Coefficient between sole and floor.
    note : Note, optional
        What the file is made from.
    """
    robot = ET.fromstring(body.urdf)
    robot.set("xmlns:drake", "http://drake.mit.edu")
    robot.insert(
        0, ET.Comment((note or Note()).xml([*_WORDS, *ranges.of_position, *ranges.of_drive]))
    )
    _remove_marks(robot)
    complete_links(robot, body, friction)
    joints = {str(joint.get("name")): joint for joint in robot.iter("joint")}
    for i, name in enumerate(JOINT_NAMES):
        for limit in joints[name].iter("limit"):
            limit.attrib.update(_limits(ranges, i))
    ET.indent(robot)
    return ET.tostring(robot, encoding="unicode") + "\n"


def scenario_robot(scenario: Scenario | None = None) -> str:
    """Return the URDF of a scenario's body, with its limits; else of the median man's.

    Raises
    ------
    ScenarioError
        If the limits name what is no joint, or leave none a range.
    """
    if scenario is None:
        subject = Subject.default()
        return robot_text(make_body(subject), joint_ranges(subject))
    body = make_body(scenario.subject, scenario.load)
    ranges = joint_ranges(scenario.subject, scenario)
    return robot_text(body, ranges, scenario.ground.friction, Note(scenario))


def _limits(ranges: JointRanges, i: int) -> dict[str, str]:
    names = ("lower", "upper", "effort", "velocity")
    return {name: numbers([getattr(ranges, name)[i]]) for name in names}


def _remove_marks(robot: ET.Element) -> None:
    """Remove the massless fixed links of the DH frames, and their joints."""
    for element in list(robot):
        if str(element.get("name")).removeprefix("fixed_").startswith("dh_"):
            robot.remove(element)
