"""Trains the learnt navigator that comes with Clearway, `ppo`: proximal policy optimisation (Schulman et al. 2017) on its own worlds.

    python benchmarks/train_ppo.py discs|lidar [--seeds 5] [--first 0] [--minutes M | --steps N] [--workers 2] [--out FOLDER] [--smoke]

Each seed is a training of its own, in a process with one core, for so many minutes of processor time; five of ten minutes by
two workers are over within half an hour. What comes of each is written as FOLDER/TASK-SEED.npz, and beside it TASK-SEED.json: how its success
grew on what it was trained on, and its success in 1,024 drawn cases after it (--episodes 16 in 64 lanes), without noise. `clearway run`
drives by the one for discs as `-n npz:FILE`, by the one for TIAGo's lidar as `-n 'ppo[policy=FILE]'`: the rest of `guiding.py` belongs to it.
Training takes numpy alone; how many steps ten minutes are depends on the machine, so `--steps` stands where the same bits are wanted.

Two perceptrons of two layers of 128, one for the mean of a normal distribution, one for the value; generalised advantages; Adam.
"""

from __future__ import annotations

import argparse
import json
import os
import time
from collections import deque
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np

from clearway.geometry.shapes import circumscribed_radius
from clearway.learning import Steps, default_rewards, make_vec
from clearway.navigators.learnt import guiding
from clearway.navigators.learnt.encoding import GOAL, OBSTACLE, Acting, Seeing, axes
from clearway.navigators.learnt.policy import Perceptron, write_npz
from clearway.robots import load_robot
from clearway.trials import Outcome

Array = np.ndarray


@dataclass(frozen=True)
class Task:
    """What is learnt: where, with which eyes, and what is dear there beside what `default_rewards` has."""

    suite: str
    options: dict[str, Any]
    beams: int = 0
    obstacles: int = 0
    held: tuple[str, ...] = ()  # axes that are never used
    contact: float = 10.0  # what a contact costs more than other bad ends
    comfort: float = 0.0  # what a period costs in which the nearest obstacle is touched; nothing from COMFORT on
    spread: float = 0.6  # of what is tried at first, in shares of what the base can do


TASKS = {
    "discs": Task(
        "crowd", {"batches": ("circle-invisible", "square-invisible")}, obstacles=5, held=("omega",), comfort=1.0
    ),
    # the hospital's own movers are steered by a person, which takes Python at each step; the blind ones are the same tests, harder
    "lidar": Task(
        "hospital-blind",
        {"robot": "tiago", "latency": 0.0, "localisation": "truth"},
        guiding.BEAMS,
        comfort=0.3,
        spread=0.4,
    ),
}
COMFORT = 0.2
"""Room between robot and obstacle that costs nothing, m."""
HELD = 1_000_000
"""Environments' seeds from here on are of episodes that no training meets."""


@dataclass(frozen=True)
class Settings:
    """Of the optimisation."""

    lanes: int = 64
    periods: int = 64  # that each drives in a round
    epochs: int = 5
    batch: int = 1024
    rate: float = 1e-3  # falls to nothing
    clip: float = 0.2
    gamma: float = 0.99
    smoothing: float = 0.95  # the lambda of generalised advantages
    care: float = 0.2  # of the training, until contact and comfort cost what they do: who is afraid from the beginning stays where it is
    reward_scale: float = 0.2
    hidden: tuple[int, ...] = (128, 128)


