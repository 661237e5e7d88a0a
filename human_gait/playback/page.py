"""The walk in MeshCat: a page that opens without a server, or is shown live from this computer.

The page holds MeshCat's viewer, the commands of the scene in their order, and controls. It shows
one walk, or two at the same phase of the stride: at the same time, walks of different pace would
soon be in different phases, and no postures could be compared.
"""

from __future__ import annotations

import contextlib
import threading
import webbrowser
from collections.abc import Sequence
from functools import cache
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Any

import jinja2
import numpy as np
from markupsafe import Markup

from human_gait.playback.carried import KINDS, kind_of_load
from human_gait.playback.drawn_body import torque_sizes
from human_gait.playback.inline import InlinePage, in_notebook
from human_gait.playback.looks import COLOURS, FOOTHOLDS
from human_gait.playback.policy import content_policy
from human_gait.playback.scene import WALKERS, DrawnStride, extent, scene_commands, stride_of
from human_gait.playback.server import LOOPBACK, has_screen, page_server
from human_gait.playback.still import still_address
from human_gait.walk.described import gait_digest, no_walk
from human_gait.walk.gait_file import gait_of

if TYPE_CHECKING:
    from human_gait.walk.gait import Gait


TORQUE_COLOURS = ("#f4f2e8", "#b5dc9d", "#4fae86", "#17747a", "#12304f")
"""Colours of joint torques from none to the largest, evenly spaced; ever darker."""

SCRIPTS = ("playback.js", "quality.js", "controls.js", "save.js")
"""Our scripts, in one element in this order."""


def play(
    gait: Gait | str | Path,
    strides: int | None = None,
    host: str = LOOPBACK,
    second: Gait | str | Path | None = None,
    overlay: bool = False,
    inline: bool | None = None,
) -> InlinePage | None:
    """Show a walk in MeshCat: in a notebook below the cell, else in the browser.

    For the browser it prints an address on this computer and opens it if there is a screen.

    Parameters
    ----------
    gait : Gait, str or Path
        A gait, or the folder of a result, or its ``gait.npz``.
    strides : int, optional
        Stop after so many strides; otherwise walk endlessly, in the browser until Ctrl-C.
    host : str
        Address to listen on for the browser; by default this computer alone can connect.
    second : Gait, str or Path, optional
        Another walk to show beside it, at the same phase of the stride.
    overlay : bool
        Show the second one translucent in the same place.
    inline : bool, optional
        Whether to return the page for a notebook to show; by default in the kernel of one.

    Returns
    -------
    InlinePage or None
        For a notebook what shows the walk as the value of a cell, at once; else, when the walk in
        the browser has ended, None.

    Raises
    ------
    ValueError
        If `strides` is less than 1.
    ResultError
        If there is no gait that can be read, or this computer has no such address.
    """
    if strides is not None and strides < 1:
        raise ValueError(f"strides must be at least 1, not {strides}")
    first, other = gait_of(gait), None if second is None else gait_of(second)
    page = playback_page(first, strides, other, overlay)
    if in_notebook() if inline is None else inline:
        return InlinePage(page, " and ".join(_names([first, other] if other else [first])))
    _serve(page, host, 2 * first.step_time * strides if strides else None)
    return None


def _serve(page: str, host: str, seconds: float | None) -> None:
    """Serve a page to the browser for so long, else until Ctrl-C."""
    with page_server(page, host, page_policy()) as server, contextlib.suppress(KeyboardInterrupt):
        others = f"; for others at {server.url_elsewhere} or by address" * server.everywhere
        print(f"MeshCat at {server.url}{others}, Ctrl-C to stop", flush=True)  # noqa: T201
        if has_screen():
            webbrowser.open(server.url)
        if seconds is not None:
            bell = threading.Timer(seconds, server.shutdown)
            bell.daemon = True
            bell.start()
        server.serve_forever()


def save_playback(
    gait: Gait, path: str | Path, second: Gait | None = None, overlay: bool = False
) -> None:
    """Write an HTML page that plays the walk and needs no server, no network and no other file.

    `second` and `overlay` are those of `play`.
    """
    page = playback_page(gait, None, second, overlay)
    Path(path).write_text(page, encoding="utf-8")


def playback_page(
    gait: Gait,
    strides: int | None = None,
    second: Gait | None = None,
    overlay: bool = False,
) -> str:
    """Return the HTML page that plays a walk, or two.

    Parameters
    ----------
    gait : Gait
    strides : int, optional
        Stop after so many; otherwise walk endlessly.
    second : Gait, optional
        Another walk to show at the same phase of the stride.
    overlay : bool
        Begin with the second one translucent over the first instead of beside it.
    """
    return page_of([gait, second] if second else [gait], strides, overlay)


def page_of(
    gaits: Sequence[Gait],
    strides: int | None = None,
    overlay: bool = False,
    called: Sequence[str] | None = None,
) -> str:
    """Return the HTML page that plays walks, as many as there are `WALKERS`, beside one another.

    `strides` and `overlay` (of two) are those of `playback_page`; `called` is how the walks are
    called, if not by the names of their scenarios.
    """
    walks = [_about(each, name) for each, name in zip(gaits, called or _names(gaits), strict=True)]
    scenes = [stride_of(each) for each in gaits]
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined)
    return environment.from_string(_text("playback.html")).render(
        title=" and ".join(walk["name"] for walk in walks),
        **page_marks(gaits),
        walks=walks,
        note=_note(walks) if len(walks) > 1 else "",
        still=still_address(gaits, [walk["name"] for walk in walks]),
        layers=_layers(gaits),
        data=_data(scenes, walks, strides, overlay),
        scripts=list(map(Markup, _scripts())),
    )


