"""Makes the plug-ins whose parameters were read: each group of parameters has one class that works with it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TypeVar

import numpy as np

from clearway.navigators.nav2.controllers.dwb.controller import DWB
from clearway.navigators.nav2.controllers.dwb.parameters import DWBParameters
from clearway.navigators.nav2.controllers.mppi.controller import MPPIController
from clearway.navigators.nav2.controllers.mppi.parameters import MPPIParameters
from clearway.navigators.nav2.controllers.parameters import RegulatedPurePursuitParameters, RotationShimParameters
from clearway.navigators.nav2.controllers.regulated_pure_pursuit import RegulatedPurePursuit
from clearway.navigators.nav2.controllers.rotation_shim import RotationShim
from clearway.navigators.nav2.parameters.branch import Branch
from clearway.navigators.nav2.parameters.group import Group
from clearway.navigators.nav2.planners.navfn import Navfn
from clearway.navigators.nav2.planners.parameters import (
    NavfnParameters,
    Smac2DParameters,
    SmacHybridParameters,
    SmootherParameters,
)
from clearway.navigators.nav2.planners.smac_2d import Smac2D
from clearway.navigators.nav2.planners.smac_hybrid import SmacHybrid
from clearway.navigators.nav2.seams import Controller, Planner

_Plugin = TypeVar("_Plugin")


def chosen(name: str, plugins: Mapping[str, _Plugin]) -> _Plugin | None:
    """A server's plug-in of that name, of an empty one its only plug-in; None: it has none such."""
    return next(iter(plugins.values())) if not name and len(plugins) == 1 else plugins.get(name)


def make_controller(branch: Branch, frequency: float, rng: np.random.Generator) -> Controller:
    """The controller whose parameters these are.

    Args:
        branch: Its parameters, with those inside them.
        frequency: Of the controller server, Hz.
        rng: It may draw from.

    Raises:
        TypeError: they are those of something else.
    """
    match branch.group:
        case RegulatedPurePursuitParameters() as group:
            return RegulatedPurePursuit(group, 1.0 / frequency)
        case RotationShimParameters() as group:
            primary = make_controller(branch.children["primary_controller"], frequency, rng)
            return RotationShim(group, primary, 1.0 / frequency)
        case MPPIParameters() as group:
            spaces = {name: child.group for name, child in branch.children.items()}
            return MPPIController(group, spaces, frequency, rng)
        case DWBParameters() as group:
            return DWB(group, {name: child.group for name, child in branch.children.items()}, 1.0 / frequency)
    raise _none("controller", branch.group)


def make_planner(branch: Branch) -> Planner:
    """The planner whose parameters these are.

    Raises:
        TypeError: they are those of something else.
    """
    match branch.group:
        case NavfnParameters() as group:
            return Navfn(group)
        case Smac2DParameters() as group:
            return Smac2D(group, _smoother(branch))
        case SmacHybridParameters() as group:
            return SmacHybrid(group, _smoother(branch))
    raise _none("planner", branch.group)


def _smoother(branch: Branch) -> SmootherParameters | None:
    child = branch.children.get("smoother")
    return child.group if child is not None and isinstance(child.group, SmootherParameters) else None


def top_speed(branch: Branch) -> float:
    """The greatest speed forwards that a controller is allowed by its parameters, m/s; inf where it has no such bound."""
    match branch.group:
        case RegulatedPurePursuitParameters() as group:
            return group.full_speed
        case RotationShimParameters():
            return top_speed(branch.children["primary_controller"])
        case MPPIParameters() as group:
            return group.vx_max
        case DWBParameters() as group:
            return min(group.max_vel_x, group.max_speed_xy) if group.max_speed_xy >= 0.0 else group.max_vel_x
    return float("inf")


def _none(role: str, group: Group) -> TypeError:
    return TypeError(f"{type(group).__name__} is no group of a {role}")
