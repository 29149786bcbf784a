"""How good are the forecasts? Errors by age of the track and by look-ahead, calibration, bounds, time for an update.

Perceived tracks: obstacles of the rescue suites as far as they reach into the camera's circle of a robot that goes
straight from start to goal, each from the moment that it comes into view, once in a control period, with the camera's error;
and other kinds of motion that no model here matches exactly. Compared: constant velocity (the ablation `forecast`), the
mixture, and, on oscillators, what one who is told the kind of motion would expect by Bayes' rule, from the mixture's own
priors, and the exact model, which is told both stiffnesses as well: that can't be seen in a second.

Printed: rms and 95 % quantile of the error of the weighted mean path; shares of truths within the 50, 90 and 99 % discs
about it (nominal if calibrated); shares outside of the bounds (must be 0), and how tight they are; ms for an update.

    python benchmarks/forecasts.py [--scenarios N] [--json] [--smoke]
"""

from __future__ import annotations

import argparse
import json
import math
import time
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from scipy.stats import ncx2

from clearway.contract import Obstacles
from clearway.forecasts.forecast import Forecast
from clearway.forecasts.forecaster import Forecaster
from clearway.forecasts.parameters import ForecastParameters
from clearway.geometry.shapes import FloatArray
from clearway.geometry.streams import bits, stream
from clearway.scenarios.sar_draws import CASES, draw, static_path
from clearway.scenarios.sar_motions import misspecified
from clearway.scenarios.sar_rules import GOAL, SAMPLE, START

PERIOD, RANGE, RADIUS, ERROR = 0.15, 4.0, 0.35, 0.01
AGES = (0.3, 0.6, 1.05, 1.95, 4.05)
AHEAD = (0.5, 1.0, 1.5, 2.0, 3.0)
LEVELS = (0.5, 0.9, 0.99)
SKIP = round(PERIOD / SAMPLE)
LONGEST = 90  # periods


class Scene(NamedTuple):
    """Tracks that all come into view at time 0.

    Attributes:
        truth: (k, n, 2) m every `SAMPLE` s. seen: (periods, n) in view. stiffness: (n, 2) 1/s^2, or None.
    """

    truth: FloatArray
    seen: npt.NDArray[np.bool_]
    stiffness: FloatArray | None


def rescue(name: str, scenarios: int) -> Scene:
    """Tracks of the obstacles of a rescue case."""
    case, way = CASES[name], GOAL - START
    robot = START + np.minimum(0.9 * case.speed * SAMPLE * np.arange(1000) / math.hypot(*way), 1.0)[:, None] * way
    tracks, views, stiffness = [], [], []
    for seed in range(scenarios):
        key = stream(seed, f"{name}, forecasts")
        layout = draw(case, key, 0)
        if case.misspecified:
            path = static_path(layout)
            if path is None:
                continue
            layout = misspecified(layout, path, np.uint64(bits(key, 0, case.numbers)))
        motion = layout.motion(40.0)[:, :, :2]
        for i in range(motion.shape[1]):
            near = np.hypot(*(motion[:400, i] - robot[:400]).T) <= RANGE + RADIUS
            if not near.any():
                continue
            first = int(np.flatnonzero(near)[0])
            view = near[first : first + SKIP * LONGEST : SKIP]
            tracks.append(motion[first : first + SKIP * LONGEST + 80, i])
            views.append(np.concatenate([view, np.zeros(LONGEST - len(view), dtype=np.bool_)]))
            k = layout.stiffness[i]
            stiffness.append(np.broadcast_to(k, (2,)))
    short = min(len(x) for x in tracks)
    known = None if case.misspecified else np.array(stiffness)
    return Scene(np.stack([x[:short] for x in tracks], axis=1), np.stack(views, axis=1), known)


