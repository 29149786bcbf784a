"""Proximal policy optimisation (Schulman et al. 2017), in NumPy alone.

Two perceptrons of two layers of 128, one for the mean of a normal distribution, one for the value; generalised advantages; Adam.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np

from clearway.navigators.learnt.policy import Perceptron
from clearway.trials import Outcome
from ppo.tasks import Worlds

Array = np.ndarray


@dataclass(frozen=True)
class Settings:
    """Of the optimisation."""

    lanes: int = 64
    periods: int = 64  # that each drives in a round
    epochs: int = 5
    batch: int = 1024
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


class Learner:
    """A policy that is learnt in some worlds.

    Args:
        worlds: They; `lanes` of them.
        rng: Of all that is drawn.
        seed: Where the worlds' own begin.
        settings: Of the optimisation.

    Attributes:
        ends: How the last 1,000 episodes ended.
    """

    def __init__(self, worlds: Worlds, rng: np.random.Generator, seed: int, settings: Settings) -> None:
        self.worlds, self.rng, self.settings = worlds, rng, settings
        self.seen = worlds.reset(seed)
        n, k = self.seen.shape[1], len(worlds.free)
        self.actor = Net([n, *settings.hidden, k], 0.01, rng)
        self.critic = Net([n, *settings.hidden, 1], 1.0, rng)
        self.log_std = np.full(k, np.log(worlds.task.spread), np.float32)
        self.scale = Scale(n)
        self.adams = Adam([*self.actor.parameters, self.log_std]), Adam(self.critic.parameters)
        self.ends: deque[str] = deque(maxlen=1000)
        self.scale.add(self.rollout()[0])  # compiles, and says what is seen

    def normal(self, seen: Array) -> Array:
        mean, scale = self.scale.both
        return np.clip((seen - mean) / scale, -10.0, 10.0).astype(np.float32)

    def value(self, seen: Array) -> Array:
        return self.critic.forward(self.normal(seen))[0][:, 0]

    def rollout(self) -> tuple[Array, ...]:
        s = self.settings
        t, n, k = s.periods, s.lanes, len(self.worlds.free)
        raw = np.empty((t, n, self.seen.shape[1]), np.float32)
        acts = np.empty((t, n, k), np.float32)
        rewards, values, ends = np.empty((t, n), np.float32), np.empty((t + 1, n), np.float32), np.zeros((t, n), bool)
        tails = np.zeros((t, n), np.float32)  # what was still to come when time was over
        std, noise = np.exp(self.log_std), self.rng.standard_normal((t, n, k)).astype(np.float32)
        action = np.zeros((n, self.worlds.axes), np.float32)
        for i in range(t):
            raw[i] = self.seen
            x = self.normal(self.seen)
            acts[i] = self.actor.forward(x)[0] + std * noise[i]
            values[i] = self.critic.forward(x)[0][:, 0]
            action[:, self.worlds.free] = acts[i]
            self.seen, last, reward, terminated, truncated, infos = self.worlds.step(action)
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

    def improve(self, spent: float) -> None:
        """A round, where this share of the training is over."""
        self.worlds.care = min(spent / self.settings.care, 1.0)
        rate = self.worlds.task.rate * max(1.0 - spent, 0.02)
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
        seen = self.worlds.reset(seed)
        while (begun < episodes).any():
            seen, _, _, terminated, truncated, infos = self.worlds.step(policy(seen))
            for j in np.flatnonzero((terminated | truncated) & (begun < episodes)):
                reached += infos["final_info"]["outcome"][j] == Outcome.REACHED
            begun += terminated | truncated
        return reached / (episodes * len(begun))

    def perceptron(self) -> Perceptron:
        mean, scale = self.scale.both
        (weight, bias), layers = self.actor.layers[-1], [(w.copy(), b.copy()) for w, b in self.actor.layers[:-1]]
        out, shift = np.zeros((len(weight), self.worlds.axes), np.float32), np.zeros(self.worlds.axes, np.float32)
        out[:, self.worlds.free], shift[self.worlds.free] = weight, bias
        return Perceptron(mean, scale, [*layers, (out, shift)])
