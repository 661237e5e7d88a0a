"""One person and the load on the back, once for all who ask: links, URDF text, Pinocchio model."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import pinocchio as pin

from human_gait.body.links import Links
from human_gait.body.model import build_model
from human_gait.body.urdf import urdf_text
from human_gait.scenario import Load, Subject

_PERSONS = 8  # that are kept: those of one study, or of a continuation in loads


@dataclass(frozen=True, eq=False, repr=False)
class Body(Links):
    """One person and the load on the back; `Links` has the attributes.

    Text and model are made where they are first asked for, and once; neither is pickled.
    """

    def __repr__(self) -> str:
        person, load = self.subject, self.load
        carried = f"load {load.mass:.4g} kg ({load.model})" if load.mass else "no load"
        who = f"{person.sex}, {person.stature:g} m, {person.mass:g} kg"
        return f"Body({who}; {carried}; {len(self.mass)} links)"

    @cached_property
    def urdf(self) -> str:
        """The body as URDF, for Pinocchio, Drake, yourdfpy and any other reader."""
        return urdf_text(self)

    @cached_property
    def model(self) -> pin.Model:
        """The Pinocchio model that all who compute with this body share: not to be changed."""
        return build_model(self.urdf, self)

    def pinocchio_model(self) -> pin.Model:
        """Return a Pinocchio model of the body, the caller's own.

        Its 55 joints are in the paper's order (nq = nv = 55) and gravity is along -y. The contact
        points are frames named ``heel_r``, ``ball_medial_r``, ..., ``toe_l``.
        """
        return pin.Model(self.model)


def make_body(subject: Subject, load: Load | None = None) -> Body:
    """Return the body of a subject who carries a load (none by default).

    The same body for the same subject and load: its arrays cannot be written to.
    """
    return _made(subject, Load() if load is None else load)


@lru_cache(maxsize=_PERSONS)
def _made(subject: Subject, load: Load) -> Body:
    return Body.of(subject, load)
