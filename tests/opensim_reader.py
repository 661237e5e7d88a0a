"""Reads an export with OpenSim, computes with it and leaves everything in an archive.

It runs as a program of its own, ``opensim_reader.py FOLDER ARCHIVE``: OpenSim's libraries and those
of casadi, which a benchmark uses, cannot be in one process. FOLDER holds the export and
``state.npz`` with names, t, v and a (K, n) of the rows of ``coordinates.mot``.
"""

import sys
from pathlib import Path

import numpy as np
import opensim as osim


def table(path):
    """Labels, times and values of a .mot or .sto file; rotations in radians."""
    read = osim.TimeSeriesTable(str(path))
    values = read.getMatrix().to_numpy()
    in_degrees = read.getTableMetaDataAsString("inDegrees") == "yes"
    labels = list(read.getColumnLabels())
    if in_degrees:
        angle = [not label.startswith("pelvis_t") for label in labels]
        values = np.where(angle, np.deg2rad(values), values)
    return {"labels": labels, "t": list(read.getIndependentColumn()), "values": values}


def markers(path):
    """Labels, times and places (K, m, 3) of a TRC file, and its units."""
    read = osim.TimeSeriesTableVec3(str(path))
    rows = [read.getRowAtIndex(k) for k in range(read.getNumRows())]
    labels = list(read.getColumnLabels())
    places = [[row[i].to_numpy() for i in range(len(labels))] for row in rows]
    return {
        "labels": labels,
        "t": list(read.getIndependentColumn()),
        "places": np.array(places),
        "units": read.getTableMetaDataAsString("Units"),
    }


def model_under_loads(folder):
    """The model with the external loads, its state, and its coordinates in the order of speeds."""
    model = osim.Model(str(folder / "model.osim"))
    model.addModelComponent(osim.ExternalLoads(str(folder / "external_loads.xml"), True))
    state = model.initSystem()
    coordinates, order = list(model.getCoordinateSet()), []
    for i in range(len(coordinates)):
        unit = osim.Vector(len(coordinates), 0.0)
        unit.set(i, 1.0)
        state.setU(unit)
        order += [c.getName() for c in coordinates if c.getSpeedValue(state) == 1.0]
    return model, state, order


def computed(folder, motion, given):
    """Places of markers and joints, and inverse dynamics with the speeds that are given."""
    model, state, order = model_under_loads(folder)
    coordinates = model.getCoordinateSet()
    solver = osim.InverseDynamicsSolver(model)
    names = list(given["names"])
    tau, places, centres = [], [], []
    for k, t in enumerate(motion["t"]):
        state.setTime(t)
        for i, name in enumerate(names):
            coordinate = coordinates.get(name)
            value = motion["values"][k, motion["labels"].index(name)]
            coordinate.setValue(state, float(value), False)
            coordinate.setSpeedValue(state, float(given["v"][k, i]))
        rates = osim.Vector(len(order), 0.0)
        for i, name in enumerate(order):
            rates.set(i, float(given["a"][k, names.index(name)]))
        model.realizeDynamics(state)
        torque = solver.solve(state, rates)
        tau.append([torque.get(order.index(name)) for name in names])
        places.append([m.getLocationInGround(state).to_numpy() for m in model.getMarkerSet()])
        centres.append([b.getPositionInGround(state).to_numpy() for b in model.getBodySet()])
    return {"tau": np.array(tau), "markers": np.array(places), "bodies": np.array(centres)}


def described(folder):
    """Names, masses, limits and so on of the model alone."""
    model = osim.Model(str(folder / "model.osim"))
    state = model.initSystem()
    coordinates = list(model.getCoordinateSet())
    return {
        "coordinates": [c.getName() for c in coordinates],
        "lower": [c.getRangeMin() for c in coordinates],
        "upper": [c.getRangeMax() for c in coordinates],
        "locked": [c.getDefaultLocked() for c in coordinates],
        "rest": [c.getDefaultValue() for c in coordinates],
        "bodies": [b.getName() for b in model.getBodySet()],
        "markers": [m.getName() for m in model.getMarkerSet()],
        "mass": model.getTotalMass(state),
        "gravity": model.getGravity().to_numpy(),
        "com": model.calcMassCenterPosition(state).to_numpy(),
        **shapes(model, state),
    }


def shapes(model, state):
    """Centres and long axes of what is drawn, and its radius, in the upright posture."""
    centres, axes, radii = [], [], []
    for component in model.getComponentsList():
        frame = osim.PhysicalOffsetFrame.safeDownCast(component)
        if frame and "_shape" in frame.getName():
            geometry = frame.get_attached_geometry(0)
            round_one = osim.Cylinder.safeDownCast(geometry) or osim.Sphere.safeDownCast(geometry)
            centres.append(frame.getPositionInGround(state).to_numpy())
            along = frame.expressVectorInGround(state, osim.Vec3(0, 1, 0))
            axes.append(along.to_numpy())
            radii.append(round_one.get_radius())
    return {"centres": np.array(centres), "axes": np.array(axes), "radii": np.array(radii)}


def inverse_dynamics(folder, results):
    """What the tool makes of the files alone, differentiating by itself."""
    tool = osim.InverseDynamicsTool()
    model = osim.Model(str(folder / "model.osim"))
    tool.setModel(model)
    tool.setCoordinatesFileName(str(folder / "coordinates.mot"))
    tool.setExternalLoadsFileName(str(folder / "external_loads.xml"))
    times = table(folder / "coordinates.mot")["t"]
    tool.setStartTime(times[0])
    tool.setEndTime(times[-1])
    tool.setLowpassCutoffFrequency(-1.0)
    tool.setResultsDir(str(results))
    tool.setOutputGenForceFileName("tool.sto")
    tool.run()
    return table(results / "tool.sto")


def main(folder, archive):
    """Leave in an archive what OpenSim finds in a folder."""
    osim.Logger.removeFileSink()
    osim.Logger.setLevelString("error")
    found = {
        "motion": table(folder / "coordinates.mot"),
        "ground": table(folder / "ground_reaction.mot"),
        "torques": table(folder / "joint_torques.sto"),
        "tool": inverse_dynamics(folder, archive.parent),
    }
    if (folder / "markers.trc").exists():
        found["trc"] = markers(folder / "markers.trc")
        found["model"] = described(folder)
        found["computed"] = computed(folder, found["motion"], np.load(folder / "state.npz"))
    flat = {f"{part}.{name}": x for part, values in found.items() for name, x in values.items()}
    np.savez(archive, **flat)


if __name__ == "__main__":
    main(Path(sys.argv[1]), Path(sys.argv[2]))
