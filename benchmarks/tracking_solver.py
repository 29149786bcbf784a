"""How fast and how good the solvers of HP+TMPC's tracking problem are, beside casadi + ipopt on the same instances.

Instances: a robot drives to and fro through two random scenes of 8 static and 8 oscillating obstacles, 150 control
periods each, after references that heed static obstacles only. Every period gives one instance (each oscillating obstacle at
three time shifts: 32 rows a stage at most) with the shifted plan of the period before as the start. All solvers get
the same instances and starts, in turns, in one process; plans are judged by a roll-out in numpy of their own. A time
is the least of the repeats. Plans of ipopt are taken for what they are whatever status it returns.

casadi (LGPL-3) is a development dependency: an oracle here and in tests, never needed by Clearway itself.

    python benchmarks/tracking_solver.py [--horizon 5 ...] [--repeats 3] [--no-search] [--json] [--smoke]
"""

from __future__ import annotations

import argparse
import json
import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from clearway.navigators.common.tracking.gauss_newton import BUDGET, solve_gauss_newton
from clearway.navigators.common.tracking.problem import Problem, discounts, seeds, shift
from clearway.stand_ins import stand_ins

AIM_P99 = {5: 0.5, 10: 1.0, 15: 1.5, 20: 2.0}
"""Largest p99 of one solve [ms] that the project aims for, by horizon."""

AIM_KEPT = {5: 0.995, 10: 0.98, 15: 0.98, 20: 0.98}
"""Least share of the instances whose constraints ipopt keeps in which we keep them, too."""

AIM_RATIO = {"median": 1 / 50, "p99": 1 / 100}

KEPT = 1e-4
"""A plan keeps the constraints if none is violated by more than this [m]."""


@dataclass(frozen=True)
class Instance:
    """One tracking problem and the plan to start from."""

    problem: Problem
    warm: np.ndarray