def other(kind: str, n: int) -> Scene:
    """Tracks of another kind of motion: straight, damped, random, stop-and-go or turning; always in view, for 6 s."""
    rng = np.random.default_rng(7)
    steps = SKIP * 40 + 80
    x, v = np.zeros((n, 2)), rng.normal(0.0, 0.7, (n, 2))
    out = np.empty((steps, n, 2))
    k, point = rng.uniform(0.05, 0.5, (n, 1)), rng.normal(0.0, 2.0, (n, 2))
    rate, a = rng.uniform(-0.9, 0.9, n), rng.normal(0.0, 0.4, (n, 2))
    pace, goes = v.copy(), np.ones(n, dtype=np.bool_)
    for i in range(steps):
        out[i] = x
        if kind == "damped":
            a = k * (point - x) - 0.4 * v
        elif kind == "random":
            change = rng.random(n) < SAMPLE / 1.0
            a[change] = rng.normal(0.0, 0.4, (int(change.sum()), 2))
            a = np.where(np.abs(v) > 1.5, -0.3 * v, a)
        elif kind == "stop-and-go":
            goes ^= rng.random(n) < SAMPLE / 2.0
            a = np.clip(4.0 * (np.where(goes[:, None], pace, 0.0) - v), -1.2, 1.2)
        elif kind == "straight":
            a = np.zeros((n, 2))
        else:
            a = rate[:, None] * np.column_stack([-v[:, 1], v[:, 0]])
        a = a / np.maximum(np.hypot(*a.T) / 1.75, 1.0)[:, None]
        x = x + SAMPLE * v + 0.5 * SAMPLE**2 * a
        v = v + SAMPLE * a
    return Scene(out, np.ones((40, n), dtype=np.bool_), None)


def perceived(scene: Scene, i: int, noise: FloatArray) -> Obstacles:
    """What is seen in period `i`; noise: (periods, n, 2) m."""
    at = np.flatnonzero(scene.seen[i])
    m = len(at)
    return Obstacles(
        scene.truth[SKIP * i, at] + noise[i, at], np.full((m, 2), np.nan), np.full(m, RADIUS), np.full(m, ERROR),
        np.full(m, np.inf), at.astype(np.int64), np.ones(m, dtype=np.bool_),
    )  # fmt: skip


def disc_noise(shape: tuple[int, int], seed: int) -> FloatArray:
    """(*shape, 2) uniform in a disc of radius `ERROR`."""
    rng = np.random.default_rng(seed)
    r, angle = ERROR * np.sqrt(rng.random(shape)), 2.0 * math.pi * rng.random(shape)
    return np.stack([r * np.cos(angle), r * np.sin(angle)], axis=-1)


def mean_path(f: Forecast) -> FloatArray:
    """(n, K + 1, 2) the weighted mean of the hypotheses."""
    return np.asarray(np.einsum("nh,nhkc->nkc", f.weight, f.path))


def probability(f: Forecast, truth: FloatArray) -> FloatArray:
    """(n, K + 1) how probable it is, by the mixture, to lie nearer to the mean path than the truth (n, K + 1, 2)."""
    mean = mean_path(f)
    d2 = ((truth - mean) ** 2).sum(axis=-1)
    total = np.zeros(d2.shape)
    for h in range(f.weight.shape[1]):
        s2 = f.sigma[:, h] ** 2
        off = ((f.path[:, h] - mean) ** 2).sum(axis=-1)
        total += f.weight[:, h, None] * ncx2.cdf(d2 / s2, 2, off / s2)
    return total