class Net:
    """A perceptron with tanh between its layers, and its gradient."""

    def __init__(self, sizes: list[int], last: float, rng: np.random.Generator) -> None:
        gains = [2.0**0.5] * (len(sizes) - 2) + [last]
        self.layers = [
            [_orthogonal(n, m, rng) * np.float32(gain), np.zeros(m, np.float32)]
            for n, m, gain in zip(sizes[:-1], sizes[1:], gains, strict=True)
        ]

    @property
    def parameters(self) -> list[Array]:
        return [array for layer in self.layers for array in layer]

    def forward(self, x: Array) -> tuple[Array, list[Array]]:
        inputs = [x]
        for weight, bias in self.layers[:-1]:
            inputs.append(np.tanh(inputs[-1] @ weight + bias))
        weight, bias = self.layers[-1]
        return inputs[-1] @ weight + bias, inputs

    def backward(self, inputs: list[Array], slope: Array) -> list[Array]:
        gradients: list[Array] = []
        for k in reversed(range(len(self.layers))):
            gradients[:0] = [inputs[k].T @ slope, slope.sum(0)]
            if k:
                slope = (slope @ self.layers[k][0].T) * (1.0 - inputs[k] ** 2)
        return gradients


def _orthogonal(n: int, m: int, rng: np.random.Generator) -> Array:
    q, r = np.linalg.qr(rng.standard_normal((max(n, m), min(n, m))))
    q *= np.sign(np.diag(r))
    return (q if n >= m else q.T).astype(np.float32)


@dataclass
class Adam:
    parameters: list[Array]
    count: int = 0
    first: list[Array] = field(default_factory=list)
    second: list[Array] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.first = [np.zeros_like(p) for p in self.parameters]
        self.second = [np.zeros_like(p) for p in self.parameters]

    def step(self, gradients: list[Array], rate: float, most: float = 0.5) -> None:
        norm = float(np.sqrt(sum(float((g * g).sum()) for g in gradients)))
        shrink = np.float32(min(1.0, most / (norm + 1e-8)))
        self.count += 1
        rate *= (1.0 - 0.999**self.count) ** 0.5 / (1.0 - 0.9**self.count)
        for p, g, m, v in zip(self.parameters, gradients, self.first, self.second, strict=True):
            g = g * shrink
            m += np.float32(0.1) * (g - m)
            v += np.float32(0.001) * (g * g - v)
            p -= np.float32(rate) * m / (np.sqrt(v) + np.float32(1e-5))


class Scale:
    """Mean and deviation of what was seen so far."""

    def __init__(self, n: int) -> None:
        self.count, self.mean, self.squares = 1e-4, np.zeros(n), np.full(n, 1e-4)

    def add(self, seen: Array) -> None:
        n, mean, squares = len(seen), seen.mean(0), ((seen - seen.mean(0)) ** 2).sum(0)
        total, apart = self.count + n, mean - self.mean
        self.squares += squares + apart**2 * self.count * n / total
        self.mean += apart * n / total
        self.count = total

    @property
    def both(self) -> tuple[Array, Array]:
        return self.mean.astype(np.float32), np.maximum(np.sqrt(self.squares / self.count), 1e-3).astype(np.float32)


class Plain:
    """A policy sees what the worlds show, and they are told what it says."""

    def __init__(self, env: Any) -> None:
        self.env = env

    def reset(self, seed: int) -> Array:
        return self.env.reset(seed=seed)[0]

    def step(self, action: Array) -> tuple[Any, ...]:
        """What is seen, what was seen last of those whose episode is over, and what the worlds say else."""
        seen, *rest, infos = self.env.step(action)
        return seen, _last(seen, infos), *rest, infos


