"""Quantities are read as people write them, without rounding twice, and never as something else."""

import re
import string

import pytest
from hypothesis import given
from hypothesis import strategies as st

from human_gait.scenario.units import DIMENSIONS, QuantityError, in_unit, quantity_pattern

UNITS = [(unit, name) for unit, dimension in DIMENSIONS.items() for name in dimension.units]
INCH, POUND, MILE = 0.0254, 0.45359237, 1609.344  # [m], [kg], [m]: exact by definition


@pytest.mark.parametrize(
    ("written", "unit", "value"),
    [
        ("180 cm", "m", 1.8),
        ("1.8m", "m", 1.8),
        ("5 ft 9 in", "m", 69 * INCH),
        ("5 ft 9", "m", 69 * INCH),
        ("5'9\"", "m", 69 * INCH),
        ("5'9", "m", 69 * INCH),
        ("5\u20329\u2033", "m", 69 * INCH),
        ("5\u20199\u201d", "m", 69 * INCH),
        ("6'", "m", 72 * INCH),
        ("-2 in", "m", -2 * INCH),
        ("\u22122 in", "m", -2 * INCH),
        ("-1 ft 2 in", "m", -14 * INCH),
        ("60 kg", "kg", 60.0),
        ("40 lb", "kg", 40 * POUND),
        ("40 LBS", "kg", 40 * POUND),
        ("9 st 2 lb", "kg", 128 * POUND),
        ("9st 2", "kg", 128 * POUND),
        ("16 oz", "kg", POUND),
        ("4 km/h", "m/s", 4 / 3.6),
        ("2.5 mph", "m/s", 2.5 * MILE / 3600),
        ("72 m/min", "m/s", 1.2),
        ("-10 deg", "deg", -10.0),
        ("10\u00b0", "deg", 10.0),
        ("0.1 rad", "deg", 18 / 3.141592653589793),
        ("180 deg^2", "rad^2", 180 * (3.141592653589793 / 180) ** 2),
        ("15 %", "of the step", 0.15),
        ("1e-3 m", "m", 0.001),
    ],
)
def test_what_people_write_is_understood(written, unit, value):
    assert in_unit(written, unit) == pytest.approx(value, rel=1e-15)


@given(st.sampled_from(UNITS), st.decimals(0, 999, places=3), st.booleans(), st.sampled_from("+- "))
def test_any_number_of_any_unit_is_its_factor_times_that_number(unit, number, capital, sign):
    unit, name = unit
    written = f"{sign}{number} {name.upper() if capital else name}"
    expected = float(DIMENSIONS[unit].units[name]) * float(number) * (-1 if sign == "-" else 1)
    assert in_unit(written, unit) == pytest.approx(expected, rel=1e-15)


@given(st.decimals(0, 99, places=2))
def test_decimal_units_give_the_very_number_of_the_setting(number):
    assert in_unit(f"{number * 100} cm", "m") == float(number)
    assert in_unit(f"{number} m", "m") == float(number)


@pytest.mark.parametrize("unit", DIMENSIONS)
def test_a_quantity_of_another_kind_is_told_what_it_is_and_what_is_wanted(unit):
    wanted = DIMENSIONS[unit]
    for other in DIMENSIONS.values():
        if other is not wanted:
            with pytest.raises(QuantityError) as caught:
                in_unit(other.example.strip('"'), unit)
            message = str(caught.value)
            assert message.startswith(f"is {other.noun}, {wanted.noun} is wanted")
            assert wanted.example in message


def test_every_example_is_one_of_its_own_kind():
    for unit, dimension in DIMENSIONS.items():
        assert in_unit(dimension.example.strip('"'), unit) > 0.0


def test_no_name_belongs_to_two_kinds():
    distinct = {id(dimension): dimension for dimension in DIMENSIONS.values()}.values()
    names = [name for dimension in distinct for name in dimension.units]
    assert len(names) == len(set(names))
    assert names == [name.lower() for name in names]


@pytest.mark.parametrize(
    ("written", "parts"),
    [
        ("40 lbz", ["unknown unit", "lbz", "did you mean lb?"]),
        ("40 parsec", ["unknown unit", "parsec", "kg, g, lb"]),
    ],
)
def test_an_unknown_unit_is_told_with_the_nearest_or_the_known(written, parts):
    with pytest.raises(QuantityError) as caught:
        in_unit(written, "kg")
    assert [part for part in parts if part not in str(caught.value)] == []


@pytest.mark.parametrize(
    "written",
    ["", " ", "3", "-3", "lb", "nan kg", "inf kg", "3 4 kg", "1,5 kg", "--3 kg", "1e999999999 kg"],
)
def test_what_is_no_quantity_is_refused_as_none(written):
    with pytest.raises(ValueError, match=r"^$"):
        in_unit(written, "kg")


def read(written, unit):
    try:
        return in_unit(written, unit)
    except ValueError:
        return None


SIGNS = st.text(string.digits + string.ascii_letters + " .+-'\"/%^\u00b2\u00b0\u2032\u2212\n\u212a")


@given(st.sampled_from(sorted(DIMENSIONS)), st.data())
def test_the_pattern_for_editors_takes_what_is_read_and_nothing_else(unit, data):
    pattern = quantity_pattern(unit)
    like = st.from_regex(pattern.replace("^", "", 1), fullmatch=True)
    written = data.draw(SIGNS | like | st.builds(str.__add__, like, SIGNS))
    assert (re.search(pattern, written) is None) == (read(written, unit) is None)


@pytest.mark.parametrize("unit", DIMENSIONS)
def test_the_pattern_for_editors_has_nothing_that_javascript_lacks(unit):
    assert re.findall(r"\(\?(?!:)", quantity_pattern(unit)) == []
