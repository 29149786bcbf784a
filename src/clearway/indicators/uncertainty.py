"""DE_U, OE_U, MDO_U: how far off DE, OE and MDO may be because the poses were measured.

Expanded uncertainties in the sense of the GUM (JCGM 100:2008): U = 2 u, coverage factor k = 2, about 95 %; the value
lies within +- U. They follow from the standard uncertainties of the poses (`Trial.sigma`) at the instants that the
value hangs on, to first order:

- DE: of the position at the leg's end; OE: of the heading there. The goal is where the test put it, without error: what
  is uncertain about the map itself has its place in the pose's own uncertainty.
- MDO: of robot and obstacle where they were closest, in quadrature; the heading of a polygon moves its outline by up to
  its circumscribed radius, which is taken as its lever arm; a disc's does not matter. Where one capture saw both, the
  tie of its frame to the map cancels between them.
- The mean over the legs of a trial: their errors are taken as common to both (the same capture, frame and markers), so
  they do not average out; the uncertainty of the mean is the mean of the uncertainties.

A simulation knows its poses: 0. A recording that does not say how sure it is has none.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from statistics import fmean

import numpy as np

from clearway.geometry.distance import path_clearance
from clearway.geometry.shapes import Circle, Shape, circumscribed_radius
from clearway.indicators.clearance import Scene, clearances, minimum_distance, scenes
from clearway.indicators.goal_error import distance_error, orientation_error
from clearway.indicators.indicator import Indicator, Measure, NotComputable, measure
from clearway.indicators.legs import DrivenLeg, finished
from clearway.trials import Trial

COVERAGE = 2.0
"""k of the expanded uncertainty."""


def shown_digits(u: float, digits: int) -> int:
    """How many decimals show an uncertainty `u` > 0: `digits`, and more (up to 6) where it would be shown as 0."""
    return next((d for d in range(digits, 6) if round(u, d) > 0), 6)


def without(whole: float, part: float) -> float:
    """The standard uncertainty that is left of `whole` once its independent `part` is taken out."""
    return math.sqrt(max(whole * whole - part * part, 0.0))


def end_uncertainty(trial: Trial, drive: DrivenLeg, what: str) -> float:
    """Expanded uncertainty of `DE` [m] or `OE` [rad] at the end of one leg.

    Raises:
        NotComputable: nobody knows it.
    """
    if trial.attempt.source == "simulated":
        return 0.0
    return COVERAGE * pose_uncertainty(drive, len(drive.t) - 1, 0, 0 if what == "DE" else 1)


def pose_uncertainty(
    drive: DrivenLeg, sample: int, column: int, which: int, whose: str = "", *, among: bool = False
) -> float:
    """Standard uncertainty of position (`which` 0, m) or heading (1, rad); column 0 is the robot, 1 the first moving_obstacle.
    `among`: of what was measured in one frame, without the tie of that frame to the map, in which all are off alike."""
    of = ("pose", "heading")[which] + (f" of {whose}" if whose else "")
    value = math.nan if drive.sigma is None else float(drive.sigma[sample, column, which])
    if not math.isfinite(value):
        raise NotComputable(f"the uncertainty of the {of} is unknown")
    return without(value, _tie(drive, sample, which)) if among else value


def _tie(drive: DrivenLeg, sample: int, which: int) -> float:
    return 0.0 if drive.tie is None else float(drive.tie[sample, which])


def _of_ends(what: str, error: Callable[[DrivenLeg], float]) -> Measure:
    @measure
    def mean(trial: Trial) -> float:
        drives = finished(trial)
        for drive in drives:
            error(drive)
        return fmean(end_uncertainty(trial, drive, what) for drive in drives)

    return mean


@measure
def of_minimum_distance(trial: Trial) -> float:
    """Expanded uncertainty of MDO, m."""
    found = minimum_distance(trial)
    if found.value is None:
        raise NotComputable(found.why)
    if trial.attempt.source == "simulated":
        return 0.0
    parts = scenes(trial)
    nearest = [clearances(scene) for scene in parts]
    k = int(np.argmin([gaps.min() for gaps in nearest]))
    return COVERAGE * _of_gap(parts[k], int(np.argmin(nearest[k])))


def _of_gap(scene: Scene, sample: int) -> float:
    """Standard uncertainty of the distance from the nearest body between `sample` and the next one, m."""
    together = any(run.start <= sample < run.stop - 1 for run in scene.runs())
    two = slice(sample, sample + 1 + together)
    moving = [b for b in scene.bodies if b.pose is None]
    gaps = []
    for body in scene.bodies:
        k = moving.index(body) if body in moving else None
        moving_obstacles = scene.moving_obstacles[two, :0] if k is None else scene.moving_obstacles[two, k : k + 1]
        gaps.append(float(path_clearance(scene.footprint, scene.path[two], [body], moving_obstacles)[0]))
    body = scene.bodies[int(np.argmin(gaps))]
    last = sample + together

    def worse(column: int, shape: Shape, whose: str, there: list[int]) -> float:
        """Of either end of the step, of the position and of the outline that turns with the heading."""
        lever = 0.0 if isinstance(shape, Circle) else circumscribed_radius(shape)
        return max(
            math.hypot(
                pose_uncertainty(scene.drive, at, column, 0, whose, among=body.measured),
                lever * pose_uncertainty(scene.drive, at, column, 1, whose, among=body.measured) if lever else 0.0,
            )
            for at in there
        )

    own = worse(0, scene.footprint, "", [sample, last])
    if body.pose is not None:
        return math.hypot(own, without(body.sigma, _tie(scene.drive, last, 0)) if body.measured else body.sigma)
    k = moving.index(body)
    there = [at for at in (sample, last) if np.isfinite(scene.moving_obstacles[at, k, :2]).all()]
    return math.hypot(own, worse(1 + scene.columns[k], body.shape, body.name, there))


GUM = "JCGM 100 (GUM): expanded uncertainty, k = 2, about 95 %"

ALL = (
    Indicator("DE_U", "uncertainty of DE", "m", GUM, "neither", _of_ends("DE", distance_error)),
    Indicator("OE_U", "uncertainty of OE", "rad", GUM, "neither", _of_ends("OE", orientation_error)),
    Indicator("MDO_U", "uncertainty of MDO", "m", GUM, "neither", of_minimum_distance),
)