class Guided:
    """Between them stands `guiding.Guide`; and of each episode what is said is in force one or two control periods later, as these
    worlds have no latency and the tests have: 0.15 s of TIAGo's."""

    def __init__(self, env: Any, robot: Any, rng: np.random.Generator) -> None:
        lidar, n = robot.lidar, env.num_envs
        self.env, self.rng, self.every = env, rng, np.arange(n)
        self.turning, self.tolerance = robot.drive.omega_max, robot.goal_checker.xy_goal_tolerance
        self.guide = guiding.Guide(n, self.turning)
        self.late, self.waiting = np.ones(n, int), np.zeros((3, n, 2))
        step = (lidar.angle_max - lidar.angle_min) / (lidar.beams - 1)
        angles = guiding.directions(lidar.angle_min, step, lidar.beams) + lidar.mount[2]
        self.cos, self.sin, self.mount = np.cos(angles), np.sin(angles), lidar.mount

    def returns(self, raw: Array) -> tuple[Array, Array]:
        """x and y of what the lidar sees, in base_link, m."""
        ranges = raw[:, GOAL + 2 :]
        return self.mount[0] + ranges * self.cos, self.mount[1] + ranges * self.sin

    def reset(self, seed: int) -> Array:
        self.raw = self.env.reset(seed=seed)[0]
        self._begin(np.ones(len(self.raw), bool))
        return self.guide.shown(self.raw, self.speed)

    def step(self, answers: Array) -> tuple[Any, ...]:
        said = self.guide.commands(self.raw, self.speed, answers, self.tolerance)
        self.waiting = np.roll(self.waiting, 1, axis=0)
        self.waiting[0] = said
        v, omega = self.waiting[self.late, self.every].T
        self.raw, *rest, infos = self.env.step(np.stack((v / self.speed, omega / self.turning), axis=1))
        _, terminated, truncated = rest
        last = _last(self.raw, infos)
        self.guide.keep(last)
        shown = seen = self.guide.shown(last, self.speed)
        over = terminated | truncated
        if over.any():
            self._begin(over)
            seen = self.guide.shown(self.raw, self.speed)
        return seen, shown, *rest, infos

    def _begin(self, fresh: Array) -> None:
        self.speed = self.env.most[:, 0].copy()
        self.guide.begin(self.raw, fresh)
        self.waiting[:, fresh] = 0.0
        self.late[fresh] = self.rng.integers(1, 3, int(fresh.sum()))


def _last(seen: Array, infos: dict[str, Any]) -> Array:
    last = seen.copy()
    for j in np.flatnonzero(infos.get("_final_obs", [])):
        last[j] = infos["final_obs"][j]
    return last


