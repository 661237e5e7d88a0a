"""Make docs/images/studies/ again, a picture of each study of scenarios/studies/.

Usage: study_pictures.py [RESULTS_DIR], with the studies in it (``make study FILE=...``), else out.
"""

import sys
from pathlib import Path

import numpy as np
import pandas as pd

import human_gait as hg
from human_gait.canvas import Axes, Picture, plain
from human_gait.pictures.style import BLACK, LEFT, RIGHT, STYLE, new_figure
from human_gait.scenario.units import in_unit

IMAGES = Path(__file__).resolve().parent / "images" / "studies"
SIZE = (4.6, 3.4)  # [inch]
FUKUCHI = (0.255, 0.312)  # step length [m] by speed: Fukuchi et al. 2018
WOMEN, MEN = RIGHT, LEFT
SHADES = ("#c6dbef", "#9ecae1", "#6baed6", "#4292c6", "#2171b5", "#08306b")  # slow to fast
POUND = in_unit("1 lb", "kg")


def speed_step(frame: pd.DataFrame, ax: Axes) -> None:
    """Cost over step length for each speed; dots: the step that people take."""
    speeds = sorted(frame.walk_speed.unique())
    for k, speed in enumerate(speeds):
        some = frame[frame.walk_speed == speed].sort_values("walk_step_length")
        colour = SHADES[k]
        cost = some.cost_of_transport
        ax.plot(
            some.walk_step_length, cost, color=colour, marker="o", ms=3, label=f"{speed:.1f} m/s"
        )
        step = FUKUCHI[0] + FUKUCHI[1] * speed
        if step <= some.walk_step_length.max():
            own = np.interp(step, some.walk_step_length, cost)
            ax.plot(step, own, "o", color=RIGHT, ms=7, zorder=5)
    ax.plot([], [], "o", color=RIGHT, ms=7, label="step of people")
    ax.set_xlabel("step length [m]")
    ax.set_ylabel("cost of transport [J/(kg m)]")
    ax.legend(fontsize=8)


def load_person(frame: pd.DataFrame, ax: Axes) -> None:
    """Share of the strength over load and percentile."""
    grid = frame.pivot(index="subject_percentile", columns="load_mass", values="strength_share")
    drawn = ax.imshow(100.0 * grid.to_numpy(), origin="lower", aspect="auto", cmap="viridis_r")
    ax.set_xticks(range(len(grid.columns)), [f"{load:g}" for load in grid.columns])
    ax.set_yticks(range(len(grid.index)), [f"{percentile:g}" for percentile in grid.index])
    for i, j in np.ndindex(grid.shape):
        value = grid.iat[i, j]
        words = "none" if np.isnan(value) else f"{100.0 * value:.0f}"
        ax.text(j, i, words, ha="center", va="center", fontsize=8, color="white")
    ax.set_xlabel("load [kg]")
    ax.set_ylabel("percentile of stature and mass [%]")
    ax.figure.colorbar(drawn, ax=ax, label="muscle nearest to its strength [%]")


def percentiles(frame: pd.DataFrame, ax: Axes) -> None:
    """Moment in the lower back of women and men with each load."""
    width = 0.12
    for k, (sex, percentile) in enumerate((s, p) for s in ("female", "male") for p in (5, 50, 95)):
        some = frame[(frame.subject_sex == sex) & (frame.subject_percentile == percentile)]
        some = some.sort_values("load_mass")
        place = np.arange(len(some)) + (k - 2.5) * width
        height = some.L5S1_extension_peak * some.subject_mass
        colour, shade = (WOMEN if sex == "female" else MEN), {5: 0.4, 50: 0.7, 95: 1.0}[percentile]
        name = f"{'women' if sex == 'female' else 'men'}, {percentile}th percentile"
        ax.bar(place, height, width * 0.9, color=colour, alpha=shade, label=name)
    loads = sorted(frame.load_mass.unique())
    ax.set_xticks(range(len(loads)), [f"{load / POUND:.0f} lb" for load in loads])
    ax.set_ylabel("largest L5/S1 extension moment [N m]")
    ax.legend(fontsize=7)


def strength(frame: pd.DataFrame, ax: Axes) -> None:
    """Share of the strength by percentile, for each speed."""
    ordered = frame.sort_values("subject_strength")
    for k, (speed, some) in enumerate(ordered.groupby("walk_speed")):
        colour = SHADES[2 * k if k < 3 else 5]
        share = 100.0 * some.strength_share
        name = f"{speed:.1f} m/s"
        ax.plot(some.subject_strength, share, color=colour, marker="o", ms=3, label=name)
        none = some[~some.success]
        ax.plot(none.subject_strength, [101.0] * len(none), "x", color=RIGHT, clip_on=False)
    ax.axhline(90.0, color=BLACK, linewidth=0.8, linestyle=(0, (4, 3)))
    ax.plot([], [], "x", color=RIGHT, label="cannot be walked")
    ax.legend(fontsize=8)
    ax.set_xlim(0.0, 102.0)
    ax.set_xlabel("percentile of strength [%]")
    ax.set_ylabel("muscle nearest to its strength [%]")


def people(frame: pd.DataFrame, ax: Axes) -> None:
    """Scatter of what 18 kg cost, by body mass."""
    wide = frame.pivot(index="person", columns="load_mass", values="cost_of_transport")
    more = 100.0 * (wide[18.0] / wide[0.0] - 1.0)
    who = frame[frame.load_mass == 0.0].set_index("person")
    for sex, colour, name in (("female", WOMEN, "women"), ("male", MEN, "men")):
        some = who[who.subject_sex == sex]
        ax.plot(some.subject_mass, more[some.index], "o", ms=3.5, color=colour, label=name)
    ax.set_xlabel("body mass [kg]")
    ax.set_ylabel("18 kg raise the cost of transport by [%]")
    ax.legend()


DRAWN = (speed_step, load_person, percentiles, strength, people)


def main() -> None:
    """Draw all studies that are there."""
    results = Path(sys.argv[1] if len(sys.argv) > 1 else "out")
    IMAGES.mkdir(parents=True, exist_ok=True)
    for draw in DRAWN:
        name = draw.__name__.replace("_", "-")
        frame = hg.open_study(results / name).to_dataframe()
        with plain(STYLE):
            figure: Picture = new_figure(*SIZE)
            draw(frame, figure.add_subplot())
        (IMAGES / f"{name}.png").write_bytes(figure.png())
        print(f"{name}: {frame.success.sum()} of {len(frame)} walks")


if __name__ == "__main__":
    main()
