"""Trains the learnt navigators that come with Clearway: proximal policy optimisation (Schulman et al. 2017) on its own worlds.

    python benchmarks/train_ppo.py discs|lidar [--seeds 5] [--minutes M] [--workers 2] [--out FOLDER] [--smoke]

Each seed is a training of its own, in a process with one core, for so many minutes of processor time; five of nine minutes by
two workers are over within half an hour. What comes of each is written as FOLDER/TASK-SEED.npz, which `clearway run -n npz:FILE` drives by,
and beside it TASK-SEED.json: how its success grew on what it was trained on. Training takes numpy alone; how many steps nine
minutes are depends on the machine, so `--steps` stands where the same bits are wanted.

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

from clearway.navigators.learnt.encoding import Acting, Seeing, axes
from clearway.navigators.learnt.policy import Perceptron, write_npz

Array = np.ndarray


@dataclass(frozen=True)
class Task:
    """What is learnt: where, with which eyes, and by how far it looks ahead."""

    suite: str
    options: dict[str, Any]
    beams: int = 0
    obstacles: int = 0
    held: tuple[str, ...] = ()  # axes that are never used
    gamma: float = 0.99


TASKS = {
    "discs": Task(
        "crowd", {"batches": ("circle-invisible", "square-invisible")}, obstacles=5, held=("omega",), gamma=0.97
    ),
    "lidar": Task("hospital", {"robot": "tiago"}, beams=60, gamma=0.99),
}


@dataclass(frozen=True)
class Settings:
    """Of the optimisation."""

    rollout: int = 2048
    epochs: int = 8
    batch: int = 256
    rate: float = 5e-4
    clip: float = 0.2
    smoothing: float = 0.95  # the lambda of generalised advantages
    entropy: float = 1e-3
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


class Training:
    """One seed of a task."""

    def __init__(self, name: str, seed: int, settings: Settings) -> None:
        import clearway.learning

        self.task, self.settings = TASKS[name], settings
        self.rng = np.random.default_rng([seed, *name.encode()])
        task = self.task
        self.env = clearway.learning.make(
            task.suite, beams=task.beams, obstacles=task.obstacles, flat=True, indicators=False, **task.options
        )
        self.seen, _ = self.env.reset(seed=seed)
        robot = self.env.episode.robots[0]
        named = axes(robot)
        self.free = [k for k, axis in enumerate(named) if axis not in task.held]
        self.axes = len(named)
        n = len(self.seen)
        self.actor = Net([n, *settings.hidden, len(self.free)], 0.01, self.rng)
        self.critic = Net([n, *settings.hidden, 1], 1.0, self.rng)
        self.log_std = np.full(len(self.free), -0.5, np.float32)
        self.scale = Scale(n)
        self.adam = Adam([*self.actor.parameters, self.log_std, *self.critic.parameters])
        self.ends: deque[str] = deque(maxlen=200)

    def normal(self, seen: Array) -> Array:
        mean, scale = self.scale.both
        return np.clip((seen - mean) / scale, -10.0, 10.0).astype(np.float32)

    def rollout(self) -> tuple[Array, ...]:
        s, n = self.settings, self.settings.rollout
        raw = np.empty((n, len(self.seen)), np.float32)
        acts, rewards, values = np.empty((n, len(self.free)), np.float32), np.empty(n), np.empty(n + 1)
        logs, ends, tails = (
            np.empty(n),
            np.zeros(n, bool),
            np.zeros(n),
        )  # tails: what was still to come when time was over
        std, noise = np.exp(self.log_std), self.rng.standard_normal((n, len(self.free))).astype(np.float32)
        action = np.zeros(self.axes, np.float32)
        for i in range(n):
            raw[i] = self.seen
            x = self.normal(self.seen[None])
            acts[i] = self.actor.forward(x)[0][0] + std * noise[i]
            values[i] = self.critic.forward(x)[0][0, 0]
            logs[i] = -0.5 * float((noise[i] ** 2).sum()) - float(self.log_std.sum())
            action[self.free] = acts[i]
            self.seen, reward, terminated, truncated, info = self.env.step(action)
            rewards[i] = s.reward_scale * reward
            if terminated or truncated:
                ends[i] = True
                if truncated:
                    tails[i] = self.critic.forward(self.normal(self.seen[None]))[0][0, 0]
                self.ends.append(info["outcome"])
                self.seen, _ = self.env.reset()
        values[n] = self.critic.forward(self.normal(self.seen[None]))[0][0, 0]
        advantages, carried = np.empty(n), 0.0
        for i in reversed(range(n)):
            coming = tails[i] if ends[i] else values[i + 1]
            error = rewards[i] + self.task.gamma * coming - values[i]
            carried = error + (0.0 if ends[i] else self.task.gamma * s.smoothing * carried)
            advantages[i] = carried
        return raw, acts, logs, advantages, advantages + values[:n]

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
        log_std = (slope * (z**2 - 1.0)).sum(0) - np.float32(s.entropy)
        value, seen = self.critic.forward(x)
        critic = self.critic.backward(seen, ((value[:, 0] - returns) / n).astype(np.float32)[:, None])
        self.adam.step([*actor, log_std, *critic], rate)
        np.clip(self.log_std, -2.5, 0.5, out=self.log_std)

    def perceptron(self) -> Perceptron:
        mean, scale = self.scale.both
        (weight, bias), layers = self.actor.layers[-1], [(w.copy(), b.copy()) for w, b in self.actor.layers[:-1]]
        out, shift = np.zeros((len(weight), self.axes), np.float32), np.zeros(self.axes, np.float32)
        out[:, self.free], shift[self.free] = weight, bias
        return Perceptron(mean, scale, [*layers, (out, shift)])


def train(name: str, seed: int, minutes: float, steps: int | None, out: Path) -> dict[str, Any]:
    """Train one seed, and write what came of it."""
    settings = Settings()
    training = Training(name, seed, settings)
    training.rollout()  # compiles, and says what is seen
    training.scale.add(training.rollout()[0])
    began, done, curve = time.process_time(), 0, []
    while True:
        spent = (time.process_time() - began) / (60.0 * minutes) if steps is None else done / steps
        if spent >= 1.0:
            break
        training.improve(settings.rate * max(1.0 - spent, 0.02))
        done += settings.rollout
        success = sum(end == "reached" for end in training.ends) / max(len(training.ends), 1)
        curve.append((done, round(success, 3)))
        if len(curve) % 20 == 0:
            print(
                f"{name} seed {seed}: {done:,} steps, {100 * spent:.0f} %, of the last 200 {100 * success:.1f} % arrived",
                flush=True,
            )
    task = training.task
    about = {
        "suite": task.suite,
        "options": task.options,
        "seed": seed,
        "steps": done,
        "command": "benchmarks/train_ppo.py",
    }
    out.mkdir(parents=True, exist_ok=True)
    file = out / f"{name}-{seed}.npz"
    write_npz(file, Seeing(task.beams, task.obstacles), Acting(), training.perceptron(), about)
    told = {"seed": seed, "steps": done, "success": curve[-1][1] if curve else None, "bytes": file.stat().st_size}
    file.with_suffix(".json").write_text(json.dumps({**told, "curve": curve[:: max(len(curve) // 100, 1)]}))
    return told


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("task", nargs="?", choices=[*TASKS], default="discs")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--minutes", type=float, default=9.0, help="of processor time, a seed")
    parser.add_argument("--steps", type=int, help="instead of the minutes")
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--out", type=Path, default=Path("results/ppo"))
    parser.add_argument("--smoke", action="store_true")
    args = parser.parse_args()
    if args.smoke:
        args.seeds, args.steps, args.workers = 1, 2 * Settings.rollout, 1
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ[name] = "1"  # one core a training: its processes inherit it
    seeds = range(args.first, args.first + args.seeds)
    with ProcessPoolExecutor(args.workers, get_context("spawn")) as pool:
        runs = [pool.submit(train, args.task, seed, args.minutes, args.steps, args.out) for seed in seeds]
        for run in runs:
            print(run.result(), flush=True)


if __name__ == "__main__":
    main()
