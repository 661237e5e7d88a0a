"""Columns of the index of a study: their values, and what they are called."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from human_gait.arrays import FloatArray, IntArray
from human_gait.scenario import Scenario

_SHORT = 60  # signs of a meaning that can stand on an axis
_GOES_ON = ("of ", "the same", "whether", "how ", "hip centre")  # said in addition to the name
_SUPERSCRIPTS = str.maketrans("23", "\N{SUPERSCRIPT TWO}\N{SUPERSCRIPT THREE}")
_PURE = {"coefficient", "1", "-"}  # units of numbers that have none
_PLAIN = ("walk", "subject")  # sections whose settings are known without their name


@dataclass(frozen=True, eq=False)
class Column:
    """A setting or an output of all walks.

    Attributes
    ----------
    name, meaning, unit : str
        The unit is empty for words and for pure numbers.
    setting : bool
        Whether it was asked for; else it came out.
    values : (n,) array
        NaN where there is none; of words their places in `words`.
    words : tuple of str
    label : str
        What it is called on axes and in tables.
    """

    name: str
    meaning: str
    unit: str
    setting: bool
    values: FloatArray
    words: tuple[str, ...] = ()
    label: str = ""

    def levels(self, most: int) -> FloatArray | None:
        """Return its values in order if there are at most so many, else None."""
        first = np.unique(self.values[:: max(1, len(self.values) // 2000)])
        if np.isfinite(first).sum() > most:
            return None
        found = np.unique(self.values[np.isfinite(self.values)])
        return found if len(found) <= most else None

    def varies(self) -> bool:
        """Tell whether it has more than one value."""
        some = self.values[np.isfinite(self.values)]
        return bool(len(some) and some.min() < some.max())


def encoded_words(column: Any) -> tuple[list[str], IntArray]:
    """Return the words of a column and the place of each row among them, -1 where there is none."""
    coded = column.combine_chunks().dictionary_encode()
    codes = coded.indices.fill_null(-1).to_numpy(zero_copy_only=False).astype(np.intp)
    return coded.dictionary.to_pylist(), codes


def column_of(column: Any, name: str, meaning: str, unit: str, asked: bool) -> Column | None:
    """Return a column of numbers or words; None for anything else."""
    kind = str(column.type)
    if kind in {"string", "large_string"} or kind.startswith("dictionary"):
        words, codes = encoded_words(column.cast("string"))
        order = sorted(range(len(words)), key=lambda k: words[k])
        place = np.append(np.argsort(order).astype(float), np.nan)
        return Column(name, meaning, "", asked, place[codes], tuple(words[k] for k in order))
    if kind == "bool":
        column = column.cast("int8")
    elif not kind.startswith(("double", "float", "int", "uint")):
        return None
    values = column.cast("double").to_numpy(zero_copy_only=False)
    raised = re.sub(r"(?<=[A-Za-z])\^?[23]\b", lambda power: _raised(power[0]), unit)
    shown = "" if unit in _PURE else raised
    return Column(name, meaning, shown, asked, np.where(np.isfinite(values), values, np.nan))


def _raised(power: str) -> str:
    return power.removeprefix("^").translate(_SUPERSCRIPTS)


def labelled(columns: Sequence[Column]) -> list[Column]:
    """Return columns that are called differently each: settings by name, outputs by meaning.

    What two are called alike is told in full, or by name.
    """
    labels = [_of_setting(one.name) if one.setting else _of_output(one) for one in columns]
    for longer in (_in_full, _by_name):
        alike = Counter(labels)
        labels = [
            longer(one, label) if alike[label] > 1 and not one.setting else label
            for one, label in zip(columns, labels, strict=True)
        ]
    return [
        replace(one, label=label[:1].upper() + label[1:])
        for one, label in zip(columns, labels, strict=True)
    ]


def _in_full(one: Column, label: str) -> str:
    return one.meaning if one.meaning.startswith(label) else label


def _by_name(one: Column, _: str) -> str:
    return one.name.replace("_", " ")


def _of_setting(name: str) -> str:
    """Return the words of a setting; the section only where the setting says too little."""
    section, _, key = name.partition("_")
    sections = Scenario.sections()
    homes = [one for one, kind in sections.items() if key in kind.kinds()]
    if name == "subject_mass":
        return "body mass"
    alone = section in _PLAIN and len(homes) < 2
    return (key if alone and key else name).replace("_", " ")


def _of_output(one: Column) -> str:
    short = re.split(r";| \(", one.meaning)[0].strip()
    first, _, rest = short.partition(", ")
    short = short if " and " in rest else first  # a list, else what is said in addition
    tells = 0 < len(short) <= _SHORT and not short.startswith(_GOES_ON)
    return short if tells and not set(short) & set("=^") else one.name.replace("_", " ")
