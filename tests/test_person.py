"""A body is made once for all who ask for it, with its URDF text and its Pinocchio model."""

import pickle
from collections import Counter
from dataclasses import fields, replace

import numpy as np
import pinocchio as pin
import pytest
from bodies import LOADED, MALE
from walks import scenario

from human_gait.body import links, model, person
from human_gait.body.person import Body, make_body
from human_gait.checks.engines import DrakeEngine, PinocchioEngine, RecursionEngine
from human_gait.dynamics.inverse_dynamics import PinocchioDynamics
from human_gait.scenario import Load, Subject
from human_gait.values import Value
from human_gait.walk.instant import Walker

UNUSUAL = {"sex": "female", "stature": 1.6123, "mass": 61.7}


@pytest.fixture
def made(monkeypatch):
    """How often bodies, texts and models are made from now on."""
    counted = Counter()

    def count(owner, name):
        make = getattr(owner, name)

        def counting(*given):
            counted[name] += 1
            return make(*given)

        monkeypatch.setattr(owner, name, counting)

    person._made.cache_clear()
    count(links, "dh_table")
    count(person, "urdf_text")
    count(pin, "buildModelFromXML")
    return counted


def test_all_who_walk_and_check_share_one_body_and_one_text(made):
    """Pinocchio reads it twice: for the walk, and for the checks, which trust nobody."""
    task = scenario(subject=UNUSUAL)
    first, second = Walker(task), Walker(task)
    assert first.body is second.body
    for engine in (PinocchioEngine, DrakeEngine, RecursionEngine):
        engine(first.body)
    assert made == {"dh_table": 1, "urdf_text": 1, "buildModelFromXML": 2}


def test_a_body_is_the_same_for_the_same_person_and_load_alone():
    her = Subject.from_table(UNUSUAL)
    assert make_body(her) is make_body(Subject.from_table(UNUSUAL), Load())
    assert make_body(her) is not make_body(her, Load(mass=1.0))
    assert make_body(her) != make_body(her, Load(mass=1.0))
    assert make_body(her) == Body.of(her, Load())


def arrays_in(value, path=""):
    if isinstance(value, np.ndarray):
        yield path, value
    elif isinstance(value, Value):
        for item in fields(value):
            yield from arrays_in(getattr(value, item.name), f"{path}.{item.name}")
    elif isinstance(value, dict):
        for name, item in value.items():
            yield from arrays_in(item, f"{path}.{name}")


def test_nobody_can_change_the_body_of_the_others():
    found = dict(arrays_in(MALE))
    assert {".mass", ".table.alpha", ".contact.points", ".measures.segments.head.com"} <= set(found)
    assert [path for path, array in found.items() if array.flags.writeable] == []


def test_who_asks_for_a_model_gets_one_of_his_own():
    mine = MALE.pinocchio_model()
    assert mine == MALE.model
    mine.gravity.linear = np.zeros(3)
    assert MALE.model.gravity.linear[1] < 0.0
    assert PinocchioDynamics(MALE).model is MALE.model


def test_the_engine_of_the_checks_has_a_model_of_its_own():
    assert PinocchioEngine(MALE)._model is not MALE.model
    assert model.build_model(MALE.urdf, MALE) == MALE.model


def test_a_pickle_holds_neither_text_nor_model():
    assert len(LOADED.urdf) > 50_000
    assert LOADED.model.nq == 55
    pickled = pickle.dumps(LOADED)
    assert len(pickled) < 40_000
    again = pickle.loads(pickled)
    assert again == LOADED
    assert {"urdf", "model"}.isdisjoint(vars(again))
    assert again.urdf == LOADED.urdf


def test_a_body_with_another_mass_is_another_body():
    heavier = replace(MALE, mass=MALE.mass * 1.01)
    assert heavier != MALE
    assert heavier.urdf != MALE.urdf