def record(horizon: int, scenes: int = 2, steps: int = 150, control_horizon: int | None = None) -> list[Instance]:
    """The instances of `scenes` random scenes, `steps` periods each; the same every time."""
    robot, obstacles, task = stand_ins("robot"), stand_ins("obstacles"), stand_ins("task")
    own = stand_ins("hp-tmpc") | robot["navigators"]["hp-tmpc"]
    c, rho = robot["period"], robot["footprint"]["radius"] + obstacles["radius"] + own["safe_margin"]
    v_max, omega_max = robot["drive"]["v_max"], robot["drive"]["omega_max"]
    w_rob = np.array([own["w_rob"] * sum((1 - own["xi_rob"]) ** i for i in range(k + 1)) for k in range(horizon)])
    w_dyn = [own["w_dyn"] * sum((1 - own["xi_dyn"]) ** i for i in range(k)) for k in range(horizon + 2)]
    low, high = obstacles["region"]
    found: list[Instance] = []

    def each(value: Any) -> np.ndarray:
        """The same for every stage."""
        return np.array([value] * horizon, dtype=np.float64)

    for scene in range(scenes):
        rng = np.random.default_rng(20250000 + scene)
        ends = np.array([task["start"][:2], task["goal"][:2]])

        def place(far: float, rng: np.random.Generator = rng, ends: np.ndarray = ends) -> np.ndarray:
            while True:
                at = rng.uniform(low, high, 2)
                if np.linalg.norm(ends - at, axis=1).min() > far:
                    return at

        static = np.array([place(obstacles["clear"]) for _ in range(8)])
        first = np.array([place(obstacles["clear"]) for _ in range(8)])
        attractor = rng.uniform(low, high, (8, 2))
        speed = rng.uniform(-obstacles["speed"], obstacles["speed"], (8, 2))
        pull = 0.2 * (1 + 4 * rng.uniform(size=(8, 1))) / (obstacles["span"] + np.abs(first - attractor))
        pose, last, goal = np.array(task["start"]), np.zeros(2), 1
        plan = np.zeros((horizon, 2))
        for step in range(steps):
            swing = np.sqrt(pull) * step * c
            at = attractor + (first - attractor) * np.cos(swing) + speed / np.sqrt(pull) * np.sin(swing)
            moving = -(first - attractor) * np.sqrt(pull) * np.sin(swing) + speed * np.cos(swing)
            if np.linalg.norm(ends[goal] - pose[:2]) < 0.5:
                goal = 1 - goal
            heading = _heading(pose, ends[goal], static, rho + 0.15)
            along = 0.5 * v_max * c * np.arange(1, horizon + 1)
            reference = np.column_stack(
                [pose[0] + along * math.cos(heading), pose[1] + along * math.sin(heading), np.full(horizon, heading)]
            )
            rows = np.zeros((horizon, 32, 3))
            counts = np.zeros(horizon, dtype=np.int64)
            for k in range(horizon):
                listed = [(*r, rho + w_rob[k]) for r in static]
                for other in (k, k + 1, k + 2):  # k-1, k, k+1 of (3h)-(3j); those beyond the window are left out
                    if 0 < other <= horizon:
                        future = at + moving * other * c
                        listed += [(*r, rho + w_rob[k] + w_dyn[other]) for r in future]
                counts[k] = len(listed)
                rows[k, : len(listed)] = np.array(listed).reshape(-1, 3)
            area = np.array((0.25, 0.25, task["size"] - 0.25, task["size"] - 0.25))
            now = Problem(
                start=pose.copy(), previous=last.copy(), reference=reference, nominal=each((0.5 * v_max, 0.0)),
                rows=rows, counts=counts, passed=np.zeros((0, 3)), decay=1.0, centre=pose[:2].copy(), reach=each(robot["camera"]["range"] - rho),
                area=each(area), low=each((0.0, -omega_max)), high=each((v_max, omega_max)),
                smooth=each(own["input_change"]), discount=discounts(horizon, own["w1"], step, False),
                effort=float(own["w2"]), heading_weight=float(own["heading_weight"]), period=c, exact=True,
                control_horizon=control_horizon or horizon,
            )  # fmt: skip
            found.append(Instance(now, shift(plan)))
            plan = solve_gauss_newton(now, shift(plan), BUDGET).inputs
            last = plan[0]
            v, w = last
            for _ in range(20):  # small steps: not the solver's own model
                pose = pose + c / 20 * np.array([v * math.cos(pose[2]), v * math.sin(pose[2]), w])
            off = rng.uniform(-1, 1, 3) * (task["disturbance"]["position"] / math.sqrt(2))
            pose = pose + off
    return found


