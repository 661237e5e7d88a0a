"""Which part of which foot stands where and when, during the step from left to right heel strike.

The right foot trails: its ball stays down until `ball_off`, its toes until the end of double
support, then it swings.
The left foot leads: heel down at 0, flat at `foot_flat`, heel up at `heel_off`, ball and toes down
until T and on. Feet point straight ahead, so their support regions are boxes in x and z.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from human_gait.arrays import BoolArray, FloatArray, IntArray
from human_gait.body.dh import frames
from human_gait.body.links import FootPoints
from human_gait.body.person import Body
from human_gait.body.skeleton import GRAVITY, N_DOF, SIDES, index
from human_gait.scenario import Scenario
from human_gait.values import Value

RIGHT, LEFT = 0, 1
HEEL, BALL_MEDIAL, BALL_LATERAL, TOE = range(4)

# Where double support hands the load over (points A and B of Eq. 17), from its start to its end.
# The paper takes the middle joints of the feet. A foot that stands on its heel alone cannot carry
# at its middle joint: here A moves under the toes, B from the heel towards the ankle, as the
# scenario has it (`ground.loading`).
_TRAILING = (0.15, 0.75, 0.85)  # from ball to toe tip: at strike, ball off and the end
_LANDING = 0.05  # of the step: how long a foot that has come down flat still settles
_AROUND = [0, 1, 2, 2, 1, 0]  # heel, ball or toes: the part that each corner of the outline is of
_BALL_CORNERS = [1, 4]
_STRAIGHT = 1e-12  # [m^2]: no corner


@dataclass(frozen=True, eq=False)
class Foot(Value):
    """The sole of one foot that stands flat; measures along z from the ankle [m].

    Attributes
    ----------
    points, outline : (n, 3) array, [m]
        Contact points and corners of the sole from the point of the ground below the ankle.
    """

    points: FloatArray
    outline: FloatArray

    @property
    def heel(self) -> float:
        """Back of the heel."""
        return float(self.points[HEEL, 2])

    @property
    def ball(self) -> float:
        """Axis of the metatarsal heads."""
        return float(self.points[BALL_MEDIAL, 2])

    @property
    def toe(self) -> float:
        """Tip of the toes."""
        return float(self.points[TOE, 2])

    @property
    def length(self) -> float:
        """Heel to toe tip."""
        return self.toe - self.heel

    @property
    def half_breadth(self) -> float:
        """Half the breadth of the heel, the narrowest part that carries."""
        return float(np.ptp(self.outline[[0, -1], 0]) / 2)


class Support(NamedTuple):
    """How the feet stand at K instants.

    Attributes
    ----------
    both : (K,) bool array
        Whether both do.
    A, B : (K, 2) array, [m]
        x and z of the points between which the load passes, Eq. (17): trailing and leading foot.
    """

    both: BoolArray
    A: FloatArray
    B: FloatArray


class ContactPlan:
    """Contacts, footholds and support regions of one scenario."""

    def __init__(self, scenario: Scenario, body: Body) -> None:
        self.walk, self.phases = scenario.walk, scenario.phases
        height = scenario.ground.pivot_height * scenario.subject.stature
        self.spread = 0.0 if scenario.ground.sharing == "parallel" else 1.0 / height
        """How far the forces of both feet lean towards each other, per distance, [1/m]."""
        self.least_effort = scenario.ground.sharing == "least_effort"
        """Whether they lean as takes the muscles least: more or less than `spread`."""
        self.tolerances = scenario.tolerances
        self.loading = scenario.ground.loading
        """Where the leading foot takes the load, of the way from heel to ankle: three events."""
        self.pad = scenario.ground.pad
        """Depth of what carries of a heel or of toes that stand alone, of the foot's length."""
        self.margin = scenario.tolerances.zmp_margin
        self.friction = scenario.ground.friction
        self.weight = body.total_mass * GRAVITY
        """Weight of body and load, [N]."""
        self.feet = tuple(Foot(*pair) for pair in zip(*_soles(body), strict=True))
        half = np.array([self.walk.step_width, self.walk.step_length]) / 2
        self.ankles = np.array([[-half[0], 0.0, -half[1]], [half[0], 0.0, half[1]]])
        """(2, 3) points of the ground below the ankles of the standing feet, right and left."""

        self._support: tuple[FloatArray, Support] | None = None

    def support(self, times: FloatArray) -> Support:
        """Return how the feet stand at times (K,); those of the last ones are kept."""
        if self._support is None or self._support[0] is not times:
            A, B = (point[:, [0, 2]] for point in self.transfer_points(times))
            self._support = times, Support(self.double_support(times), A, B)
        return self._support[1]

    @property
    def footholds(self) -> FloatArray:
        """Where the contact points stand, (2, 4, 3), [m]: the x~ of Eq. (21)."""
        return np.stack([self.ankles[f] + self.feet[f].points for f in (RIGHT, LEFT)])

    @property
    def balls(self) -> FloatArray:
        """Forward position of the metatarsal heads of the standing feet, (2,), [m]."""
        return self.footholds[:, BALL_MEDIAL, 2]

    def fraction(self, times: FloatArray) -> FloatArray:
        """Return t / T, freed of rounding so that an event on the grid belongs to its instant."""
        return np.round(np.asarray(times) / self.walk.step_time, 9)

    def double_support(self, times: FloatArray) -> BoolArray:
        """Return (K,) true while both feet stand."""
        return self.fraction(times) <= self.phases.double_support

    def contact(self, times: FloatArray) -> BoolArray:
        """Return (K, 2, 4) true where a contact point stands."""
        s, phases = self.fraction(times), self.phases
        touching = np.zeros((len(s), 2, 4), dtype=bool)
        touching[:, RIGHT, BALL_MEDIAL:TOE] = (s <= phases.ball_off)[:, None]
        touching[:, RIGHT, TOE] = s <= phases.double_support
        touching[:, LEFT, HEEL] = s <= phases.heel_off
        touching[:, LEFT, BALL_MEDIAL:] = (s >= phases.foot_flat)[:, None]
        return touching

    def allowed_speed(self, times: FloatArray) -> FloatArray:
        """Return how fast each contact point that stands may move, (K, 2, 4), [m/s], Eq. (24).

        The heel of the leading foot comes down with some speed, its ball and toes too, and the toe
        tip of the trailing foot rolls off.
        """
        s, flat, tolerances = self.fraction(times), self.phases.foot_flat, self.tolerances
        allowed = np.full((len(s), 2, 4), tolerances.contact_speed)
        landing = (flat <= s) & (s < flat + _LANDING)
        allowed[landing, LEFT, BALL_MEDIAL:] = tolerances.landing_speed
        allowed[s < _LANDING, LEFT, HEEL] = tolerances.landing_speed
        allowed[:, RIGHT, TOE] = tolerances.toe_off_speed
        return allowed

    def pressure_region(self, times: FloatArray) -> FloatArray:
        """Return the bounds (K, 2, 2, 2) of each foot's centre of pressure, [m].

        Axes: instant, foot, lower or upper, x or z. Their hull is the foot support region of
        Eq. (22). From `heel_unloading` on the pressure leaves the heel: the rear bound moves
        evenly to the ball, where it has to be at `heel_off`.
        """
        s = self.fraction(times)
        region = np.empty((len(s), 2, 2, 2))
        for f in (RIGHT, LEFT):
            breadth = self.feet[f].half_breadth - self.margin
            region[:, f, :, 0] = self.ankles[f, 0] + np.array([-breadth, breadth])
        trailing = self.feet[RIGHT]
        on_toes = trailing.toe - self.pad * trailing.length
        region[:, RIGHT, 0, 1] = np.where(s <= self.phases.ball_off, trailing.ball, on_toes)
        region[:, RIGHT, 1, 1] = trailing.toe - self.margin
        region[:, LEFT, 0, 1] = self._rear(s)
        region[:, LEFT, 1, 1] = self._front(s)
        region[..., 1] += self.ankles[:, None, 2]
        return region

    def _rear(self, s: FloatArray) -> FloatArray:
        foot, phases = self.feet[LEFT], self.phases
        heel, ball = foot.heel + self.margin, foot.ball
        return np.interp(s, [phases.heel_unloading, phases.heel_off], [heel, ball])

    def _front(self, s: FloatArray) -> FloatArray:
        foot = self.feet[LEFT]
        flat = s >= self.phases.foot_flat
        return np.where(flat, foot.toe - self.margin, foot.heel + self.pad * foot.length)

    def transfer_points(self, times: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the points A (trailing) and B (leading) of Eq. (17), each (K, 3), [m]."""
        s, phases = self.fraction(times), self.phases
        trailing, leading = self.feet[RIGHT], self.feet[LEFT]
        A, B = (np.tile(ankle, (len(s), 1)) for ankle in self.ankles)
        under_toes = np.interp(s, [0.0, phases.ball_off, phases.double_support], _TRAILING)
        ahead = np.interp(s, [0.0, phases.foot_flat, phases.double_support], self.loading)
        A[:, 2] += trailing.ball + under_toes * (trailing.toe - trailing.ball)
        B[:, 2] += leading.heel * (1.0 - ahead)
        return A, B

    def outline(self, step: int) -> tuple[int, FloatArray]:
        """Return side and corners (6, 3) [m] of the foot put down at the start of a step.

        Step 0 puts down the left foot, step 1 the right foot; step -1 is the trailing right foot.
        """
        side = RIGHT if step % 2 else LEFT
        forward = (step if side == LEFT else step + 1) * self.walk.step_length
        foothold = self.ankles[side] + np.array([0.0, 0.0, forward])
        return side, foothold + self.feet[side].outline

    def support_polygon(self, time: float, feet: tuple[int, ...] = (RIGHT, LEFT)) -> FloatArray:
        """Return the corners (n, 2) of the support region of feet, x and z, [m], at 0 <= t <= T.

        Of both it is the foot support region. At least one of `feet` has to stand.
        """
        return self._region(feet, self.contact(np.array([time]))[0])

    def support_regions(
        self, times: FloatArray, feet: tuple[int, ...] = (RIGHT, LEFT)
    ) -> Iterator[tuple[IntArray, FloatArray]]:
        """Yield the instants whose support region of feet is the same, and its corners (n, 2), [m].

        Without corners where none of the feet stands.
        """
        touching = self.contact(times)
        parts, part = np.unique(
            touching[:, feet].reshape(len(times), -1), axis=0, return_inverse=True
        )
        for k in range(len(parts)):
            instants = np.flatnonzero(part.ravel() == k)
            yield instants, self._region(feet, touching[instants[0]])

    def turning_radius(self, times: FloatArray) -> FloatArray:
        """Return the radius of gyration (K,) of the foot support region, [m].

        Spread over the region, a vertical force N holds it against turning by up to about mu N r.
        """
        radius = np.empty(len(times))
        for instants, corners in self.support_regions(times):
            radius[instants] = radius_of_gyration(corners)
        return radius

    def _region(self, feet: tuple[int, ...], touching: BoolArray) -> FloatArray:
        return _hull(np.concatenate([self._standing_corners(f, touching[f]) for f in feet]))

    def _standing_corners(self, f: int, touching: BoolArray) -> FloatArray:
        """Return the corners (n, 2) of the parts of a foot that stand, x and z, [m].

        The outline goes round the sole: heel, ball and toes of one side, then toes, ball and heel
        of the other. What touches gives its two corners. Heel or toes alone would be a line: they
        carry on a pad, `pad` of the foot's length deep, whose other two corners lie on the edges
        of the sole towards the ball.
        """
        foot, ball = self.feet[f], touching[BALL_MEDIAL]
        down = np.array([touching[HEEL], ball, touching[TOE]])
        corners = foot.outline[down[_AROUND]]
        if down.any() and not ball:
            to_ball = foot.outline[_BALL_CORNERS] - corners
            part = (
                self.pad * foot.length / np.abs(to_ball[:, 2:])
            )  # of the way, whose length is in z
            corners = np.concatenate([corners, corners + part * to_ball])
        return np.asarray((self.ankles[f] + corners)[:, [0, 2]])


def _soles(body: Body) -> tuple[FloatArray, FloatArray]:
    """Return contact points and outlines of both feet, each (2, n, 3), from below the ankles."""
    P, A = frames(body.table, np.zeros(N_DOF))
    ankles = np.stack([P[index(f"ankle_dorsiflexion_{side}"), :3, 3] for side in SIDES])
    return tuple(_placed(A, points) - _ground(ankles, body) for points in _point_sets(body))  # type: ignore[return-value]


def _point_sets(body: Body) -> tuple[FootPoints, FootPoints]:
    return body.contact, body.outline


def _placed(A: FloatArray, points: FootPoints) -> FloatArray:
    local = np.concatenate([points.points, np.ones((*points.points.shape[:-1], 1))], axis=-1)
    return np.asarray(np.einsum("fnij,fnj->fni", A[points.links], local)[..., :3])


def _ground(ankles: FloatArray, body: Body) -> FloatArray:
    below = ankles - [0.0, body.measures.lengths["h_ank"], 0.0]
    return np.asarray(below[:, None])


def radius_of_gyration(polygon: FloatArray) -> float:
    """Return the radius of gyration of the area of a polygon (n, 2) about its centroid."""
    corner = polygon - polygon.mean(axis=0)
    after = np.roll(corner, -1, axis=0)
    cross = corner[:, 0] * after[:, 1] - corner[:, 1] * after[:, 0]
    area = cross.sum() / 2
    centroid = np.sum(cross[:, None] * (corner + after), axis=0) / (6 * area)
    polar = np.sum(cross[:, None] * (corner**2 + corner * after + after**2)) / 12
    return float(np.sqrt(polar / area - centroid @ centroid))


def _hull(points: FloatArray) -> FloatArray:
    """Return the corners (m, 2) of the convex hull of points (n, 2), all around.

    A. M. Andrew, Information Processing Letters 9 (1979): each side of the hull turns one way only.
    """
    rising = sorted(map(tuple, points.tolist()))
    return np.array([*_turning_left(rising), *_turning_left(rising[::-1])]).reshape(-1, 2)


def _turning_left(points: list[tuple[float, ...]]) -> list[tuple[float, ...]]:
    side: list[tuple[float, ...]] = []
    for x, z in points:
        while len(side) > 1:
            (x0, z0), (x1, z1) = side[-2:]
            if (x1 - x0) * (z - z0) - (z1 - z0) * (x - x0) > _STRAIGHT:
                break
            side.pop()
        side.append((x, z))
    return side[:-1]
