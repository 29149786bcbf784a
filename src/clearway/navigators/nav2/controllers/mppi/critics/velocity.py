"""Critics of velocities: ConstraintCritic, PreferForwardCritic, TwirlingCritic, VelocityDeadbandCritic.

Behaviour after nav2_mppi_controller/src/critics/{constraint,prefer_forward,twirling,velocity_deadband}_critic.cpp.
"""

from __future__ import annotations

import numpy as np

from clearway.geometry.compiled import kernel
from clearway.navigators.common.mppi.functions import ZERO, Floats
from clearway.navigators.nav2.controllers.mppi.critics.rollouts import Rollouts, add
from clearway.navigators.nav2.controllers.mppi.parameters import (
    ConstraintParameters,
    MPPIParameters,
    PreferForwardParameters,
    TwirlingParameters,
    VelocityDeadbandParameters,
)

_LEAST_RATE = np.float32(1e-6)


class ConstraintCritic:
    """Speeds beyond the limits of the file (a speed limit doesn't count), curves narrower than a car can turn."""

    def __init__(self, parameters: ConstraintParameters, controller: MPPIParameters) -> None:
        self._parameters = parameters
        self._vx = np.float32(controller.vx_min), np.float32(controller.vx_max)
        self._vy = np.float32(controller.vy_max)

    def score(self, rollouts: Rollouts, costs: Floats) -> bool:
        """See `Critic`."""
        least, most = self._vx
        term = np.zeros_like(costs)
        excess_speed(rollouts.samples.vx, least, most, rollouts.dt, term)
        if rollouts.holonomic:
            excess_speed(rollouts.samples.vy, -self._vy, self._vy, rollouts.dt, term)
        if rollouts.radius > 0.0:
            excess_curvature(rollouts.samples.vx, rollouts.samples.wz, rollouts.radius, rollouts.dt, term)
        add(costs, term, self._parameters.cost_weight, self._parameters.cost_power)
        return False


class PreferForwardCritic:
    """Way driven backwards, but near the goal."""

    def __init__(self, parameters: PreferForwardParameters, controller: MPPIParameters) -> None:
        self._parameters = parameters

    def score(self, rollouts: Rollouts, costs: Floats) -> bool:
        """See `Critic`."""
        if rollouts.length >= self._parameters.threshold_to_consider:
            term = np.zeros_like(costs)
            excess_speed(rollouts.samples.vx, ZERO, np.float32(np.inf), rollouts.dt, term)
            add(costs, term, self._parameters.cost_weight, self._parameters.cost_power)
        return False


class TwirlingCritic:
    """Turning, until the goal checker's tolerance is reached."""

    def __init__(self, parameters: TwirlingParameters, controller: MPPIParameters) -> None:
        self._parameters = parameters

    def score(self, rollouts: Rollouts, costs: Floats) -> bool:
        """See `Critic`."""
        if rollouts.length >= rollouts.tolerances.xy:
            term = np.zeros_like(costs)
            mean_turning(rollouts.samples.wz, term)
            add(costs, term, self._parameters.cost_weight, self._parameters.cost_power)
        return False


class VelocityDeadbandCritic:
    """Velocities that the base's motors don't follow, since they are too small."""

    def __init__(self, parameters: VelocityDeadbandParameters, controller: MPPIParameters) -> None:
        self._parameters = parameters
        self._deadband = tuple(np.float32(abs(v)) for v in parameters.deadband_velocities)

    def score(self, rollouts: Rollouts, costs: Floats) -> bool:
        """See `Critic`."""
        samples, term = rollouts.samples, np.zeros_like(costs)
        lacking_speed(samples.vx, self._deadband[0], rollouts.dt, term)
        if rollouts.holonomic:
            lacking_speed(samples.vy, self._deadband[1], rollouts.dt, term)
        lacking_speed(samples.wz, self._deadband[2], rollouts.dt, term)
        add(costs, term, self._parameters.cost_weight, self._parameters.cost_power)
        return False


@kernel
def excess_speed(velocity: Floats, least: np.float32, most: np.float32, dt: np.float32, term: Floats) -> None:
    """Add to `term` (B,) the way that each sample drives beyond `least` and `most`."""
    steps, batch = velocity.shape
    for t in range(steps):
        row = velocity[t]
        for b in range(batch):
            over, under = row[b] - most, least - row[b]
            over = over if over > ZERO else ZERO
            under = under if under > ZERO else ZERO
            term[b] += (over + under) * dt


@kernel
def excess_curvature(vx: Floats, wz: Floats, radius: np.float32, dt: np.float32, term: Floats) -> None:
    """Add to `term` (B,) by how much each sample's radii fall short of `radius`, m s."""
    steps, batch = vx.shape
    for t in range(steps):
        v, w = vx[t], wz[t]
        for b in range(batch):
            rate = abs(w[b])
            rate = rate if rate > _LEAST_RATE else _LEAST_RATE
            short = radius - abs(v[b]) / rate
            term[b] += (short if short > ZERO else ZERO) * dt


@kernel
def mean_turning(wz: Floats, term: Floats) -> None:
    """Add to `term` (B,) the mean of |wz|."""
    steps, batch = wz.shape
    total = np.zeros(batch, np.float32)
    for t in range(steps):
        row = wz[t]
        for b in range(batch):
            total[b] += abs(row[b])
    for b in range(batch):
        term[b] += total[b] / np.float32(steps)


@kernel
def lacking_speed(velocity: Floats, deadband: np.float32, dt: np.float32, term: Floats) -> None:
    """Add to `term` (B,) by how much each sample's speeds stay below `deadband`."""
    steps, batch = velocity.shape
    for t in range(steps):
        row = velocity[t]
        for b in range(batch):
            short = deadband - abs(row[b])
            term[b] += (short if short > ZERO else ZERO) * dt
