"""Why a solve failed, and what to try.

A failure is explained from its own numbers: rows that are not kept, checks that failed, settings
outside of what people do.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from human_gait.body.skeleton import DOF_NAMES, DOF_UNITS, GRAVITY, in_words
from human_gait.checks.check import Check, Kind
from human_gait.problem.impossible import Suggestion, impossible, rounded_up
from human_gait.problem.program import GaitProgram
from human_gait.problem.violation import Violation
from human_gait.scenario import STEP_HALF_ANGLE_DEG, Scenario
from human_gait.solving.shadow_prices import limit_text, unit_step
from human_gait.solving.solver import Solution
from human_gait.solving.watch import FEASIBLE
from human_gait.stopping import OUT_OF_TIME
from human_gait.walk.contact_plan import HEEL, LEFT, TOE

# What people do. Walk ratio, step length / cadence: Sekiya et al. 1997. They run above the Froude
# number v^2 / (g leg) = 0.5: Alexander 1989. The rest is assumed, wide.
WALK_RATIO = 0.0065  # [m min]
CADENCE = (40.0, 180.0)  # [steps/min]
LONG_STEP = 0.95  # [leg lengths]
FROUDE = 0.5
BMI = (15.0, 45.0)  # [kg/m^2]
HEAVY_LOAD = 0.5  # [of body mass]
DOUBLE_SUPPORT = (0.05, 0.5)  # [of the step]

_PART = 0.3  # of the largest partial of a row: what can move it


def amount(value: float, unit: str) -> str:
    """Return a number with the unit that one would say it in: mm, deg, %."""
    if unit in ("rad", "rad/s"):
        return f"{_short(np.rad2deg(value))} deg{unit[3:]}"
    if unit in ("m", "m/s") and abs(value) < 0.1:
        return f"{_short(1e3 * value)} mm{unit[1:]}"
    if unit in ("of the load", "body weight"):
        return f"{_short(100.0 * value)} % of {unit.removeprefix('of ')}"
    return f"{_short(value)} {unit}"


def _short(value: float) -> str:
    """Return a number with two digits, all of those before the point."""
    return f"{value:.0f}" if 10.0 <= abs(value) < 1e5 else f"{value:.2g}"


def violation_text(violation: Violation, step_time: float) -> str:
    """Return where, by how much and when a constraint is not kept, in one line."""
    equation = f" (Eq. {violation.equation})" if violation.equation else ""
    where = f"{violation.name}{equation}: {violation.what}"
    off = amount(violation.value, violation.unit)
    text = f"{where}: {off} beyond its limit {_when(violation.time, step_time)}"
    first, last = (100.0 * end / step_time for end in (violation.first, violation.last))
    return f"{text}; not kept from {first:.0f} to {last:.0f} %" if last > first else text


def check_text(check: Check, step_time: float) -> str:
    """Return what a check found, what it allows and when, in one line."""
    found, allowed = amount(check.value, check.unit), amount(check.limit, check.unit)
    return f"{check.told}: {found} {_when(check.time, step_time)}, allowed {allowed}"


def _when(time: float, step_time: float) -> str:
    return f"at t = {time:.3f} s ({100.0 * time / step_time:.0f} % of the step)"


def not_kept(scenario: Scenario, violations: list[Violation]) -> list[Violation]:
    """Return the violations that count, the worst first, measured by what may be tolerated."""
    broken = [violation for violation in violations if violation.value > FEASIBLE]
    return sorted(broken, key=lambda v: -v.value / _tolerated(v, scenario))


def _tolerated(violation: Violation, scenario: Scenario) -> float:
    """Return what the row may be off, at least an easy step, in its unit."""
    tolerance, step = violation.demand.tolerance, unit_step(violation.unit)[0]
    value = getattr(scenario.tolerances, tolerance.key) if tolerance else 0.0
    return float(max(abs(np.deg2rad(value) if violation.unit == "rad" else value), step))


def suggestions(program: GaitProgram, solution: Solution, checks: list[Check]) -> list[Suggestion]:
    """Return what to try after a solve that found no walk, the most likely cause first.

    Parameters
    ----------
    program : GaitProgram
    solution : Solution
    checks : list of Check
        Of its gait, passed or not.
    """
    scenario, broken = program.scenario, not_kept(program.scenario, solution.violations)
    known = impossible(scenario, program.functions.walker, program.basis)
    if solution.interrupted and not known:
        return [Suggestion("predict", "let it run to its end", "the solve was interrupted")]
    failed = [check for check in checks if not check.passed]
    found = [*known, *_pace(scenario), *_reach(scenario), *_body(scenario)]
    found += _phases(scenario)
    if broken:
        found += _held(program, solution, broken[0]) if not known else []
        found += _resolution(program, broken[0])
    found += [*_periodicity(scenario, failed), *_passing(scenario, failed)]
    found += _between(program, solution, failed)
    found += _friction(program, failed) if not found else []
    found += _strength(program, failed) if not found else []
    if broken and not found:
        found += _relaxed(broken[0], program)
    return _once([*found, *_solver(solution, broken, bool(found))])


def _once(found: list[Suggestion]) -> list[Suggestion]:
    """Return one suggestion for each setting, the first."""
    first: dict[str, Suggestion] = {}
    for one in found:
        first.setdefault(one.key, one)
    return list(first.values())


def _pace(scenario: Scenario) -> Iterator[Suggestion]:
    """Find a speed or a cadence that people do not walk at."""
    speed, step, leg = scenario.walk.speed, scenario.walk.step_length, scenario.subject.leg_length
    run, cadence = float(np.sqrt(FROUDE * GRAVITY * leg)), 60.0 * speed / step
    bound = CADENCE[1] if cadence > CADENCE[0] else CADENCE[0]
    allowed = bound * step / 60.0
    if speed > run and not (cadence > CADENCE[1] and allowed < run):
        because = f"on legs of {leg:.2f} m people run at {speed:g} m/s, they walk up to {run:.1f}"
        yield Suggestion("walk.speed", f"at most {run:.1f}", because)
    if CADENCE[0] <= cadence <= CADENCE[1]:
        return
    if cadence < CADENCE[0] or speed <= run or allowed < run:
        side = "at most" if cadence > CADENCE[1] else "at least"
        because = (
            f"{speed:g} m/s with steps of {step:g} m are {cadence:.0f} steps/min; "
            f"people take {CADENCE[0]:.0f} to {CADENCE[1]:.0f}"
        )
        yield Suggestion("walk.speed", f"{side} {allowed:.2f} with this step", because)
    usual = float(np.sqrt(60.0 * WALK_RATIO * speed))
    if usual <= LONG_STEP * leg:
        yield Suggestion("walk.step_length", f"{usual:.2f}, usual at this speed", because)


def _reach(scenario: Scenario) -> Iterator[Suggestion]:
    """Find a step longer than people take."""
    step, leg = scenario.walk.step_length, scenario.subject.leg_length
    if step <= LONG_STEP * leg:
        return
    reach = 2.0 * leg * np.sin(np.deg2rad(STEP_HALF_ANGLE_DEG))
    because = (
        f"{step:g} m is {step / leg:.2f} leg lengths of {leg:.2f} m; "
        f"straight legs span {reach:.2f} m, people's longest steps are near {LONG_STEP * leg:.2f}"
    )
    yield Suggestion("walk.step_length", f"at most {LONG_STEP * leg:.2f}", because)


def _body(scenario: Scenario) -> Iterator[Suggestion]:
    """Find a body or a load that is out of proportion."""
    subject, load = scenario.subject, scenario.load.mass
    bmi = subject.mass / subject.stature**2
    if not BMI[0] <= bmi <= BMI[1]:
        allowed = subject.rule("mass")["range"]
        low, high = np.clip([bound * subject.stature**2 for bound in BMI], *allowed)
        because = f"{subject.mass:g} kg at {subject.stature:g} m is a BMI of {bmi:.0f} kg/m^2"
        yield Suggestion("subject.mass", f"{low:.0f} to {high:.0f} at this stature", because)
    if load > HEAVY_LOAD * subject.mass:
        because = f"{load:g} kg is {100.0 * load / subject.mass:.0f} % of the body mass"
        yield Suggestion("load.mass", f"at most {HEAVY_LOAD * subject.mass:.0f}", because)


def _phases(scenario: Scenario) -> Iterator[Suggestion]:
    """Find a step that hardly has two feet on the ground, or hardly one."""
    share, (least, most) = scenario.phases.double_support, DOUBLE_SUPPORT
    if not least <= share <= most:
        because = (
            f"both feet stand for {100.0 * share:.0f} % of the step, "
            f"people's for {100.0 * least:.0f} to {100.0 * most:.0f} %"
        )
        yield Suggestion("phases.double_support", f"{least:g} to {most:g}", because)


def _held(program: GaitProgram, solution: Solution, worst: Violation) -> Iterator[Suggestion]:
    """Find limits of the scenario that joints would have to pass to keep the worst row."""
    limits = program.scenario.limits
    found = _against_limits(program, solution, worst)
    frozen = [name for name, _ in found if name in limits.frozen]
    if frozen:
        joints = ", ".join(map(in_words, frozen))
        because = f"{joints}, held at 0, in the way of {worst.what}"
        yield Suggestion("limits.frozen", f"leave out {', '.join(frozen)}", because)
    for name, bound in found:
        because = f"{in_words(name)}, held at {bound}, is in the way of {worst.what}"
        if name in {limited.name for limited in limits.ranges}:
            yield Suggestion(f"limits.{name}", "a wider range", because)


def _against_limits(
    program: GaitProgram, solution: Solution, worst: Violation
) -> list[tuple[str, str]]:
    """Return the DOF at a limit that moving past it would reduce a violation, and the limit.

    The slope of the worst row tells which way each control point would have to go. Those that are
    at the limit on that side are stuck; a DOF counts if one of its control points has a slope of at
    least `_PART` of the largest.
    """
    constraint = next((c for c in program.constraints if c.demand == worst.demand), None)
    if constraint is None:  # the ends of the splines: no row of an instant
        return []
    P = solution.gait.control_points[: program.basis.n_free]
    value, jacobian = program.residual(constraint, P.ravel())
    excess = np.maximum(value - constraint.upper, constraint.lower - value)
    row = int(np.argmax(excess))
    side = -np.sign(value[row] - constraint.lower[row])  # 1 below the lower bound, else -1
    wanted = side * jacobian[row].reshape(P.shape)
    lower, upper = program.limits
    low, high = lower + FEASIBLE >= P, upper - FEASIBLE <= P
    stuck = np.where((wanted < 0.0) & low | (wanted > 0.0) & high, np.abs(wanted), 0.0)
    weight = stuck.max(axis=0)
    order = np.argsort(-weight)[: np.count_nonzero(weight > _PART * np.abs(wanted).max())]
    ends = np.where(low.any(axis=0), lower, upper)
    return [(DOF_NAMES[i], limit_text(ends[i], DOF_UNITS[i])) for i in order]


def _resolution(program: GaitProgram, worst: Violation) -> Iterator[Suggestion]:
    """Find splines of fewer pieces than usual, too stiff for what they have to do."""
    grid = program.scenario.discretisation
    usual = (
        type(grid)(periodicity=grid.periodicity).completed(program.scenario.about).control_points
    )
    if grid.control_points >= usual:
        return
    piece = program.basis.step_time / program.basis.n_pieces
    because = (
        f"{grid.control_points} are {program.basis.n_pieces} cubic pieces of {piece:.2f} s, "
        f"too stiff: {worst.what}, {amount(worst.value, worst.unit)} beyond its limit"
    )
    yield Suggestion("discretisation.control_points", f"{usual} or more", because)


def _between(program: GaitProgram, solution: Solution, failed: list[Check]) -> Iterator[Suggestion]:
    """Find what is kept at the instants of the grid, not between them."""
    grid, pieces = program.scenario.discretisation, program.basis.n_pieces
    if not (solution.converged or pieces > grid.intervals):
        return
    names = ", ".join(check.name for check in failed if check.kind is Kind.INSTANTS)
    if not names:
        return
    because = f"kept at {len(program.times)} instants, not between them: {names}"
    most = int(grid.rule("intervals")["range"][1])
    if grid.intervals < most:
        yield Suggestion("discretisation.intervals", f"{min(2 * grid.intervals, most)}", because)


def _periodicity(scenario: Scenario, failed: list[Check]) -> Iterator[Suggestion]:
    """Find a walk that jumps from step to step: what is not tied is not kept."""
    now = scenario.discretisation.periodicity
    names = [check.name for check in failed if check.kind is Kind.TIES]
    if now == "position" and names:
        because = f"postures alone are tied now: {', '.join(names)}"
        yield Suggestion("discretisation.periodicity", "velocity", because)


def _passing(scenario: Scenario, failed: list[Check]) -> Iterator[Suggestion]:
    """Find feet that are allowed to pass through each other."""
    usual, now = type(scenario.tolerances)().feet_apart, scenario.tolerances.feet_apart
    for check in failed:
        if check.kind is Kind.PASSING and now < usual:
            because = f"now {now:g} m: feet come closer by {amount(check.value, check.unit)}"
            yield Suggestion("tolerances.feet_apart", f"{usual:g} m", because)


def _friction(program: GaitProgram, failed: list[Check]) -> Iterator[Suggestion]:
    """Find a floor too slippery; shorter steps need less friction."""
    slips = [check for check in failed if check.kind is Kind.FRICTION]
    if not slips:
        return
    worst, scenario = max(slips, key=lambda check: check.value), program.scenario
    because = f"{worst.value:.2f} of friction is needed, the floor gives {worst.limit:g}"
    now, shortest = scenario.walk.step_length, scenario.walk.rule("step_length")["range"][0]
    if now > shortest:
        yield Suggestion("walk.step_length", f"shorter than {now:g} m", because)
    if worst.value <= scenario.ground.rule("friction")["range"][1]:
        yield Suggestion("ground.friction", f"at least {rounded_up(worst.value)}", because)


def _strength(program: GaitProgram, failed: list[Check]) -> Iterator[Suggestion]:
    """Find a person too weak; slower walking takes less."""
    weak = [check for check in failed if check.kind is Kind.STRENGTH]
    if weak and program.scenario.walk.speed > program.scenario.walk.rule("speed")["range"][0]:
        because = f"{weak[0].value:.2f} of the person's strength is needed"
        yield Suggestion("walk.speed", f"slower than {program.scenario.walk.speed:g} m/s", because)


def _relaxed(worst: Violation, program: GaitProgram) -> list[Suggestion]:
    """Return the tolerance that would accept what was found: of nothing else is known."""
    tolerance, scenario = worst.demand.tolerance, program.scenario
    if tolerance is None:
        return []
    key, sign = _own(tolerance.key, worst, program), 1.0 if tolerance.upwards else -1.0
    now, rule = getattr(scenario.tolerances, key), scenario.tolerances.rule(key)
    excess = np.rad2deg(worst.value) if worst.unit == "rad" else worst.value
    value = float(f"{now + sign * 1.1 * excess:.2g}")
    low, high = rule["range"]
    if not low <= value <= high:
        return []
    because = f"{worst.name} is the hardest to keep, by {amount(worst.value, worst.unit)}"
    return [Suggestion(f"tolerances.{key}", f"{value:g} {rule['unit']}, now {now:g}", because)]


def _solver(solution: Solution, broken: list[Violation], found: bool) -> Iterator[Suggestion]:
    """Suggest another way to solve, where that can help."""
    out_of_iterations = solution.status.startswith(("31", "32", "Max", "iteration"))
    if solution.converged or not (out_of_iterations or not found):
        return
    because = f"{solution.solver} stopped: {solution.status}"
    if solution.status.startswith(OUT_OF_TIME):
        yield Suggestion("--time-limit", "more seconds", because)
    if not broken:
        because += "; every constraint is kept"
        yield Suggestion("human-gait refine", "goes on from this motion", because)
    other = "snopt" if solution.solver == "newton" else "newton"
    yield Suggestion("--solver", other, because)


def _own(key: str, worst: Violation, program: GaitProgram) -> str:
    """Return the tolerance that a point of a foot has of its own, `key` if there is none."""
    tolerances = program.scenario.tolerances
    allowed = program.functions.walker.plan.allowed_speed(np.array([worst.time]))[0, LEFT]
    lands = allowed[HEEL if "heel" in worst.what else TOE] == tolerances.landing_speed
    applies = {
        "contact_height": key == "contact" and worst.what.endswith("height"),
        "toe_off_speed": key == "contact_speed" and worst.what.startswith("right toe"),
        "landing_speed": key == "contact_speed" and worst.what.startswith("left") and lands,
    }
    return next(
        (
            own
            for own, of_this in applies.items()
            if of_this and getattr(tolerances, own) != getattr(tolerances, key)
        ),
        key,
    )