def page_marks(gaits: Sequence[Gait]) -> dict[str, Any]:
    """Return what the head of a page about gaits tells programs, as values for its template."""
    return {
        "policy": page_policy(),
        "generator": f"human-gait {version('human-gait')}",
        "digests": [gait_digest(gait) for gait in gaits],
    }


@cache
def page_policy() -> str:
    """Return the Content Security Policy of the page of a walk, and of pages that hold it."""
    return content_policy(_scripts())


@cache
def _scripts() -> tuple[str, str]:
    """Return what runs in the page: MeshCat's viewer and our own."""
    viewer = files("meshcat") / "viewer" / "dist" / "main.min.js"
    return viewer.read_text(encoding="utf-8"), "".join(map(_text, SCRIPTS))


def _text(name: str) -> str:
    return (files(__package__) / name).read_text(encoding="utf-8")


def _names(gaits: Sequence[Gait]) -> list[str]:
    """Return what the walks are called, numbered if their scenarios have one name."""
    names = [gait.scenario.name for gait in gaits]
    if len(set(names)) == len(names):
        return names
    return [f"{name} ({k})" for k, name in enumerate(names, start=1)]


def _about(gait: Gait, name: str) -> dict[str, Any]:
    """Return what the page says of a walk."""
    return {
        "name": name,
        "caption": _caption(gait),
        "warning": no_walk(gait),
        "strideTime": 2 * gait.step_time,
        "doubleSupport": gait.scenario.phases.double_support / 2,  # of the stride
    }


def _data(
    strides: Sequence[DrawnStride], walks: list[dict[str, Any]], limit: int | None, overlay: bool
) -> dict[str, Any]:
    """Return what the script of the page reads."""
    across, up, along = extent(strides).tolist()
    broad = max(across, along)
    torques = [torque_sizes(stride.instants.tau) for stride in strides]
    largest = max(float(size.max()) for sizes in torques for size in sizes.values())
    return {
        "walks": [
            {**walk, "torques": {name: size.round(1).tolist() for name, size in sizes.items()}}
            for walk, sizes in zip(walks, torques, strict=True)
        ],
        "nodes": WALKERS,
        "strides": limit,
        "overlay": overlay and len(strides) == 2,
        "height": float(up),  # [m]; what has to be in sight
        "broad": {"side": along, "front": across, "top": broad, "oblique": broad},
        "torqueMax": max(10 * int(np.ceil(largest / 10)), 10),  # [N m]
        "ramp": TORQUE_COLOURS,
        "colours": _css_colours(),
        "commands": scene_commands(strides),
    }


def _css_colours() -> dict[str, str]:
    return {name: f"#{colour:06x}" for name, colour in COLOURS.items()}


def _layers(gaits: Sequence[Gait]) -> list[dict[str, Any]]:
    """Return the layers that can be shown or hidden, with the colours of their legend."""
    colours = _css_colours()
    feet = [colours["right"], colours["left"]]
    footholds = [f"#{FOOTHOLDS[foot]:06x}" for foot in ("right", "left")]
    loads = {KINDS[kind_of_load(gait.body)] for gait in gaits if gait.body.load.mass > 0}
    layers = [
        ("body", "Body", [], ""),
        *([("backpack", loads.pop() if len(loads) == 1 else "Load", [], "")] if loads else []),
        ("footholds", "Footholds", footholds, ""),
        ("support", "Support polygon", [colours["support"]], ""),
        ("zmp", "Zero moment point", [colours["zmp"]], "dot"),
        ("ground_reaction", "Ground reaction", feet, ""),
        ("torques", "Joint torques", TORQUE_COLOURS[1:4], ""),
    ]
    return [
        {"name": name, "label": label, "colours": shown, "shape": shape, "shown": name != "torques"}
        for name, label, shown, shape in layers
    ]


def _note(walks: list[dict[str, Any]]) -> str:
    """Return how two walks of any pace are shown at once."""
    who = "Both" if len(walks) == 2 else "All"
    note = f"{who} walkers are at the same per cent of it, to compare postures"
    first, *others = (walk["strideTime"] for walk in walks)
    if all(abs(first - time) < 0.005 for time in others):
        return f"{note}."
    pace, *paces = (_quantity(time, "s", ".2f") for time in (first, *others))
    needs = "the second needs" if len(walks) == 2 else "the others need"
    return f"{note}, at the pace of the first: {pace}; {needs} {', '.join(paces)}."


def _caption(gait: Gait) -> str:
    walk, subject, load = gait.scenario.walk, gait.body.subject, gait.body.load
    stature, mass = _quantity(subject.stature, "m"), _quantity(subject.mass, "kg")
    carried = f", load {_quantity(load.mass, 'kg', '.3g')}" if load.mass > 0 else ""
    speed, step = _quantity(walk.speed, "m/s"), _quantity(walk.step_length, "m")
    return f"{speed}, step {step}; {subject.sex}, {stature}, {mass}{carried}"


def _quantity(value: float, unit: str, form: str = ".4g") -> str:
    """Return a number with its unit, which stay in one line."""
    return f"{value:{form}}\N{NO-BREAK SPACE}{unit}"
