"""Studies that nobody has solved: an index, cycles and walks made from formulas."""

import hashlib
import json

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
from walking import guessed_gait

from human_gait.studies.store import Kept, Store
from human_gait.walk.gait import Gait
from human_gait.walk.gait_cycle import COLUMNS

SLIDES, TOO_STRONG = "a standing foot slides", "a joint needs more than its strength"
FURTHER = 12  # outputs that mean nothing

MEANINGS = {
    "walk_speed": ("mean walking speed", "m/s"),
    "walk_step_length": ("step length", "m"),
    "load_mass": ("mass of what is carried, 0 for nothing", "kg"),
    "subject_sex": ("sex", ""),
    "subject_stature": ("stature", "m"),
    "subject_mass": ("body mass", "kg"),
    "ground_friction": ("friction of the floor", ""),
    "cost": ("cost, what was minimised", "N^2 m^2 s"),
    "cost_of_transport": ("metabolic cost of transport", "J/(kg m)"),
    "knee_extension_peak": ("largest knee extension moment", "N m/kg"),
    "hip_extension_peak": ("largest hip extension moment", "N m/kg"),
    "knee_flexion_max": ("largest knee flexion", "deg"),
    "vertical_force_peak": ("largest vertical ground reaction", "BW"),
    "strength_share_max": ("largest share of the strength of any joint", ""),
    "froude": ("Froude number", ""),
}


def grid(_, n):
    """Speed by load; n is rounded to a square."""
    side = max(2, round(n**0.5))
    speed, load = np.meshgrid(np.linspace(0.8, 2.0, side), np.linspace(0, 40, side))
    return {"walk_speed": speed.ravel(), "load_mass": load.ravel()}, ["walk_speed", "load_mass"]


def line(_, n):
    """Speed alone."""
    return {"walk_speed": np.linspace(0.8, 2.0, n)}, ["walk_speed"]


def people(rng, n):
    """Women and men of correlated stature and mass, with and without a load."""
    woman = rng.random(n) < 0.5
    one, other = rng.normal(size=(2, n))
    stature = np.where(woman, 1.63, 1.756) + 0.068 * one
    mass = np.where(woman, 67.0, 85.0) + 12.0 * (0.5 * one + 0.87 * other)
    settings = {
        "subject_sex": np.where(woman, "female", "male"),
        "subject_stature": np.clip(stature, 1.45, 2.0),
        "subject_mass": np.clip(mass, 45.0, 130.0),
        "load_mass": rng.choice([0.0, 9.0, 18.0], n),
    }
    return settings, ["load_mass"]


def many(rng, n):
    """People at any speed and step."""
    settings, _ = people(rng, n)
    settings |= {
        "walk_speed": rng.uniform(0.8, 2.0, n),
        "walk_step_length": rng.uniform(0.5, 0.8, n),
        "ground_friction": rng.uniform(0.3, 0.9, n),
    }
    return settings, ["walk_speed", "walk_step_length", "load_mass", "ground_friction"]


KINDS = {"grid": grid, "line": line, "people": people, "many": many}


def outcomes(settings, rng, n, further=FURTHER):
    """What comes out of settings, and why nothing does."""
    speed = settings.get("walk_speed", np.full(n, 1.3))
    step = settings.get("walk_step_length", 0.35 + 0.25 * speed)
    load = settings.get("load_mass", np.zeros(n))
    stature, mass = (
        settings.get(name, np.full(n, usual))
        for name, usual in (("subject_stature", 1.755), ("subject_mass", 78.0))
    )
    share = load / mass
    noise = rng.normal(size=(6, n))
    knee = 0.35 * speed + 1.2 * share + 0.5 * (step - 0.65) + 0.03 * noise[0]
    transport = 2.4 + 2.2 * (speed - 1.3) ** 2 + 3.0 * share + 0.05 * noise[1]
    strength = 0.45 * speed + 0.8 * share + 0.02 * noise[2]
    outputs = {
        "cost": 4000 * speed + 9000 * share + 300 * noise[3],
        "cost_of_transport": transport,
        "knee_extension_peak": knee,
        "hip_extension_peak": 0.5 * speed + 0.6 * share + 0.04 * noise[4],
        "knee_flexion_max": 60 + 5 * (speed - 1.3) + noise[5],
        "vertical_force_peak": 1.05 + 0.2 * (speed - 1.0) + share,
        "strength_share_max": strength,
        "froude": speed**2 / (9.81 * 0.53 * stature),
    }
    outputs |= {f"number_{k:02d}": noise[k % 6] * (k + 1) + speed for k in range(further)}
    slides = speed * (1 + 0.1 * (step - 0.65)) > 2.05 - 0.5 * share * 2
    return outputs, np.where(strength > 0.96, TOO_STRONG, np.where(slides, SLIDES, ""))