class Training:
    """One seed of a task."""

    def __init__(self, name: str, seed: int, settings: Settings) -> None:
        self.task, self.settings = TASKS[name], settings
        self.rng = np.random.default_rng([seed, *name.encode()])
        task = self.task
        self.care, self.robot = 0.0, load_robot(task.options.get("robot", "crowdnav-disc"))
        self.env = make_vec(
            task.suite,
            num_envs=settings.lanes,
            beams=task.beams,
            obstacles=task.obstacles,
            flat=True,
            reward=self.reward,
            **task.options,
        )
        self.eyes = Guided(self.env, self.robot, self.rng) if task.beams else Plain(self.env)
        self.seen = self.eyes.reset(seed * settings.lanes)
        named = axes(self.robot)
        self.free = [k for k, axis in enumerate(named) if axis not in task.held]
        self.axes = len(named)
        n = self.seen.shape[1]
        self.actor = Net([n, *settings.hidden, len(self.free)], 0.01, self.rng)
        self.critic = Net([n, *settings.hidden, 1], 1.0, self.rng)
        self.log_std = np.full(len(self.free), np.log(task.spread), np.float32)
        self.scale = Scale(n)
        self.adams = Adam([*self.actor.parameters, self.log_std]), Adam(self.critic.parameters)
        self.ends: deque[str] = deque(maxlen=1000)

    def reward(self, steps: Steps) -> Array:
        """What a control period is worth to each."""
        task, seen, worth = self.task, steps.seen, default_rewards(steps)
        worth -= self.care * task.contact * np.array([outcome == Outcome.COLLISION for outcome in steps.outcome])
        if task.comfort and task.beams:
            x, y = self.eyes.returns(seen)
            free = np.hypot(x, y).min(1) - circumscribed_radius(self.robot.shape)
            worth -= self.care * task.comfort * np.maximum(1.0 - np.maximum(free, 0.0) / COMFORT, 0.0)
        elif task.comfort:
            x, y, *_, radius, _ = seen[:, GOAL + self.axes :][:, :OBSTACLE].T
            free = np.hypot(x, y) - radius - circumscribed_radius(self.robot.shape)
            worth -= self.care * task.comfort * np.maximum(1.0 - free / COMFORT, 0.0)
        return worth

    def normal(self, seen: Array) -> Array:
        mean, scale = self.scale.both
        return np.clip((seen - mean) / scale, -10.0, 10.0).astype(np.float32)

    def value(self, seen: Array) -> Array:
        return self.critic.forward(self.normal(seen))[0][:, 0]

    def rollout(self) -> tuple[Array, ...]:
        s = self.settings
        t, n, k = s.periods, s.lanes, len(self.free)
        raw = np.empty((t, n, self.seen.shape[1]), np.float32)
        acts = np.empty((t, n, k), np.float32)
        rewards, values, ends = np.empty((t, n), np.float32), np.empty((t + 1, n), np.float32), np.zeros((t, n), bool)
        tails = np.zeros((t, n), np.float32)  # what was still to come when time was over
        std, noise = np.exp(self.log_std), self.rng.standard_normal((t, n, k)).astype(np.float32)
        action = np.zeros((n, self.axes), np.float32)
        for i in range(t):
            raw[i] = self.seen
            x = self.normal(self.seen)
            acts[i] = self.actor.forward(x)[0] + std * noise[i]
            values[i] = self.critic.forward(x)[0][:, 0]
            action[:, self.free] = acts[i]
            self.seen, last, reward, terminated, truncated, infos = self.eyes.step(action)
            rewards[i] = s.reward_scale * reward
            ends[i] = terminated | truncated
            if truncated.any():
                tails[i, truncated] = self.value(last[truncated])
            for j in np.flatnonzero(ends[i]):
                self.ends.append(infos["final_info"]["outcome"][j])
        values[t] = self.value(self.seen)
        advantages, carried = np.empty((t, n), np.float32), np.zeros(n, np.float32)
        for i in reversed(range(t)):
            coming = np.where(ends[i], tails[i], values[i + 1])
            error = rewards[i] + s.gamma * coming - values[i]
            carried = error + np.where(ends[i], 0.0, s.gamma * s.smoothing * carried)
            advantages[i] = carried
        logs = -0.5 * (noise**2).sum(2) - self.log_std.sum()
        flat = [a.reshape(t * n, *a.shape[2:]) for a in (raw, acts, logs, advantages, advantages + values[:t])]
        return tuple(flat)

    def improve(self, rate: float) -> None:
        raw, acts, logs, advantages, returns = self.rollout()
        s, x = self.settings, self.normal(raw)
        for _ in range(s.epochs):
            order = self.rng.permutation(len(x))
            for k in range(0, len(x), s.batch):
                rows = order[k : k + s.batch]
                self._step(x[rows], acts[rows], logs[rows], advantages[rows], returns[rows], rate)
        self.scale.add(raw)  # what is seen is scaled by what was seen before, so that old answers stay comparable

    def _step(self, x: Array, acts: Array, logs: Array, advantages: Array, returns: Array, rate: float) -> None:
        s, n = self.settings, len(x)
        good = (advantages - advantages.mean()) / (advantages.std() + 1e-8)
        mean, inputs = self.actor.forward(x)
        std = np.exp(self.log_std)
        z = (acts - mean) / std
        ratio = np.exp(-0.5 * (z**2).sum(1) - self.log_std.sum() - logs)
        inside = np.where(good > 0.0, ratio < 1.0 + s.clip, ratio > 1.0 - s.clip)
        slope = (-(good * ratio * inside) / n).astype(np.float32)[:, None]
        actor = self.actor.backward(inputs, slope * z / std)
        log_std = (slope * (z**2 - 1.0)).sum(0)
        value, seen = self.critic.forward(x)
        critic = self.critic.backward(seen, ((value[:, 0] - returns) / n).astype(np.float32)[:, None])
        self.adams[0].step([*actor, log_std], rate)
        self.adams[1].step(critic, rate)
        np.clip(self.log_std, -2.5, 0.5, out=self.log_std)

    def success(self, seed: int, episodes: int) -> float:
        """In which share of so many fresh episodes of each lane it arrives, without noise; the training is over then."""
        policy, begun, reached = self.perceptron(), np.zeros(self.settings.lanes, int), 0
        seen = self.eyes.reset(seed)
        while (begun < episodes).any():
            seen, _, _, terminated, truncated, infos = self.eyes.step(policy(seen))
            for j in np.flatnonzero((terminated | truncated) & (begun < episodes)):
                reached += infos["final_info"]["outcome"][j] == Outcome.REACHED
            begun += terminated | truncated
        return reached / (episodes * len(begun))

    def perceptron(self) -> Perceptron:
        mean, scale = self.scale.both
        (weight, bias), layers = self.actor.layers[-1], [(w.copy(), b.copy()) for w, b in self.actor.layers[:-1]]
        out, shift = np.zeros((len(weight), self.axes), np.float32), np.zeros(self.axes, np.float32)
        out[:, self.free], shift[self.free] = weight, bias
        return Perceptron(mean, scale, [*layers, (out, shift)])


