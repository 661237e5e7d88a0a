"""How hard a walk is: work of the joints, metabolic energy, lower back, share of strength."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from html import escape
from pathlib import Path
from typing import Any

from human_gait.scenario import Scenario
from human_gait.scenario.schema import HUMAN
from human_gait.values import Value
from human_gait.walk.gait import Gait, constrained_grid
from human_gait.walk.gait_file import gait_of
from human_gait.walk.joint_work import LEG, JointWork, joint_work
from human_gait.walk.metabolic import (
    ERROR,
    ERROR_LARGEST,
    ERROR_RMS,
    SPEEDS,
    MetabolicRate,
    metabolic_rate,
)
from human_gait.walk.strain import SpineMoment, StrengthShare, spine_moments, strength_shares

_NEAREST = 5  # axes that are told of those nearest to their strength


@dataclass(frozen=True, eq=False, repr=False)
class Energy(Value):
    """Energy of a walk and what it takes of the body, over one step of both legs.

    Numbers per kilogram are per mass of the body without a load, as laboratories have them; those
    per metre are per step length. ``print`` shows all of it.

    Attributes
    ----------
    mass, load : float, [kg]
        Of the body, and what it carries.
    step_length, step_time : float, [m] and [s]
    joints : tuple of JointWork
        Of both sides together, muscles and passive tissues, each axis of a joint by itself.
    metabolic : MetabolicRate
        By a model of joint torques; its error on people is ``metabolic_error``.
    spine : tuple of SpineMoment
        Of L5/S1.
    strength : tuple of StrengthShare
        All axes of the joints in both senses, that nearest to its mean strength first.
    effort : float, [N^2 m^2 s]
        Integral of the squared muscle torques, Eq. (18) without weights, at the instants that the
        optimiser saw.
    calibrated : bool
        Whether the metabolic model was calibrated on walks of this kind: by the formulation
        ``human``, without a load, at 0.7 to 1.8 m/s. Of others its error is not known.
    """

    mass: float
    load: float
    step_length: float
    step_time: float
    joints: tuple[JointWork, ...]
    metabolic: MetabolicRate
    spine: tuple[SpineMoment, ...]
    strength: tuple[StrengthShare, ...]
    effort: float
    calibrated: bool = True

    @property
    def positive_work(self) -> float:
        """Positive work of all joints in a step, [J]."""
        return sum(one.positive for one in self.joints)

    @property
    def negative_work(self) -> float:
        """Negative work of all joints in a step, [J], below zero."""
        return sum(one.negative for one in self.joints)

    @property
    def cost_of_transport(self) -> float:
        """Gross metabolic energy, [J/(kg m)]."""
        return self.per_kg_and_metre(self.metabolic.gross * self.step_time)

    @property
    def net_cost_of_transport(self) -> float:
        """Metabolic energy above that of standing, [J/(kg m)]."""
        return self.per_kg_and_metre(self.metabolic.net * self.step_time)

    @property
    def metabolic_error(self) -> float:
        """RMS error of the metabolic model, as a share, on the speeds of its calibration."""
        return ERROR_RMS

    @property
    def error_in_words(self) -> str:
        """What stands beside a metabolic number."""
        return ERROR if self.calibrated else "error not known"

    def per_kg_and_metre(self, of_a_step: float) -> float:
        """Return what a step takes, per kilogram of the body and metre of the way."""
        return of_a_step / (self.mass * self.step_length)

    def share_of_leg(self, joint: str) -> tuple[float, float]:
        """Return the shares of hip, knee or ankle in the positive and negative work of the legs.

        Raises
        ------
        KeyError
            If the joint is none of these.
        """
        legs = {one.joint: one for one in self.joints if one.joint in LEG}
        up, down = (
            sum(getattr(one, part) for one in legs.values()) for part in ("positive", "negative")
        )
        own = legs[joint]
        return _share(own.positive, up), _share(own.negative, down)

    def to_dict(self) -> dict[str, Any]:
        """Return all of it as plain values, names with their units: a part of ``summary.json``."""
        return {
            **_rate(self),
            **self._work("positive", self.positive_work),
            **self._work("negative", self.negative_work),
            "joints": {one.joint: self._joint(one) for one in self.joints},
            "l5s1": {one.axis.replace(" ", "_"): self._spine(one) for one in self.spine},
            "nearest_to_strength": [_strength(one) for one in self.strength[:_NEAREST]],
            "effort_N2_m2_s": self.effort,
            "effort_N2_m2_s_per_kg_m": self.per_kg_and_metre(self.effort),
        }

    def _work(self, sign: str, work: float) -> dict[str, float]:
        return {
            f"{sign}_work_J": work,
            f"{sign}_work_J_per_kg": work / self.mass,
            f"{sign}_work_J_per_kg_m": self.per_kg_and_metre(work),
        }

    def _joint(self, one: JointWork) -> dict[str, float]:
        work = {**self._work("positive", one.positive), **self._work("negative", one.negative)}
        if one.joint not in LEG:
            return work
        up, down = self.share_of_leg(one.joint)
        return work | {"share_of_leg_positive": up, "share_of_leg_negative": down}

    def _spine(self, one: SpineMoment) -> dict[str, float]:
        ends = {"greatest": one.greatest, "least": one.least, "mean": one.mean}
        per_kg = {f"{end}_Nm_per_kg": moment / self.mass for end, moment in ends.items()}
        return {f"{end}_Nm": moment for end, moment in ends.items()} | per_kg

    def __str__(self) -> str:
        return "\n".join([*headline(self), "", *_table(self)])

    def __repr__(self) -> str:
        return "\n".join(["Energy over one step", *(f"  {line}" for line in headline(self))])

    def _repr_html_(self) -> str:
        return f"<pre>{escape(str(self))}</pre>"


def energy(result: Gait | str | Path) -> Energy:
    """Tell how hard a walk is: work of the joints, metabolic energy, lower back, strength.

    Parameters
    ----------
    result : Gait, str or Path
        A gait, or the folder of a result, or its ``gait.npz``.

    Returns
    -------
    Energy
        ``print`` shows it.

    Raises
    ------
    ResultError
        If there is no gait that can be read.
    """
    gait = gait_of(result)
    now, subject = gait.fine_samples, gait.scenario.subject
    return Energy(
        subject.mass,
        gait.scenario.load.mass,
        gait.step_length,
        gait.step_time,
        joint_work(now),
        metabolic_rate(now, subject, gait.scenario.objective.tendon_stiffness),
        spine_moments(now),
        strength_shares(now, subject),
        effort(gait),
        _calibrated(gait.scenario),
    )


def _calibrated(scenario: Scenario) -> bool:
    """Tell whether a walk is of those that the metabolic model was calibrated on."""
    slowest, fastest = SPEEDS
    return (
        scenario.objective.formulation == HUMAN
        and scenario.load.mass == 0.0
        and slowest <= scenario.walk.speed <= fastest
    )


def effort(gait: Gait) -> float:
    """Return the integral of the squared muscle torques over a step, [N^2 m^2 s]."""
    _, spacing = constrained_grid(gait.scenario)
    return float(spacing @ (gait.seen_samples.active**2).sum(axis=1))


def headline(found: Energy) -> list[str]:
    """Return what matters most, in lines; effort comes last."""
    rate, extension, nearest = found.metabolic, found.spine[0], found.strength[0]
    up, down = (found.per_kg_and_metre(w) for w in (found.positive_work, found.negative_work))
    lines = {
        "metabolic cost": f"{found.cost_of_transport:.2f} J/(kg m) ({found.error_in_words}), "
        f"{rate.gross / found.mass:.2f} W/kg, of it standing {rate.standing / found.mass:.2f}",
        "work of the joints": f"{up:+.2f} and {down:+.2f} J/(kg m), "
        f"{found.positive_work:+.1f} and {found.negative_work:+.1f} J in a step",
        "L5/S1": f"extension moment {extension.least:.0f} to {extension.greatest:.0f} N m, "
        f"{extension.mean:.0f} on average",
        "nearest to strength": f"{nearest.joint}, {nearest.torque:.0f} N m, "
        f"{100.0 * nearest.share:.0f} % of {nearest.strength:.0f}",
        "effort": f"{found.effort:.1f} N^2 m^2 s",
    }
    return [f"{name}: {line}" for name, line in lines.items()]


def _table(found: Energy) -> list[str]:
    lines = [f"{'':10}{'positive':>10}{'negative':>10} J/(kg m){'share of the legs':>20}"]
    for one in found.joints:
        up, down = (found.per_kg_and_metre(w) for w in (one.positive, one.negative))
        of_leg = found.share_of_leg(one.joint) if one.joint in LEG else ()
        shares = "".join(f"{100.0 * share:8.0f} %" for share in of_leg)
        lines.append(f"{one.joint:10}{up:10.3f}{down:10.3f}{'':9}{shares}".rstrip())
    return lines


def _rate(found: Energy) -> dict[str, Any]:
    rate, mass = found.metabolic, found.mass
    return {
        "metabolic_cost_of_transport_J_per_kg_m": found.cost_of_transport,
        "metabolic_net_cost_of_transport_J_per_kg_m": found.net_cost_of_transport,
        "metabolic_rate_W": rate.gross,
        "metabolic_rate_W_per_kg": rate.gross / mass,
        "metabolic_parts_W_per_kg": {part: watt / mass for part, watt in asdict(rate).items()},
        "metabolic_error": {"rms": ERROR_RMS, "largest": ERROR_LARGEST},
    }


def _strength(one: StrengthShare) -> dict[str, Any]:
    return {
        "joint": one.joint,
        "torque_Nm": one.torque,
        "strength_Nm": one.strength,
        "share": one.share,
    }


def _share(part: float, whole: float) -> float:
    return part / whole if whole else 0.0
