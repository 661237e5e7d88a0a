"""Markers of laboratories and where they are on our body, by their names."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from human_gait.body.person import Body
from human_gait.exceptions import TrialError
from human_gait.export.markers import Marker, marker_set
from human_gait.values import Value

_LOOSE = 0.1  # weight of markers that are put anywhere along a limb
_ON_LIMBS = ("UPA", "FRM", "THI", "TIB", "RBAK")

_PAIRS = {  # of other sets, without the side: the names of ours, of which it is the mean
    "ASIS": ("ASI",),
    "PSIS": ("PSI",),
    "KNEE": ("KNE",),
    "KNEELAT": ("KNE",),
    "LATKNEE": ("KNE",),
    "LFE": ("KNE",),
    "ANKLE": ("ANK",),
    "ANKLELAT": ("ANK",),
    "LATANKLE": ("ANK",),
    "LM": ("ANK",),
    "HEEL": ("HEE",),
    "CAL": ("HEE",),
    "TOETIP": ("HLX",),
    "HALLUX": ("HLX",),
    "MT2": ("TOE",),
    "ACROMIUM": ("SHO",),
    "ACROMION": ("SHO",),
    "SHOULDER": ("SHO",),
    "ELBOW": ("ELB",),
    "ELBOWLAT": ("ELB",),
    "WRIST": ("WRA", "WRB"),
    "WRISTLAT": ("WRA",),
    "WRISTMED": ("WRB",),
    "THIGH": ("THI",),
    "SHANK": ("TIB",),
    "TIBIA": ("TIB",),
}
_SINGLE = {
    "SACR": ("LPSI", "RPSI"),
    "VSACRAL": ("LPSI", "RPSI"),
    "SACRUM": ("LPSI", "RPSI"),
    "STERNUM": ("CLAV", "STRN"),
    "CV7": ("C7",),
    "TV10": ("T10",),
    "SJN": ("CLAV",),
    "SXS": ("STRN",),
}


_PARTS = {  # words of names of markers that are no sites of ours: the segments that they are on
    **dict.fromkeys(("THIGH", "FEMUR", "KNEE", "KNE", "THI"), "thigh"),
    **dict.fromkeys(("SHANK", "TIBIA", "FIBULA", "ANKLE", "ANK", "TIB"), "shank"),
    **dict.fromkeys(("MIDFOOT", "FOOT", "HEEL", "CALC", "MTH", "MT"), "foot"),
    **dict.fromkeys(("TOE", "HALLUX"), "toe"),
    **dict.fromkeys(("BICEP", "UPPERARM", "HUMERUS", "ELBOW"), "upperarm"),
    **dict.fromkeys(("FOREARM", "WRIST"), "forearm"),
    "HAND": "hand",
}
_MIDDLE = {
    **dict.fromkeys(("HEAD", "TEMPLE"), "head"),
    **dict.fromkeys(("PELVI", "ILIAC", "SACR"), "pelvis"),
    **dict.fromkeys(("THORAX", "BACK", "CHEST"), "thorax"),
}


@dataclass(frozen=True, eq=False)
class Site(Value):
    """Where a marker is on the body.

    Attributes
    ----------
    name : str
        What its file calls it.
    ours : tuple of str
        Markers of ours; of several the mean. None of one that a standing trial has placed alone.
    weight : float
        How much it counts: 1 on bones, less where a marker is put anywhere along a limb.
    placed : Marker or None
        Where a standing trial has it instead.
    """

    name: str
    ours: tuple[str, ...] = ()
    weight: float = 1.0
    placed: Marker | None = None

    def among(self, known: Mapping[str, Marker]) -> tuple[Marker, ...]:
        """Return the markers that it is the mean of, among those of a body by name."""
        return (self.placed,) if self.placed else tuple(known[name] for name in self.ours)

    @property
    def in_words(self) -> str:
        """What it was taken for."""
        if self.ours:
            return " and ".join(self.ours)
        return f"on the {self.placed.segment}" if self.placed else ""


def segment_of(name: str) -> str:
    """Return the segment that a marker is on, by words in its name; nothing if nobody knows."""
    bare = _bare(name)
    for word, segment in _MIDDLE.items():
        if word in bare:
            return segment
    for side in "LR":
        for stem in (bare.removeprefix(side), bare.removesuffix(side)):
            part = next((_PARTS[word] for word in _PARTS if word in stem), "")
            if stem != bare and part:
                return f"{part}_{side.lower()}"
    return ""


def _bare(name: str) -> str:
    """Return a name without its subject, signs and words for sides."""
    upper = name.rpartition(":")[2].upper().replace("LEFT", "L").replace("RIGHT", "R")
    return re.sub(r"[^A-Z0-9]", "", upper)


def sites(
    names: Sequence[str], body: Body, given: Mapping[str, str] | None = None
) -> tuple[Site, ...]:
    """Return where markers are on a body, by their names; those that nobody knows are left out.

    Parameters
    ----------
    names : sequence of str
        As a file has them.
    body : Body
    given : mapping of str to str
        Ours by name of the file; empty for one that is to be left out.

    Raises
    ------
    TrialError
        If a name that is given is not among the file's, or one of ours is none.
    """
    ours = [marker.name for marker in marker_set(body)]
    given = dict(given or {})
    _check_given(given, names, ours)
    found, taken = [], set[tuple[str, ...]]()
    for name in names:
        on = (given[name],) if given.get(name) else () if name in given else _ours(name, ours)
        if on and on not in taken:
            taken.add(on)
            loose = all(
                part.removeprefix("L").removeprefix("R") in _ON_LIMBS or part in _ON_LIMBS
                for part in on
            )
            found.append(Site(name, on, _LOOSE if loose else 1.0))
    return tuple(found)


def _ours(name: str, ours: Sequence[str]) -> tuple[str, ...]:
    """Return the markers of ours that a name stands for, none if nobody knows."""
    bare = _bare(name)
    if bare in ours:
        return (bare,)
    if bare in _SINGLE:
        return _SINGLE[bare]
    for side in "LR":
        for stem in (bare.removeprefix(side), bare.removesuffix(side)):
            if stem != bare and stem in _PAIRS:
                return tuple(side + part for part in _PAIRS[stem])
    return ()


def _check_given(given: Mapping[str, str], names: Sequence[str], ours: Sequence[str]) -> None:
    for theirs, own in given.items():
        if theirs not in names:
            raise TrialError(
                f"--map {theirs}={own}: {_nearest(theirs, names, 'marker of the file')}"
            )
        if own and own not in ours:
            raise TrialError(f"--map {theirs}={own}: {_nearest(own, ours, 'marker of ours')}")


def _nearest(name: str, names: Sequence[str], what: str) -> str:
    near = difflib.get_close_matches(name, names, n=1, cutoff=0.4)
    hint = f", did you mean {near[0]!r}?" if near else f": there are {', '.join(names)}"
    return f"no {what} is called {name!r}{hint}"