def keys_of(name, n):
    return [hashlib.blake2b(f"{name}{k}".encode(), digest_size=16).hexdigest() for k in range(n)]


def write_study(folder, kind="grid", n=36, walks=True, further=FURTHER, name=None):
    """Write a study of a kind of n walks and return its folder; with all its walks, or without."""
    rng = np.random.default_rng(7)
    settings, varied = KINDS[kind](rng, n)
    n = len(next(iter(settings.values())))
    outputs, reason = outcomes(settings, rng, n, further)
    found = reason == ""
    keys = keys_of(kind, n)
    usual = {name: np.full(n, 0.0) for name in ("load_position_x",)}
    index = {
        "key": keys,
        "success": found,
        "reason": reason,
        "diagnosis": [f"{word}: try a lower speed" if word else "" for word in reason],
        "start": ["cold"] * n,
        "seconds": rng.uniform(0.5, 2.0, n),
        "iterations": rng.integers(20, 60, n),
        **settings,
        **usual,
        **{key: np.where(found, values, np.nan) for key, values in outputs.items()},
    }
    folder.mkdir(parents=True, exist_ok=True)
    about = {
        "study": name or f"synthetic {kind}",
        "version": "0.6.0",
        "varied": varied,
        "population": {"n": n} if kind in {"people", "many"} else None,
        "outputs": ["cost_of_transport", "knee_extension_peak"],
        "limits": ["froude < 0.3"],
    }
    table = pa.table(index)
    schema = pa.schema([told(one) for one in table.schema], {"human_gait": json.dumps(about)})
    pq.write_table(table.cast(schema), folder / "index.parquet", compression="zstd")
    write_cycles(folder, keys, found, outputs, rng)
    if walks:
        for k in np.flatnonzero(found):
            write_walk(folder, keys[k], {key: values[k] for key, values in settings.items()})
    return folder


def told(field):
    meaning, unit = MEANINGS.get(field.name, (field.name.replace("_", " "), ""))
    return field.with_metadata({"unit": unit, "meaning": meaning})


def write_cycles(folder, keys, found, outputs, rng):
    """Curves like those of people, larger and smaller, a thousand walks at a time."""
    phase = np.linspace(0, 2 * np.pi, 101)
    names, schema = COLUMNS[1:], None
    size = outputs["knee_extension_peak"]
    with_writer = None
    for first in range(0, len(keys), 1000):
        part = slice(first, first + 1000)
        here, grown = found[part], size[part, None]
        columns = {"key": pa.array(keys[part])}
        for k, name in enumerate(names):
            unit = 30.0 if name.endswith("_deg") else 1.0
            wave = np.sin((1 + k % 2) * phase + 0.3 * k) + 0.3 * np.sin(3 * phase)
            curves = (unit * (grown * wave + 0.05 * rng.normal(size=grown.shape))).astype("f4")
            flat = pa.array(curves.ravel())
            listed = pa.FixedSizeListArray.from_arrays(flat, 101, mask=pa.array(~here))
            columns[name] = listed
        table = pa.table(columns)
        if with_writer is None:
            schema = table.schema
            with_writer = pq.ParquetWriter(folder / "cycles.parquet", schema, compression="zstd")
        with_writer.write_table(table, row_group_size=1000)
    with_writer.close()


def write_walk(folder, key, settings, like=None):
    """A walk of the settings, moving as a guess does, or like a given gait."""
    base = like or guessed_gait(18.0 if settings.get("load_mass") else 0.0)
    given = {f"{key.replace('_', '.', 1)}": _plain(value) for key, value in settings.items()}
    scenario = base.scenario.replace(**given)
    breaks = base.breaks * scenario.walk.step_time / base.step_time
    gait = Gait(scenario, breaks, base.control_points)
    Store(folder).save(key, Kept({"success": True}, gait=gait))


def _plain(value):
    return str(value) if isinstance(value, str) else float(value)
