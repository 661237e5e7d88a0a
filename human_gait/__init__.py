"""Prediction of human walking by optimisation, with a skeleton of 55 degrees of freedom.

>>> import human_gait as hg
>>> gait = hg.predict("scenarios/normal.toml", progress=True)
>>> gait["knee_flexion_r"]  # over one stride, [rad]
>>> hg.verify(gait), hg.compare(gait)
>>> hg.play(gait)
>>> gait.save("out/mine")

``dir(human_gait)`` lists what there is; everything else is the inside of the package.
"""

from typing import TYPE_CHECKING

__all__ = [
    "Body",
    "Check",
    "Checks",
    "Comparison",
    "Dimensionless",
    "Discretisation",
    "DofRange",
    "Energy",
    "Explanation",
    "Gait",
    "GaitError",
    "GaitProgram",
    "Ground",
    "Iterate",
    "Limits",
    "Load",
    "ModelError",
    "Motion",
    "NewtonSolver",
    "NoSolutionFound",
    "Objective",
    "PathConstraint",
    "Phases",
    "Plate",
    "Population",
    "Posture",
    "Predictor",
    "Recording",
    "ResultError",
    "Rows",
    "RunningCost",
    "Samples",
    "Scenario",
    "ScenarioError",
    "Solution",
    "SolveInterrupted",
    "Study",
    "Subject",
    "Tolerances",
    "Tracking",
    "TrialError",
    "UnsupportedProgram",
    "Walk",
    "bspline_trajectory",
    "build_program",
    "comfortable_walk",
    "compare",
    "dimensionless",
    "drake_plant",
    "energy",
    "explain",
    "film",
    "fit",
    "load",
    "load_scenario",
    "make_body",
    "offer_hessian",
    "open_study",
    "pinocchio_model",
    "play",
    "predict",
    "read_trial",
    "report",
    "shipped_scenarios",
    "solve",
    "study",
    "study_report",
    "verify",
]

if TYPE_CHECKING:
    from human_gait.body.person import Body, make_body
    from human_gait.checks.check import Check
    from human_gait.checks.models import drake_plant, pinocchio_model
    from human_gait.checks.table import Checks, verify
    from human_gait.exceptions import (
        GaitError,
        ModelError,
        NoSolutionFound,
        ResultError,
        ScenarioError,
        SolveInterrupted,
        TrialError,
        UnsupportedProgram,
    )
    from human_gait.findings.page import study_report
    from human_gait.people.comparison import Comparison, compare
    from human_gait.people.population import Population
    from human_gait.playback.film import film
    from human_gait.playback.page import play
    from human_gait.predictor import Predictor
    from human_gait.problem.drake import bspline_trajectory, offer_hessian
    from human_gait.problem.own import Motion, PathConstraint, Rows, RunningCost
    from human_gait.problem.program import GaitProgram, build_program
    from human_gait.problem.tracking import Tracking
    from human_gait.reporting.calls import Explanation, explain, report
    from human_gait.scenario import (
        Discretisation,
        DofRange,
        Ground,
        Limits,
        Load,
        Objective,
        Phases,
        Posture,
        Scenario,
        Subject,
        Tolerances,
        Walk,
        load_scenario,
        shipped_scenarios,
    )
    from human_gait.solving.newton_solver import NewtonSolver
    from human_gait.solving.solver import Solution, solve
    from human_gait.solving.watch import Iterate
    from human_gait.studies.calls import study
    from human_gait.studies.opened import Study, open_study
    from human_gait.trials.calls import fit
    from human_gait.trials.reading import read_trial
    from human_gait.trials.recording import Plate, Recording
    from human_gait.walk.dimensionless import Dimensionless, comfortable_walk, dimensionless
    from human_gait.walk.energy import Energy, energy
    from human_gait.walk.gait import Gait, Samples
    from human_gait.walks import load, predict

    __version__: str
else:
    # Made available on first use: a solver or a browser viewer takes up to a second to import.
    _MODULE_OF = {
        "Body": "body.person",
        "Check": "checks.check",
        "Checks": "checks.table",
        "Comparison": "people.comparison",
        "Dimensionless": "walk.dimensionless",
        "Discretisation": "scenario",
        "DofRange": "scenario",
        "Energy": "walk.energy",
        "Explanation": "reporting.calls",
        "Gait": "walk.gait",
        "GaitError": "exceptions",
        "GaitProgram": "problem.program",
        "Ground": "scenario",
        "Iterate": "solving.watch",
        "Limits": "scenario",
        "Load": "scenario",
        "ModelError": "exceptions",
        "Motion": "problem.own",
        "NewtonSolver": "solving.newton_solver",
        "NoSolutionFound": "exceptions",
        "Objective": "scenario",
        "PathConstraint": "problem.own",
        "Phases": "scenario",
        "Plate": "trials.recording",
        "Population": "people.population",
        "Posture": "scenario",
        "Predictor": "predictor",
        "Recording": "trials.recording",
        "ResultError": "exceptions",
        "Rows": "problem.own",
        "RunningCost": "problem.own",
        "Samples": "walk.gait",
        "Scenario": "scenario",
        "ScenarioError": "exceptions",
        "Solution": "solving.solver",
        "SolveInterrupted": "exceptions",
        "Study": "studies.opened",
        "Subject": "scenario",
        "Tolerances": "scenario",
        "Tracking": "problem.tracking",
        "TrialError": "exceptions",
        "UnsupportedProgram": "exceptions",
        "Walk": "scenario",
        "bspline_trajectory": "problem.drake",
        "build_program": "problem.program",
        "comfortable_walk": "walk.dimensionless",
        "compare": "people.comparison",
        "dimensionless": "walk.dimensionless",
        "drake_plant": "checks.models",
        "energy": "walk.energy",
        "explain": "reporting.calls",
        "film": "playback.film",
        "fit": "trials.calls",
        "load": "walks",
        "load_scenario": "scenario",
        "make_body": "body.person",
        "offer_hessian": "problem.drake",
        "open_study": "studies.opened",
        "pinocchio_model": "checks.models",
        "play": "playback.page",
        "predict": "walks",
        "read_trial": "trials.reading",
        "report": "reporting.calls",
        "shipped_scenarios": "scenario",
        "solve": "solving.solver",
        "study": "studies.calls",
        "study_report": "findings.page",
        "verify": "checks.table",
    }

    def __dir__():
        """Return the public names, those that are not imported yet as well."""
        return [*__all__, "__version__"]

    def __getattr__(name):
        """Import the module of a public name when the name is used for the first time."""
        if name == "__version__":
            from importlib.metadata import version

            return version("human-gait")
        if name not in _MODULE_OF:
            message = f"module {__name__!r} has no attribute {name!r}"
            raise AttributeError(message)
        from human_gait.late import late

        return late(_MODULE_OF[name], name)