def _heading(pose: np.ndarray, goal: np.ndarray, static: np.ndarray, clear: float) -> float:
    """The heading nearest to the goal's (and a little to the robot's own) with 1.5 m free of static obstacles."""
    way = goal - pose[:2]
    best, least = 0.0, math.inf
    for i in range(72):
        turn = math.pi * (i // 2) / 36 * (1 if i % 2 else -1)
        heading = math.atan2(way[1], way[0]) + turn
        along = np.linspace(0.0, 1.5, 16)[:, None] * np.array([math.cos(heading), math.sin(heading)])
        gap = np.linalg.norm(pose[:2] + along[:, None, :] - static, axis=2).min() if len(static) else math.inf
        price = abs(turn) + 0.3 * abs(math.remainder(heading - pose[2], 2 * math.pi)) + 20 * max(0.0, clear - gap)
        if price < least:
            best, least = heading, price
    return best


def judged(p: Problem, inputs: np.ndarray) -> tuple[float, float]:
    """Cost and largest violation (everything but the rate limit and the input box, in m; those two in their units)."""
    x, y, theta = p.start
    cost, worst, last = 0.0, 0.0, p.previous
    for k, (v, w) in enumerate(inputs):
        if p.exact and abs(w) > 1e-9:
            turned = theta + w * p.period
            x, y = x + v / w * (math.sin(turned) - math.sin(theta)), y - v / w * (math.cos(turned) - math.cos(theta))
        else:
            bend = 0.0 if p.exact else p.period * w * v
            x, y = (
                x + p.period * (v * math.cos(theta) - bend * math.sin(theta)),
                y + p.period * (v * math.sin(theta) + bend * math.cos(theta)),
            )
        theta += p.period * w
        error = np.array([x, y, theta]) - p.reference[k]
        error[2] = p.heading_weight * math.remainder(error[2], 2 * math.pi)
        cost += p.discount[k] * float(np.linalg.norm(error)) + p.effort * (v * v + w * w)
        r = p.rows[k, : p.counts[k]]
        gaps = r[:, 2] - np.hypot(x - r[:, 0], y - r[:, 1])
        worst = max(
            [worst, *gaps, math.dist((x, y), p.centre) - p.reach[k], p.area[k, 0] - x, p.area[k, 1] - y,
             x - p.area[k, 2], y - p.area[k, 3], *(p.low[k] - (v, w)), *((v, w) - p.high[k]),
             math.dist((v, w), last) - p.smooth[k]]
        )  # fmt: skip
        last = (v, w)
    return cost, worst


class Ipopt:
    """The same problem in casadi, by multiple shooting, for one shape of instances.

    ipopt needs derivatives, so norms are smoothed by 3 mm, sqrt(|e|^2 + 1e-5): of the smoothings and barrier starts
    that were tried, the fastest with the lowest costs (1e-8 takes ten times the iterations).
    """

    def __init__(self, sample: Problem, tolerance: float = 1e-6, iterations: int = 300) -> None:
        try:
            import casadi as ca
        except ImportError:
            raise SystemExit("casadi is missing; pip install 'clearway[dev]' has it") from None

        n, m, free = len(sample.reference), sample.rows.shape[1], sample.control_horizon
        u, x = ca.SX.sym("u", 2, free), ca.SX.sym("x", 3, n)
        start, previous = ca.SX.sym("start", 3), ca.SX.sym("previous", 2)
        reference, rows = ca.SX.sym("reference", 3, n), ca.SX.sym("rows", 3, n * m)
        discount, smooth, reach = ca.SX.sym("discount", n), ca.SX.sym("smooth", n), ca.SX.sym("reach", n)
        cost: Any = 0
        g, lower, upper = [], [], []

        def bounded(expression: Any, a: float, b: float) -> None:
            g.append(expression)
            lower.append(a)
            upper.append(b)

        c, at = sample.period, start
        for k in range(n):
            v, w = u[0, min(k, free - 1)], u[1, min(k, free - 1)]
            if sample.exact:
                half = 0.5 * w * c  # at most 0.2 rad: this series of sin(half)/half is exact to 1e-13
                chord = v * c * (1 - half**2 / 6 * (1 - half**2 / 20 * (1 - half**2 / 42)))
                dx, dy = chord * ca.cos(at[2] + half), chord * ca.sin(at[2] + half)
            else:
                dx = c * (v * ca.cos(at[2]) - c * w * v * ca.sin(at[2]))
                dy = c * (v * ca.sin(at[2]) + c * w * v * ca.cos(at[2]))
            for row in (x[0, k] - at[0] - dx, x[1, k] - at[1] - dy, x[2, k] - at[2] - c * w):
                bounded(row, 0, 0)
            at = x[:, k]
            e = at - reference[:, k]
            cost += discount[k] * ca.sqrt(e[0] ** 2 + e[1] ** 2 + (sample.heading_weight * e[2]) ** 2 + 1e-5)
            cost += sample.effort * (v * v + w * w)
            if k < free:
                before = previous if k == 0 else u[:, k - 1]
                bounded((v - before[0]) ** 2 + (w - before[1]) ** 2 - smooth[k] ** 2, -math.inf, 0)
            bounded((at[0] - start[0]) ** 2 + (at[1] - start[1]) ** 2 - reach[k] ** 2, -math.inf, 0)
            for i in range(k * m, k * m + m):
                bounded((at[0] - rows[0, i]) ** 2 + (at[1] - rows[1, i]) ** 2 - rows[2, i] ** 2, 0, math.inf)
        p = ca.vertcat(start, previous, ca.vec(reference), ca.vec(rows), discount, smooth, reach)
        options = {
            "print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes", "ipopt.tol": tolerance,
            "ipopt.max_iter": iterations, "ipopt.mu_init": 1e-2,
        }  # fmt: skip
        nlp = {"x": ca.vertcat(ca.vec(u), ca.vec(x)), "p": p, "f": cost, "g": ca.vertcat(*g)}
        self._solver = ca.nlpsol("tracking", "ipopt", nlp, options)
        self._lower, self._upper = np.array(lower, dtype=float), np.array(upper, dtype=float)
        self._shape = n, m, free

    def arguments(self, instance: Instance) -> dict[str, np.ndarray]:
        """What the solver is called with; made outside of the time that is measured."""
        p, (n, m, free) = instance.problem, self._shape
        rows = np.tile([1e3, 1e3, 0.0], (n, m, 1))
        for k in range(n):
            rows[k, : p.counts[k]] = p.rows[k, : p.counts[k]]
        reference = p.reference.copy()
        reference[:, 2] = p.start[2] + np.remainder(reference[:, 2] - p.start[2] + np.pi, 2 * np.pi) - np.pi
        states = np.empty((n, 3))
        at = p.start.copy()
        for k in range(n):
            v, w = instance.warm[k]
            at = at + p.period * np.array(
                [v * math.cos(at[2] + w * p.period / 2), v * math.sin(at[2] + w * p.period / 2), w]
            )
            states[k] = at
        area = np.column_stack([p.area[:, :2], np.full(n, -np.inf), p.area[:, 2:], np.full(n, np.inf)])
        given = [p.start, p.previous, reference.ravel(), rows.ravel(), p.discount, p.smooth, p.reach]
        return {
            "x0": np.concatenate([instance.warm[:free].ravel(), states.ravel()]),
            "lbx": np.concatenate([p.low[:free].ravel(), area[:, :3].ravel()]),
            "ubx": np.concatenate([p.high[:free].ravel(), area[:, 3:].ravel()]),
            "lbg": self._lower,
            "ubg": self._upper,
            "p": np.concatenate(given),
        }

    def plan(self, answer: dict[str, Any]) -> np.ndarray:
        """(N, 2) of what the solver returned."""
        n, _, free = self._shape
        u = np.array(answer["x"]).ravel()[: 2 * free].reshape(free, 2)
        return np.vstack([u, np.repeat(u[-1:], n - free, axis=0)])

    def __call__(self, arguments: dict[str, np.ndarray]) -> dict[str, Any]:
        answer: dict[str, Any] = self._solver(**arguments)
        return answer


def compare(horizon: int, repeats: int, search: bool, scenes: int = 2, steps: int = 150) -> dict[str, Any]:
    """Times [ms] and quality of all solvers at one horizon."""
    instances = record(horizon, scenes, steps)
    rivals: dict[str, Callable[[Instance, Any], Any]] = {}
    ipopt = Ipopt(instances[0].problem)
    rivals["gauss-newton"] = lambda i, _: solve_gauss_newton(i.problem, i.warm, BUDGET)
    rivals["casadi + ipopt"] = lambda _, a: ipopt(a)
    if search:
        from clearway.geometry.streams import stream
        from clearway.navigators.hp_tmpc.tube_mpc.papers_solvers.genetic import genetic
        from clearway.navigators.hp_tmpc.tube_mpc.papers_solvers.pattern_search import pattern_search

        key = stream(0, "genetic")

        def starts(i: Instance) -> np.ndarray:
            return np.concatenate([i.warm[None], seeds(i.problem)])

        rivals["pattern-search"] = lambda i, _: pattern_search(i.problem, starts(i))
        rivals["genetic"] = lambda i, _: genetic(i.problem, starts(i), key, 0)
    times = {name: np.full(len(instances), np.inf) for name in rivals}
    plans: dict[str, list[np.ndarray]] = {name: [] for name in rivals}
    for solve in rivals.values():  # compile, warm up
        solve(instances[0], ipopt.arguments(instances[0]))
    for repeat in range(repeats):
        for j, instance in enumerate(instances):
            arguments = ipopt.arguments(instance)
            for name, solve in rivals.items():
                if repeat > 0 and name in ("genetic", "pattern-search"):
                    continue
                begin = time.perf_counter_ns()
                answer = solve(instance, arguments)
                times[name][j] = min(times[name][j], (time.perf_counter_ns() - begin) * 1e-6)
                if repeat == 0:
                    plans[name].append(ipopt.plan(answer) if name == "casadi + ipopt" else answer.inputs)
    marks = {
        name: np.array([judged(i.problem, u) for i, u in zip(instances, plans[name], strict=True)]) for name in rivals
    }
    oracle = marks["casadi + ipopt"]
    kept = oracle[:, 1] <= KEPT
    out: dict[str, Any] = {"horizon": horizon, "instances": len(instances), "ipopt keeps": float(kept.mean())}
    base = times["casadi + ipopt"]
    for name in rivals:
        ours = marks[name]
        keeps = ours[:, 1] <= KEPT
        good = keeps & ((ours[:, 0] <= oracle[:, 0] * 1.01 + 1e-3) | ~kept)
        out[name] = {
            "median": float(np.median(times[name])),
            "p99": float(np.quantile(times[name], 0.99)),
            "ratio of medians": float(np.median(times[name]) / np.median(base)),
            "ratio of p99s": float(np.quantile(times[name], 0.99) / np.quantile(base, 0.99)),
            "as good as ipopt": float((good | (~kept & ~keeps)).mean()),
            "better than ipopt": float((keeps & (~kept | (ours[:, 0] < oracle[:, 0] * 0.99 - 1e-3))).mean()),
            "keeps where ipopt does": float(keeps[kept].mean()),
            "keeps where ipopt does not": float(keeps[~kept].mean()) if (~kept).any() else None,
        }
    return out


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--horizon", type=int, action="append", help="N^P; default 5 10 15 20")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--no-search", action="store_true", help="leave out pattern-search and genetic")
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--smoke", action="store_true", help="a few instances at N = 5")
    chosen = parser.parse_args()
    horizons = [5] if chosen.smoke else chosen.horizon or [5, 10, 15, 20]
    scenes, steps = (1, 12) if chosen.smoke else (2, 150)
    results = []
    for horizon in horizons:
        result = compare(horizon, chosen.repeats, not chosen.no_search, scenes, steps)
        results.append(result)
        if chosen.json:
            continue
        print(
            f"N = {horizon}: {result['instances']} instances, ipopt keeps the constraints in {result['ipopt keeps']:.1%}"
        )
        print(
            f"  {'':16}{'median ms':>10}{'p99 ms':>10}{'ratios':>18}{'as good':>9}{'better':>8}{'kept (where ipopt does)':>25}"
        )
        for name, r in result.items():
            if isinstance(r, dict):
                print(
                    f"  {name:16}{r['median']:10.3f}{r['p99']:10.3f}"
                    f"{r['ratio of medians']:9.4f}{r['ratio of p99s']:9.4f}"
                    f"{r['as good as ipopt']:9.1%}{r['better than ipopt']:8.1%}{r['keeps where ipopt does']:25.2%}"
                )
        ours = result["gauss-newton"]
        checks = {
            f"p99 < {AIM_P99.get(horizon, math.inf)} ms": ours["p99"] < AIM_P99.get(horizon, math.inf),
            "median <= 1/50": ours["ratio of medians"] <= AIM_RATIO["median"],
            "p99 <= 1/100": ours["ratio of p99s"] <= AIM_RATIO["p99"],
            f"kept >= {AIM_KEPT.get(horizon, 0.98):.1%}": ours["keeps where ipopt does"] >= AIM_KEPT.get(horizon, 0.98),
        }
        print("  " + "; ".join(f"{what}: {'yes' if met else 'NO'}" for what, met in checks.items()), flush=True)
    if chosen.json:
        print(json.dumps(results, indent=1))


if __name__ == "__main__":
    main()