def train(name: str, seed: int, minutes: float, steps: int | None, episodes: int, out: Path) -> dict[str, Any]:
    """Train one seed, and write what came of it."""
    settings = Settings()
    training = Training(name, seed, settings)
    training.scale.add(training.rollout()[0])  # compiles, and says what is seen
    began, done, curve = time.process_time(), 0, []
    while True:
        spent = (time.process_time() - began) / (60.0 * minutes) if steps is None else done / steps
        if spent >= 1.0:
            break
        training.care = min(spent / settings.care, 1.0)
        training.improve(settings.rate * max(1.0 - spent, 0.02))
        done += settings.lanes * settings.periods
        success = sum(end == Outcome.REACHED for end in training.ends) / max(len(training.ends), 1)
        curve.append((done, round(success, 3)))
        if len(curve) % 50 == 0:
            print(f"{name} seed {seed}: {done:,} steps, {100 * success:.1f} % of the last arrived", flush=True)
    seconds = time.process_time() - began
    told = {
        "seed": seed, "steps": done, "minutes": round(seconds / 60.0, 2), "success": training.success(HELD + seed * settings.lanes, episodes),
        "training": curve[:: max(len(curve) // 100, 1)],
    }  # fmt: skip
    out.mkdir(parents=True, exist_ok=True)
    file = out / f"{name}-{seed}.npz"
    length = f"--steps {steps}" if steps else f"--minutes {minutes:g}"
    about = {"command": f"benchmarks/train_ppo.py {name} --first {seed} --seeds 1 {length}", "steps": done}
    write_npz(file, Seeing(training.task.beams, training.task.obstacles), Acting(), training.perceptron(), about)
    file.with_suffix(".json").write_text(json.dumps(told))
    return told


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("task", nargs="?", choices=[*TASKS], default="discs")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--minutes", type=float, default=10.0, help="of processor time, a seed")
    parser.add_argument("--steps", type=int, help="instead of the minutes")
    parser.add_argument(
        "--episodes", type=int, default=16, help="of each of 64 lanes, by which a policy's success is told"
    )
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("results/ppo"))
    parser.add_argument("--smoke", action="store_true")
    args = parser.parse_args()
    if args.smoke:
        args.seeds, args.steps, args.workers = 1, 2 * Settings.lanes * Settings.periods, 1
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[name] = "1"  # one core a training: its processes inherit it
    seeds = range(args.first, args.first + args.seeds)
    with ProcessPoolExecutor(args.workers, get_context("spawn")) as pool:
        runs = [
            pool.submit(train, args.task, seed, args.minutes, args.steps, args.episodes, args.out) for seed in seeds
        ]
        for run in runs:
            print(run.result(), flush=True)


if __name__ == "__main__":
    main()