def knowing(
    scene: Scene, noise: FloatArray, i: int, at: npt.NDArray[np.int64], p: ForecastParameters, told: bool
) -> FloatArray:  # fmt: skip
    """(len(at), K + 1, 2) what is expected of oscillators in view from the start by all that was seen until period `i`.

    Args:
        told: Whether both stiffnesses of each are known; else they are any of the bank's range, weighed by Bayes' rule.
    """
    assert scene.stiffness is not None
    ahead = 0.1 * np.arange(round(AHEAD[-1] / 0.1) + 1)
    t = PERIOD * np.arange(-i, 1)
    z = scene.truth[SKIP * np.arange(i + 1)][:, at] + noise[: i + 1, at]
    out = np.empty((len(at), len(ahead), 2))
    grid = np.geomspace(p.softest, p.stiffest, 60)
    likely = -0.5 * np.linspace(-p.ends, p.ends, len(grid)) ** 2
    for axis in range(2):
        if told:
            for row, k in enumerate(scene.stiffness[at, axis].tolist()):
                out[row, :, axis] = _expected(k, t, ahead, z[:, [row], axis], p)[0][:, 0]
            continue
        each = [_expected(k, t, ahead, z[:, :, axis], p) for k in grid.tolist()]
        score = np.array([evidence for _, evidence in each]) + likely[:, None]
        weight = np.exp(score - score.max(axis=0))
        out[:, :, axis] = np.einsum("kn,kan->na", weight / weight.sum(axis=0), np.array([path for path, _ in each]))
    return out


def _expected(
    k: float, t: FloatArray, ahead: FloatArray, z: FloatArray, p: ForecastParameters
) -> tuple[FloatArray, FloatArray]:
    """(K + 1, n) what `z` (i + 1, n) at `t` leads to with stiffness `k`, and the logarithm of how likely that is (n,)."""
    w = math.sqrt(k)
    far = min(p.usual_reach, p.acceleration / k, p.speed / w)
    prior = np.diag([1.0, p.usual_speed**2, far**2])  # beside the last place; velocity; the way to the point

    def design(t: FloatArray) -> FloatArray:
        return np.column_stack([np.ones_like(t), np.sin(w * t) / w, 1.0 - np.cos(w * t)])

    rows = design(t)
    cov = rows @ prior @ rows.T + ERROR**2 / 4.0 * np.eye(len(t))
    off = z - z[-1]
    solved = np.linalg.solve(cov, off)
    evidence = -0.5 * (off * solved).sum(axis=0) - 0.5 * np.linalg.slogdet(cov)[1]
    return z[-1] + design(ahead) @ prior @ rows.T @ solved, evidence


def measure(scene: Scene, p: ForecastParameters) -> dict[str, Any]:
    """Errors, probabilities and bounds by age and look-ahead."""
    noise = disc_noise(scene.seen.shape, 3)
    count = round(AHEAD[-1] / 0.1)
    every = round(0.1 / SAMPLE)
    whole = {
        "constant velocity": Forecaster(p.model_copy(update={"constant_velocity_only": True}), PERIOD, 0.1, count),
        "mixture": Forecaster(p, PERIOD, 0.1, count),
    }
    rows: list[dict[str, Any]] = []
    outside, checked, told_in_all = 0, 0, 0
    looks = [round(a / 0.1) for a in AHEAD]
    ages = [round(a / PERIOD) for a in AGES]
    for i in range(min(len(scene.seen), ages[-1] + 1)):
        o = perceived(scene, i, noise)
        steady = scene.seen[: i + 1].all(axis=0)
        results = {}
        for name, forecaster in whole.items():
            f, told = forecaster.update(PERIOD * i, o)
            told_in_all += len(told) if name == "mixture" else 0
            results[name] = f
        f = results["mixture"]
        if not len(f.identity):
            continue
        span = slice(SKIP * i, SKIP * i + every * count + 1, every)
        truth = np.ascontiguousarray(scene.truth[span][:, f.identity].transpose(1, 0, 2))
        off = np.hypot(*np.moveaxis(truth - f.centre, 2, 0))
        outside, checked = outside + int((off > f.reach).sum()), checked + off.size
        if i not in ages:
            continue
        pick = np.flatnonzero(steady[f.identity])
        guesses = {name: mean_path(g)[pick] for name, g in results.items()}
        if scene.stiffness is not None:
            guesses["kind known"] = knowing(scene, noise, i, f.identity[pick], p, told=False)
            guesses["exact model"] = knowing(scene, noise, i, f.identity[pick], p, told=True)
        u = probability(f, truth)[pick]
        for name, path in guesses.items():
            e = np.hypot(*np.moveaxis(truth[pick] - path, 2, 0))[:, looks]
            row = {
                "age": AGES[ages.index(i)], "n": len(pick), "forecast": name,
                "rms": np.sqrt((e**2).mean(axis=0)).tolist(), "q95": np.quantile(e, 0.95, axis=0).tolist(),
                "median": np.median(e, axis=0).tolist(),
            }  # fmt: skip
            if name == "mixture":
                row["within"] = [(u[:, looks] <= level).mean(axis=0).tolist() for level in LEVELS]
            rows.append(row)
    return {"rows": rows, "outside": outside, "checked": checked, "told": told_in_all}


