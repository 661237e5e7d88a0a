"""Values that hold arrays: comparison, hash, copies and pickles."""

import copy
import dataclasses
import importlib
import pickle
import pkgutil
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import pytest

from human_gait.arrays import FloatArray
from human_gait.values import Value


@dataclass(frozen=True, eq=False)
class Sole(Value):
    points: FloatArray
    name: str = "right"
    notes: Mapping[str, object] = field(default_factory=dict)
    parts: tuple[object, ...] = ()

    @cached_property
    def large(self) -> FloatArray:
        return np.zeros(100_000)


@dataclass(frozen=True, eq=False)
class Shoe(Sole):
    pass


def test_equal_values_are_equal_and_have_one_hash():
    one, other = (Sole(np.arange(3.0), notes={"a": np.ones(2)}) for _ in range(2))
    assert one == other
    assert hash(one) == hash(other)
    assert len({one, other}) == 1


@pytest.mark.parametrize(
    "change",
    [
        {"points": np.array([0.0, 1.0, 2.5])},
        {"points": np.arange(4.0)},
        {"points": np.arange(3.0)[:, None]},
        {"name": "left"},
        {"notes": {"a": np.zeros(2)}},
        {"notes": {"b": np.ones(2)}},
        {"parts": (np.zeros(1),)},
        {"parts": [np.ones(1)]},
    ],
)
def test_a_change_in_any_field_makes_another_value(change):
    one = Sole(np.arange(3.0), notes={"a": np.ones(2)}, parts=(np.ones(1),))
    assert one != replace(one, **change)
    assert replace(one, **change) != one


def test_values_of_other_classes_differ():
    assert Sole(np.zeros(2)) != Shoe(np.zeros(2))
    assert Sole(np.zeros(2)) != "sole"


def test_values_inside_values_are_compared_too():
    inner = Sole(np.zeros(2))
    assert Sole(np.zeros(2), parts=(inner,)) == Sole(np.zeros(2), parts=(Sole(np.zeros(2)),))
    assert Sole(np.zeros(2), parts=(inner,)) != Sole(np.zeros(2), parts=(Sole(np.ones(2)),))


def test_nan_is_equal_to_itself():
    one, other = (Sole(np.array([np.nan]), notes={"cost": float("nan")}) for _ in range(2))
    assert one == other
    assert hash(one) == hash(other)
    assert one != Sole(np.array([np.nan]), notes={"cost": 1.0})


def test_zeros_of_either_sign_and_numbers_of_any_type_are_equal_with_one_hash():
    one, other = Sole(np.array([0.0]), notes={"n": 1}), Sole(np.array([-0.0]), notes={"n": 1.0})
    assert one == other
    assert hash(one) == hash(other)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ([0.0, 1.0], np.array([0.0, 1.0])),
        ((0.0, 1.0), np.array([0.0, 1.0])),
        (0.0, np.array(0.0)),
        (0.0, np.float64(0.0)),
        (np.array([1]), np.array([1.0])),
        ([0.0], (0.0,)),
        ({"a": [1.0]}, {"a": np.ones(1)}),
        (Sole([1.0]), Sole(np.ones(1))),
    ],
)
def test_what_is_equal_has_one_hash_whatever_it_is_held_in(one, other):
    """Either they differ, both ways round, or a set takes them for one."""
    one, other = Sole(one), Sole(other)
    assert (one == other) == (other == one)
    assert len({one, other}) == (1 if one == other else 2)
    if one == other:
        assert hash(one) == hash(other)


def test_an_array_is_equal_to_arrays_only():
    for other in ([0.0, 1.0], (0.0, 1.0)):
        assert Sole(np.array([0.0, 1.0])) != Sole(other)
        assert Sole(other) != Sole(np.array([0.0, 1.0]))
    assert Sole(np.array(0.0)) != Sole(0.0)


@pytest.mark.parametrize(
    "copied", [copy.copy, copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))]
)
def test_copies_are_equal_and_without_caches(copied):
    sole = Sole(np.arange(3.0))
    assert len(sole.large)
    again = copied(sole)
    assert again == sole
    assert "large" in vars(sole)
    assert "large" not in vars(again)
    assert len(pickle.dumps(sole)) < 1000


WINGS = ("body", "dynamics", "walk", "checks", "export")
NOT_COMPARED = {  # made for one use
    *("Instants", "SecondDerivatives", "Adjoint", "Lean", "UnitPair", "Depths"),
    *("TreeMotion", "PassiveTorque", "Torques", "MusclePartials"),
    *("_Mass", "_Plate"),
}


def classes_of(wing):
    package = importlib.import_module(f"human_gait.{wing}")
    for found in pkgutil.iter_modules(package.__path__):
        module = importlib.import_module(f"{package.__name__}.{found.name}")
        for item in vars(module).values():
            if dataclasses.is_dataclass(item) and item.__module__ == module.__name__:
                yield item


@pytest.mark.parametrize("wing", WINGS)
def test_every_dataclass_with_arrays_is_a_value(wing):
    """One that `dataclass` gives a comparison raises where numpy cannot say yes or no."""
    with_arrays = [
        item
        for item in classes_of(wing)
        if any("Array" in str(field.type) for field in dataclasses.fields(item))
    ]
    assert with_arrays
    not_values = [
        item.__name__
        for item in with_arrays
        if not issubclass(item, Value) or item.__eq__ is not Value.__eq__
    ]
    assert set(not_values) <= NOT_COMPARED
