"""From markers to motion: path that noise adds, how often the stated uncertainty holds, and how fast poses are fitted.

Made-up captures: eight markers as on paper A's robots, 100 Hz, 0.5 mm of noise a coordinate.

    python benchmarks/marker_motion.py [--draws N] [--smoke]
"""

from __future__ import annotations

import argparse
import time

import numpy as np
from scipy.spatial.transform import Rotation

from clearway.recordings.motion import rigid
from clearway.recordings.motion.filtering import lowpass
from clearway.recordings.motion.markers import MarkerSet, motion_of_markers
from clearway.recordings.motion.motion import MotionSpec
from clearway.recordings.recording import Points

RATE, NOISE = 100.0, 0.0005
MODEL = np.array(
    [
        [0.20, 0.15, 0.30], [0.18, -0.16, 0.32], [-0.21, 0.14, 0.35], [-0.17, -0.19, 0.31],
        [0.05, 0.02, 0.90], [-0.06, 0.11, 0.85], [0.22, 0.01, 0.60], [-0.12, -0.08, 0.75],
    ]
)  # fmt: skip
NAMES = tuple(f"m{i}" for i in range(1, 9))


def captured(pose: np.ndarray, seed: int) -> Points:
    """The markers of a body that went through `pose` (n, 3)."""
    turned = Rotation.from_euler("z", pose[:, 2:]).as_matrix()
    xyz = np.einsum("nij,mj->nmi", turned, MODEL)
    xyz[:, :, :2] += pose[:, None, :2]
    return Points(NAMES, np.arange(len(pose)) / RATE, xyz + np.random.default_rng(seed).normal(0, NOISE, xyz.shape))


def length(xy: np.ndarray) -> float:
    return float(np.hypot(*np.diff(xy[:, :2], axis=0).T).sum())


def eight(seconds: float) -> np.ndarray:
    """A figure of eight of 1.5 m, 20 s a round."""
    a = 2 * np.pi * np.arange(round(seconds * RATE)) / RATE / 20
    heading = np.unwrap(np.arctan2(np.cos(2 * a), np.cos(a)))
    return np.stack([1.5 * np.sin(a), 1.5 * np.sin(a) * np.cos(a), heading], axis=1)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=100)
    parser.add_argument("--smoke", action="store_true")
    asked = parser.parse_args()
    draws, frames = (2, 400) if asked.smoke else (asked.draws, 20_000)

    still = captured(np.zeros((round(10 * RATE), 3)), 0)
    fit = rigid.fit(still.xyz, MODEL).translation[:, :2]
    own = motion_of_markers(still, MarkerSet(NAMES, MODEL), MotionSpec(), None)
    low = lowpass(fit, 6.0, RATE)
    print("path of a robot that stands for 10 s, mm:")
    print(
        f"  fitted {1e3 * length(fit):.0f}, low-pass of 6 Hz {1e3 * length(low):.0f}, Clearway {1e3 * length(own.pose):.1f}"
    )

    t = np.arange(round(12 * RATE)) / RATE  # 0.5 m/s, reached and left at 0.5 m/s^2
    v = np.clip(np.minimum(0.5 * (t - 0.5), 0.5 * (11.5 - t)), 0, 0.5)
    along = np.concatenate([[0.0], np.cumsum((v[1:] + v[:-1]) / 2 / RATE)])
    straight = np.stack([along, 0 * t, 0 * t], axis=1)
    added = [1e3 * (length(motion_of_markers(captured(straight, s), MarkerSet(NAMES, MODEL), MotionSpec(), None).pose) - along[-1])
             for s in range(min(draws, 20))]  # fmt: skip
    print(f"{along[-1]:.0f} m straight: {min(added):+.1f} to {max(added):+.1f} mm of path too much")

    true, one, two = eight(20.0 if not asked.smoke else 4.0), [], []
    for seed in range(draws):
        motion = motion_of_markers(captured(true, seed), MarkerSet(NAMES, MODEL), MotionSpec(), None)
        assert motion.sigma is not None
        off = np.abs(motion.pose - true) / motion.sigma[:, [0, 0, 1]]
        one.append((off < 1).mean(axis=0))
        two.append((off < 2).mean(axis=0))
    for k, share in ((1, one), (2, two)):
        x, y, heading = 100 * np.mean(share, axis=0)
        print(f"figure of eight, within {k} sigma: x {x:.0f} %, y {y:.0f} %, heading {heading:.0f} % ({draws} draws)")

    xyz = captured(np.tile(true, (frames // len(true) + 1, 1))[:frames], 0).xyz
    begun = time.perf_counter()
    rigid.fit(xyz, MODEL)
    ours = (time.perf_counter() - begun) / frames
    begun = time.perf_counter()
    some = xyz[: max(100, frames // 20)]
    for seen in some:
        Rotation.align_vectors(seen - seen.mean(axis=0), MODEL - MODEL.mean(axis=0))
    scipys = (time.perf_counter() - begun) / len(some)
    print(
        f"rigid fit: {1 / ours:,.0f} frames/s; scipy's align_vectors, one by one, takes {scipys / ours:.0f} times as long"
    )


if __name__ == "__main__":
    main()