def timing(counts: tuple[int, ...], updates: int) -> list[dict[str, Any]]:
    """ms of one thread for a warm update, by the number of oscillating obstacles."""
    rows = []
    for n in counts:
        rng = np.random.default_rng(n)
        place, swing, phase = (
            rng.uniform(0.0, 14.0, (n, 2)),
            rng.normal(0.0, 1.0, (n, 2)),
            rng.uniform(0.0, 6.3, (n, 2)),
        )
        w = np.sqrt(rng.uniform(0.05, 0.5, (n, 2)))
        forecaster, taken = Forecaster(ForecastParameters(), PERIOD, 0.1, 30), []
        noise = disc_noise((updates, n), n)
        for i in range(updates):
            o = Obstacles(
                place + swing * np.sin(w * PERIOD * i + phase) + noise[i], np.full((n, 2), np.nan), np.full(n, RADIUS),
                np.full(n, ERROR), np.full(n, np.inf), np.arange(n), np.ones(n, dtype=np.bool_),
            )  # fmt: skip
            begun = time.thread_time()
            forecaster.update(PERIOD * i, o)
            taken.append(1e3 * (time.thread_time() - begun))
        warm = np.array(taken[5:])
        rows.append({"obstacles": n, "median": float(np.median(warm)), "p99": float(np.quantile(warm, 0.99))})
    return rows


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenarios", type=int, default=60)
    parser.add_argument("--json", action="store_true")
    parser.add_argument("--smoke", action="store_true", help="few of all, to see that it runs")
    args = parser.parse_args()
    n = 3 if args.smoke else args.scenarios
    p = ForecastParameters()
    scenes = {name: rescue(name, n) for name in ("case 1", "case 2", "case 3", "misspecified")}
    scenes |= {kind: other(kind, 5 * n) for kind in ("straight", "damped", "random", "stop-and-go", "turning")}
    found: dict[str, Any] = {name: measure(scene, p) for name, scene in scenes.items()}
    found["time"] = timing((16,) if args.smoke else (16, 64, 500), 20 if args.smoke else 100)
    if args.json:
        print(json.dumps(found))
        return
    ahead = "".join(f"{a:>8.1f}" for a in AHEAD)
    for name in scenes:
        f = found[name]
        print(f"\n{name}: {f['outside']} of {f['checked']} outside of the bounds; {f['told']} violations told")
        print(f"  age   n  {'forecast':<18}rms{ahead}   95 %{ahead}")
        for row in f["rows"]:
            rms, q95 = ("".join(f"{e:8.3f}" for e in row[key]) for key in ("rms", "q95"))
            print(f"{row['age']:5.2f} {row['n']:4d} {row['forecast']:<18}   {rms}       {q95}")
        print("  within 50, 90, 99 %:")
        for row in f["rows"]:
            if "within" in row:
                print(f"{row['age']:5.2f}  " + "  |".join("".join(f"{100 * s:6.1f}" for s in w) for w in row["within"]))
    print("\nms for an update")
    for row in found["time"]:
        print(f"{row['obstacles']:4d} obstacles: median {row['median']:.3f}, 99 % {row['p99']:.3f}")


if __name__ == "__main__":
    main()
