from pathlib import Path

import pytest
import yourdfpy
from bodies import BODIES

from human_gait.body.model import _check_order
from human_gait.body.skeleton import DOF_NAMES
from human_gait.body.urdf import JOINT_NAMES
from human_gait.checks.engines import drake_plant
from human_gait.exceptions import ModelError


def test_joint_names_are_the_dof_names_with_the_papers_numbers():
    expected = tuple(f"j{i:02d}_{name}" for i, name in enumerate(DOF_NAMES, start=1))
    assert expected == JOINT_NAMES


@pytest.mark.parametrize("body", BODIES.values(), ids=BODIES)
def test_pinocchio_numbers_the_joints_as_the_paper(body):
    model = body.pinocchio_model()
    assert (model.nq, model.nv) == (55, 55)
    assert tuple(model.names)[1:] == JOINT_NAMES
    assert [joint.idx_q for joint in model.joints][1:] == list(range(55))
    assert [joint.idx_v for joint in model.joints][1:] == list(range(55))


@pytest.mark.parametrize("body", BODIES.values(), ids=BODIES)
def test_drake_numbers_the_joints_as_the_paper(body):
    plant = drake_plant(body)
    names = plant.GetPositionNames(add_model_instance_prefix=False)
    assert [name.rsplit("_", 1)[0] for name in names] == list(JOINT_NAMES)
    assert plant.num_velocities() == 55


def test_yourdfpy_numbers_the_joints_as_the_paper(tmp_path: Path):
    path = tmp_path / "human.urdf"
    path.write_text(BODIES["male"].urdf)
    assert tuple(yourdfpy.URDF.load(path).actuated_joint_names) == JOINT_NAMES


def test_another_order_is_refused():
    import pinocchio as pin

    with pytest.raises(ModelError, match="shoulder"):
        _check_order(pin.buildSampleModelHumanoidRandom(False))
