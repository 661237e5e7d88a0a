import re
from pathlib import Path

import numpy as np

from human_gait.export.robot import scenario_robot

COMMITTED = Path(__file__).parents[1] / "urdf" / "human.urdf"
NUMBER = re.compile(r"-?\d+\.\d+(?:e-?\d+)?")


def test_the_committed_urdf_is_what_the_code_writes():
    """Same text; numbers may differ in the last digits where another machine rounds otherwise."""
    committed, fresh = COMMITTED.read_text(), scenario_robot()
    assert NUMBER.sub("#", committed) == NUMBER.sub("#", fresh), "run `make urdf`"
    numbers = [np.array(NUMBER.findall(text), dtype=float) for text in (committed, fresh)]
    np.testing.assert_allclose(*numbers, rtol=1e-13, atol=1e-15, err_msg="run `make urdf`")
