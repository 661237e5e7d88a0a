"""A gait in a few lines, for who looks at it at a prompt or in a notebook."""

from __future__ import annotations

import json
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from human_gait.results.sealed import digest_of
from human_gait.walk.measured import MEASURED_TITLE, was_measured

if TYPE_CHECKING:
    from human_gait.walk.gait import Gait

ESTIMATE = "estimate"
"""Of the solution of a gait: how far it is off if it is only estimated."""

_CONTENT = {  # what solvers say, to begin with, where they are content
    "newton": ("optimal", "the active set is settled"),
    "snopt": ("1: ", "3: "),
    "ipopt": ("Success",),
}


def gait_facts(gait: Gait) -> dict[str, str]:
    """Return what a person wants to know of a gait, by what it is."""
    scenario, found = gait.scenario, gait.solution
    walk, subject, load = scenario.walk, scenario.subject, scenario.load
    facts = {
        "person": f"{subject.sex}, {subject.stature:.4g} m, {subject.mass:.4g} kg",
        "load": f"{load.mass:.4g} kg" if load.mass else "none",
        "walk": f"{walk.speed:.4g} m/s, step {walk.step_length:.4g} m in {walk.step_time:.3g} s",
        "splines": f"{len(gait.control_points)} control points for each of 55 joints",
    }
    if "solver" in found:
        facts["solver"] = f"{found['solver']} ({found.get('status', 'status unknown')})"
    if "cost" in found:
        facts["cost"] = f"{found['cost']:.6g} N^2 m^2 s"
    if "success" in found or no_walk(gait):
        facts["success"] = no_walk(gait) or "yes"
    return facts


def gait_digest(gait: Gait) -> str:
    """Return 16 hexadecimal digits that tell a gait from every other, however slightly it differs.

    Those of equal gaits are equal: they cover the motion and all that was asked of it, neither its
    name nor how it was found. What is made from a gait carries them, so that it can be told what
    belongs to which walk.
    """
    asked = gait.scenario.own_table() | {"name": ""}  # a setting that is new changes no old digest
    words = json.dumps(asked, sort_keys=True)
    arrays = (np.asarray(array, dtype="<f8") + 0.0 for array in (gait.breaks, gait.control_points))
    motion = b"".join(array.tobytes() for array in arrays)  # + 0.0: no -0
    if gait.forces is not None:
        of_forces = gait.forces.force, gait.forces.point, gait.forces.free_moment
        motion += b"".join((np.asarray(x, dtype="<f8") + 0.0).tobytes() for x in of_forces)
    return digest_of(words.encode("utf-8", "surrogatepass") + motion)


def with_story(gait: Gait, success: bool, **story: object) -> Gait:
    """Return a gait that carries whether it is a walk, and how else it was found.

    Parameters
    ----------
    gait : Gait
    success : bool
        Whether the solver was content and every check is passed.
    **story
        Further entries of `Gait.solution`.
    """
    told = {"success": success, "digest": gait_digest(gait), **story}
    return gait.retold({**gait.solution, **told}, gait.multipliers)


def was_changed(gait: Gait) -> bool:
    """Tell whether a gait knows that it is not the one that was found, multipliers and all."""
    return "digest" in gait.solution and gait.solution["digest"] != gait_digest(gait)


def no_walk(gait: Gait) -> str:
    """Return why a gait is no predicted walk, in a sentence, for all made from it; else nothing.

    Of one that was measured it says that.

    It is none if it was found to be none, if its solver gave up, or if its motion or scenario is
    not that which was found. Of a gait that does not know how it was found nothing is said.
    """
    found = gait.solution
    solver, status = str(found.get("solver", "")), str(found.get("status", "status unknown"))
    if was_measured(gait) and not was_changed(gait):
        return MEASURED_TITLE
    if ESTIMATE in found:
        return "This is no walk: it is an estimate, one step from a walk that was found."
    content = status.startswith(_CONTENT.get(solver, ("",)))
    if not content:
        return f"This is no walk: {solver} ended with {status!r}."
    if not found.get("success", True):
        return "This is no walk: it fails checks, or not every constraint is kept."
    if was_changed(gait):
        return "This is no walk: it was changed since it was found, and nobody has verified it."
    return ""


def gait_text(gait: Gait) -> str:
    """Return a gait in a few lines."""
    lines = [f"  {name:<8} {fact}" for name, fact in gait_facts(gait).items()]
    return "\n".join([f"Gait {gait.scenario.name!r}", *lines])


def gait_html(gait: Gait) -> str:
    """Return a gait as a small table, HTML."""
    rows = "".join(
        f'<tr><th scope="row" style="text-align:left">{escape(name)}</th>'
        f'<td style="text-align:left">{escape(fact)}</td></tr>'
        for name, fact in gait_facts(gait).items()
    )
    caption = f"<caption>Gait {escape(gait.scenario.name)}</caption>"
    return f"<table>{caption}<tbody>{rows}</tbody></table>"
