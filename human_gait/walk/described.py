"""A gait in a few lines, for who looks at it at a prompt or in a notebook."""

from __future__ import annotations

import hashlib
import json
from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from human_gait.walk.gait import Gait


def gait_facts(gait: Gait) -> dict[str, str]:
    """Return what a person wants to know of a gait, by what it is."""
    scenario, found = gait.scenario, gait.solution
    walk, subject, load = scenario.walk, scenario.subject, scenario.load
    facts = {
        "person": f"{subject.sex}, {subject.stature:g} m, {subject.mass:g} kg",
        "load": f"{load.mass:.4g} kg" if load.mass else "none",
        "walk": f"{walk.speed:g} m/s, step {walk.step_length:g} m in {walk.step_time:.3g} s",
        "splines": f"{len(gait.control_points)} control points for each of 55 joints",
    }
    if "solver" in found:
        facts["solver"] = f"{found['solver']} ({found.get('status', 'status unknown')})"
    if "cost" in found:
        facts["cost"] = f"{found['cost']:.6g} N^2 m^2 s"
    if "success" in found:
        facts["success"] = "yes" if found["success"] else "no: this is no walk"
    return facts


def gait_digest(gait: Gait) -> str:
    """Return 16 hexadecimal digits that tell a gait from every other, however slightly it differs.

    They cover all that a gait is: scenario, pieces, control points and how it was found. What is
    made from a gait carries them, so that it can be told what belongs to which walk.
    """
    words = json.dumps([gait.scenario.to_dict(), dict(gait.solution)], sort_keys=True)
    content = hashlib.sha256(words.encode("utf-8", "surrogatepass"))
    for array in (gait.breaks, gait.control_points):
        content.update(array.astype("<f8").tobytes())
    return content.hexdigest()[:16]


def no_walk(gait: Gait) -> str:
    """Return why a gait is no walk, in one sentence, for all that is made from it; else nothing."""
    found = gait.solution
    if found.get("success", True):
        return ""
    status = found.get("status", "status unknown")
    return f"This is no walk: {found.get('solver', 'the solver')} ended with {status!r}."


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
