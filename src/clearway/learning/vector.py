"""Gymnasium's environment of many worlds that are stepped in one kernel."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from numbers import Integral
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numba.typed import List

from clearway.errors import ClearwayError, shown
from clearway.geometry.raycast import beams, scene
from clearway.geometry.shapes import FloatArray
from clearway.geometry.streams import stream
from clearway.learning import lanes
from clearway.learning.environment import View, split, view
from clearway.learning.episode import Episode, equipment_of
from clearway.learning.lanes import HIT, LEG, PERIODS, VERDICT, Lane, Phase, Told
from clearway.learning.rewards import END, SECOND, default_reward, numbers_of, refuse_no_reward
from clearway.learning.scenes import Scenes
from clearway.learning.spaces import action_space, observation_space
from clearway.navigators.learnt.encoding import Numbers, axes, bounds, cuts
from clearway.scenarios.scenario import Scenario
from clearway.scenarios.suite import Suite
from clearway.trials import Outcome
from clearway.world.goal_and_progress_checker import Verdict, begin_leg
from clearway.world.legs import Legs
from clearway.world.lidar import Errors
from clearway.world.lidar import View as Lidar

Observed: TypeAlias = dict[str, Numbers] | Numbers
ASKED = "asked"
"""Stands for a crowd where not one compiled crowd decides for all."""
_PLACES = ("truth", "odometry")
_ENDS = {Verdict.REACHED: Outcome.REACHED, Verdict.TIMEOUT: Outcome.TIMEOUT, Verdict.LIVELOCK: Outcome.LIVELOCK}


class Steps(NamedTuple):
    """A control period of n worlds that is over. At the end of an episode its row is as `Step` has it: nothing more is perceived, and but for a
    contact nothing was driven.

    Attributes:
        before: (n,) how far from its goal each robot was where it began, by the truth, m.
        after: (n,) how far from the same goal it was where it ended, m.
        leg_reached: (n,) whether a leg other than the last was reached.
        outcome: (n,) how each episode ended with it; None: it goes on.
        seen: (n, m) what is perceived at its end, in a row; what was perceived last where the episode ended with it.
        action: (n, k) what was said.
        period: How long it is, s.
    """

    before: FloatArray
    after: FloatArray
    leg_reached: npt.NDArray[np.bool_]
    outcome: list[Outcome | None]
    seen: Numbers
    action: Numbers
    period: float


Rewards: TypeAlias = Callable[[Steps], FloatArray]


def default_rewards(steps: Steps) -> FloatArray:
    """`default_reward` of each."""
    ends = np.where(steps.leg_reached, END, 0.0)
    for i, outcome in enumerate(steps.outcome):
        if outcome == Outcome.REACHED:
            ends[i] = END
        elif outcome not in (None, Outcome.TIMEOUT):
            ends[i] = -END
    return steps.before - steps.after - SECOND * steps.period + ends


def make_vec(
    suite: Any, robot: Any = None, *, num_envs: int = 1, reward: Rewards = default_rewards, **options: Any
) -> Lanes:
    """Many environments like that of `make`, stepped in one kernel; an episode that is over begins anew in the same step.

    What takes Python at each step is refused: localisation by `amcl`, latency (say `latency=0.0`), obstacles that are not told exactly
    (of a robot with such a camera and `tracking="difference"` they are), and people or obstacles whose behaviour is not one
    compiled crowd; so are scenarios of which some have such a crowd and some none. `gymnasium.make_vec(..., vectorization_mode="async")` steps those.

    Args:
        suite: As `make` has it.
        robot: The same.
        num_envs: How many.
        reward: What a control period is worth to each: a function of `Steps`.
        options: As `make` has them, but for `indicators`: no trial is kept here.

    Raises:
        ClearwayError: one of them is wrong, or takes Python at each step.
    """
    options, where = split(options)
    if options.pop("indicators", False):
        raise ClearwayError(
            "True is not to be had, as no trial is kept here; leave it out, or take `make`", field="indicators"
        )
    if not isinstance(num_envs, Integral) or isinstance(num_envs, bool) or num_envs < 1:
        raise ClearwayError(f"{num_envs!r} is no number of environments; 1 or more are", field="num_envs")
    refuse_no_reward(reward)
    return Lanes(
        Scenes(suite, robot, where), view(**options, reward=default_reward, indicators=False), int(num_envs), reward
    )


class Lanes(VectorEnv[Observed, Numbers, Any]):
    """n worlds, each with one robot.

    `infos` says of those whose episode is over what they saw last (`final_obs`) and, in `final_info`, its `outcome`; and of those that
    begin which `scenario` it is.

    Args:
        scenes: Which scenarios they meet.
        view: What is seen and said.
        n: How many.
        reward: Of a control period.

    Attributes:
        most: (n, k) the most that the base can do each way in the episode of each, within its set speed, m/s and rad/s.

    Raises:
        ClearwayError: it takes Python at each step.
    """

    def __init__(self, scenes: Scenes, view: View, n: int, reward: Rewards) -> None:
        self.num_envs, self._view, self._reward, self._robot = n, view, reward, scenes.robot
        self._scenes = [scenes.twin() for _ in range(n)]
        self.metadata = {"render_modes": [], "autoreset_mode": AutoresetMode.SAME_STEP}
        self.render_mode = None
        seeing, acting = view.seeing, view.acting
        self.single_observation_space = observation_space(seeing, self._robot, flat=view.flat)
        self.single_action_space = action_space(acting, self._robot)
        self.observation_space = batch_space(self.single_observation_space, n)
        self.action_space = batch_space(self.single_action_space, n)
        self._sizes, k = seeing.sizes(self._robot), len(axes(self._robot))
        self._told = Told(
            np.zeros((n, 3)), np.full(n, int(Phase.OVER), np.int64), np.zeros((n, sum(self._sizes.values())), np.float32), np.zeros((n, 2))
        )  # fmt: skip
        self._low, self.most = np.zeros((n, k)), np.zeros((n, k))
        self._worlds: list[_World | None] = [None] * n
        self._held: tuple[Any, ...] = ()
        self._crowd = _crowd_of(scenes, view)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observed, dict[str, Any]]:
        """Begin a scenario in each: with a list of seeds each is `make`'s environment with its own, where that is None it goes on as it
        was; with one `seed` the first has that, the second the next one, and so on. It takes no `options`.

        Raises:
            ValueError: there are more seeds or fewer than environments.
        """
        n = self.num_envs
        seeds = [seed + i for i in range(n)] if isinstance(seed, int) else [None] * n if seed is None else list(seed)
        if len(seeds) != n:
            raise ValueError(f"{len(seeds)} seeds for {n} environments")
        super().reset(seed=seeds[0])
        for scenes, own in zip(self._scenes, seeds, strict=True):
            if own is not None:
                scenes.seed(own)
        infos: dict[str, Any] = {}
        for i in range(self.num_envs):
            infos = self._add_info(infos, {"scenario": self._begin(i)}, i)
        return self._shown(), infos

    def step(self, actions: Numbers) -> tuple[Observed, Any, Any, Any, dict[str, Any]]:
        """Drive each one control period.

        Raises:
            ValueError: the actions are not as many finite numbers as they should be.
            ClearwayError: nor are the rewards.
            gymnasium.error.ResetNeeded: they have not been reset, also not since a reward raised.
        """
        if not self._held:
            from gymnasium.error import ResetNeeded

            raise ResetNeeded("the episodes have not begun: call reset()")
        told, n = self._told, self.num_envs
        self._tell(actions)
        reached = self._drive()
        over = np.flatnonzero(told.phase == Phase.OVER).tolist()
        outcomes: list[Outcome | None] = [None] * n
        for i in over:
            outcomes[i] = self._outcome(i)
        steps = Steps(
            told.moved[:, 0].copy(),
            told.moved[:, 1].copy(),
            reached,
            outcomes,
            told.seen.copy(),
            np.array(actions, np.float32),
            self._robot.period,
        )
        try:
            rewards = numbers_of(self._reward(steps), (n,))
        except BaseException:
            self._held = ()  # those whose episodes are over have not begun anew
            raise
        truncated = np.array([outcome == Outcome.TIMEOUT for outcome in outcomes])
        terminated = np.array([outcome is not None for outcome in outcomes]) & ~truncated
        infos: dict[str, Any] = {}
        for i in over:
            last = {name: part[i] for name, part in self._parts().items()}
            final = last if not self._view.flat else told.seen[i].copy()
            infos = self._add_info(infos, {"final_obs": final, "final_info": {"outcome": str(outcomes[i])}}, i)
            infos = self._add_info(infos, {"scenario": self._begin(i)}, i)
        return self._shown(), rewards, terminated, truncated, infos

    def _tell(self, actions: Numbers) -> None:
        said = np.asarray(actions, np.float64)
        if said.shape != self._low.shape or not np.isfinite(said).all():
            raise ValueError(f"the actions are not {self._low.shape} finite numbers: {', '.join(axes(self._robot))}")
        if self._view.acting.normalised:
            said = np.clip(said, -1.0, 1.0)
            said = np.where(said < 0.0, -said * self._low, said * self.most)
        else:
            said = np.clip(said, self._low, self.most)
        commands = self._told.commands
        commands[:, 0], commands[:, 1] = said[:, 0], said[:, -1]
        if said.shape[1] > 2:
            commands[:, 2] = said[:, 1]
        self._told.phase[:] = Phase.TOLD

    def _drive(self) -> npt.NDArray[np.bool_]:
        """Until each has seen what comes of it, or is over; which have reached a leg other than the last."""
        phase, reached = self._told.phase, np.zeros(self.num_envs, np.bool_)
        while True:
            lanes.step(*self._held, self._told)
            waiting = np.flatnonzero((phase == Phase.WALKED) | (phase == Phase.ARRIVED)).tolist()
            if not waiting:
                return reached
            for i in waiting:
                world = self._worlds[i]
                assert world is not None
                if phase[i] == Phase.WALKED:
                    world.look()
                    phase[i] = Phase.LOOKED
                else:
                    world.begin_next_leg()
                    phase[i], reached[i] = Phase.JUDGED, True

    def _outcome(self, i: int) -> Outcome:
        world = self._worlds[i]
        assert world is not None
        if world.lane.now[HIT] >= 0:
            return Outcome.COLLISION
        return _ENDS[Verdict(int(world.lane.now[VERDICT]))]

    def _begin(self, i: int) -> str:
        """A scenario begins in world `i`; its name."""
        while True:
            scenario = self._scenes[i].draw()
            world = _World(scenario, self._robot, self._view)
            if world.crowd != self._crowd:  # its suite tosses for that, and `_crowd_of` has seen one side
                raise _unlike([scenario.name], world.crowd, "take `make`")
            if not world.over:  # it may have been placed where another stands
                break
        self._worlds[i] = world
        self._low[i], self.most[i] = bounds(self._robot, scenario.speed)
        held = world.held()
        if not self._held:
            self._held = tuple(List([one] * self.num_envs) for one in held)
        else:
            for row, one in zip(self._held, held, strict=True):
                row[i] = one
        lanes.see_held(held[0], self._told.seen, i)
        return scenario.name

    def _parts(self) -> dict[str, Numbers]:
        ends = np.cumsum(list(self._sizes.values()))[:-1].tolist()
        parts = dict(zip(self._sizes, np.split(self._told.seen.copy(), ends, axis=1), strict=True))
        if "obstacles" in parts:
            parts["obstacles"] = parts["obstacles"].reshape(self.num_envs, self._view.seeing.obstacles, -1)
        return parts

    def _shown(self) -> Observed:
        return self._told.seen.copy() if self._view.flat else self._parts()


class _World:
    """A scenario under way in a lane.

    Attributes:
        lane: It, as kernels take it; none where `crowd` is `ASKED`.
        over: Whether it ended before it began.
        crowd: Which compiled crowd decides there; empty: nobody does; `ASKED`: somebody whom Python has to ask.

    Raises:
        ClearwayError: it takes Python at each step.
    """

    def __init__(self, scenario: Scenario, robot: Any, view: View) -> None:
        seeing = view.seeing
        equipment = equipment_of(scenario, robot, seeing, view.localisation, view.tracking)
        localisation, tracking = view.localisation or scenario.localisation, view.tracking or scenario.followed(robot)
        if localisation not in _PLACES:
            raise _refused(
                f"localisation by {localisation!r}",
                f"say localisation={_PLACES[0]!r} or {_PLACES[1]!r}",
                "localisation",
            )
        episode = Episode(scenario, equipment)
        self.over, self._traffic = episode.over, episode.traffic
        world, checker = episode.drives[0].world, episode.drives[0].checker
        self._world, scanner, camera = world, world.scanner, world.camera
        self.crowd = ""
        if self._traffic.decided:
            self.crowd = type(self._traffic.crowd).__name__ if self._traffic.ridden_among else ASKED
        if any((world.latency.sensing, world.latency.command, world.latency.jitter)) or (scanner and scanner.sweeps):
            raise _refused("latency", "say latency=0.0", "latency")
        if seeing.obstacles and (camera is None or camera.bound.any() or tracking != "difference"):
            raise _refused(
                "following obstacles",
                'take a robot whose camera tells them exactly, and tracking="difference"',
                "obstacles",
            )
        if self.crowd == ASKED:
            return
        seen = np.flatnonzero([camera is not None] * (len(camera.radius) if camera and seeing.obstacles else 0))
        discs, which = np.zeros((len(seen), 3)), np.full(len(seen), -1, np.int64)
        if camera is not None and len(seen):
            discs[:, :2], discs[:, 2] = camera.at, camera.radius
            which[camera.moving] = np.arange(int(camera.moving.sum()))
        n = 0 if robot.lidar is None or not seeing.beams else robot.lidar.beams
        self.lane = Lane(
            ride=world.ride,
            lidar=scanner.view if scanner is not None and n else _NO_LIDAR,
            walking=scanner.legs if scanner is not None and n else _NO_LEGS,
            pivot=world.pivot,
            axle=world.axle,
            rules=np.array(checker.rules),
            progress=np.array(checker.progress),
            livelock=scenario.livelock,
            now=np.array([0, self._traffic.decisions, 0, 0, -1, 0], np.int64),
            start=np.array(scenario.start, np.float64),
            by_odometry=localisation == "odometry",
            estimate=np.zeros(3),
            ranges=np.empty(n),
            cuts=np.append(cuts(n, seeing.beams), n) if n else np.zeros(1, np.int64),
            farthest=robot.lidar.range_max if n else 0.0,
            discs=discs,
            which=which,
            before=np.full((len(seen), 2), np.nan),
            order=np.zeros(len(seen), np.int64),
            away=np.zeros(len(seen)),
            most=seeing.obstacles,
            sight=camera.range if camera is not None else 0.0,
            sideways=len(axes(robot)) > 2,
        )

    def held(self) -> tuple[Any, ...]:
        """What the kernels are given of it: the lane, and where a crowd decides that and its street."""
        among = (self._traffic.crowd.crowd, self._traffic.street) if self._traffic.decided else ()
        return lanes.hold(self.lane), *among

    def look(self) -> None:
        """Whatever its crowd has stopped for is seen to."""
        self._traffic.look()

    def begin_next_leg(self) -> None:
        """A leg has been reached; now for the next one."""
        now, state = self.lane.now, self._world.state
        now[LEG] += 1
        t = float(now[PERIODS] * self.lane.ride.setting.vehicle.period)
        begin_leg(self.lane.rules[now[LEG]], self.lane.progress, t, float(state[0]), float(state[1]))
        self._world.begin_leg(int(now[LEG]), t)


def _crowd_of(scenes: Scenes, view: View) -> str:
    """Which `_World.crowd` all scenarios have.

    Raises:
        ClearwayError: some have another one, or it takes Python at each step.
    """
    found: dict[str, list[Scenario]] = {}
    crowds: dict[Any, str] = {}  # of those that differ in nothing that counts here one is built
    for scenario in scenes.sample():
        behaviours = {(person.behaviour, person.decides_every) for person in scenario.people}
        driven = any(obstacle.behaviour for obstacle in scenario.obstacles)
        alike = (scenario.localisation, scenario.tracking, driven, frozenset(behaviours))
        if alike not in crowds:
            scenes.check(scenario)
            crowds[alike] = _World(scenario, scenes.robot, view).crowd
        found.setdefault(crowds[alike], []).append(scenario)
    if len(found) == 1 and ASKED not in found:
        return next(iter(found))
    able = sorted((crowd for crowd in found if crowd != ASKED), key=lambda crowd: -len(found[crowd]))
    crowd = ASKED if ASKED in found else able[-1]
    ways = (
        _leaving_out([s for c, of in found.items() if c != kept for s in of], found[kept], scenes.suite)
        for kept in able
    )
    raise _unlike([s.name for s in found[crowd]], crowd, next(filter(None, ways), "take `make`"))


def _leaving_out(rest: Sequence[Scenario], kept: Sequence[Scenario], suite: Suite) -> str:
    """How to meet none of `rest`, but some of `kept`, in words; empty: there is no way."""
    for option, label in (("batches", "batch"), ("configurations", "configuration")):
        bad = {getattr(scenario.labels, label) for scenario in rest}
        good = dict.fromkeys(getattr(scenario.labels, label) for scenario in kept)
        if own := tuple(name for name in good if name in getattr(suite, option) and name not in bad):
            return f"select {option}={own}, or take `make`"
    if suite.generator is None:
        return f"select scenarios={shown(tuple(scenario.name for scenario in kept))}, or take `make`"
    return ""


def _unlike(names: Sequence[str], crowd: str, instead: str) -> ClearwayError:
    if crowd == ASKED:
        what = f"that bodies decide by other than one compiled crowd, as in {shown(tuple(names))},"
        return _refused(what, instead, "suite")
    return ClearwayError(
        f"{shown(tuple(names))} have {'another crowd than others' if crowd else 'no crowd, as others have'}, and make_vec steps one kind in its kernel; {instead}",
        field="suite",
    )


def _refused(what: str, instead: str, field: str) -> ClearwayError:
    return ClearwayError(f"{what} takes Python at each step, which make_vec does without; {instead}", field=field)


_NOTHING = scene([])
_NO_LIDAR = Lidar(
    np.zeros(3), beams(1, 0.0, 0.0, 0.0, 0.0), Errors(0.0, 0.0, 0.0, math.inf, 0.0), stream(0, "lidar"), _NOTHING, _NOTHING,
    np.zeros((0, 3)), np.zeros((2, 1)),
)  # fmt: skip
_NO_LEGS = Legs(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0), np.zeros(0), np.zeros(0))
