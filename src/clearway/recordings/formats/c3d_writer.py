"""Writes C3D files: real numbers or scaled integers, of any of the format's processors, captures of any length."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from clearway.errors import ClearwayError
from clearway.recordings.formats.c3d_parameters import (
    BLOCK,
    UP,
    Head,
    Parameter,
    header_block,
    integers,
    one_text,
    parameter_section,
    real,
    real_bytes,
    text_parameter,
    word_bytes,
)
from clearway.recordings.formats.capture_fields import UNITS
from clearway.recordings.formats.text import writing
from clearway.recordings.recording import Recording

CHUNK = 4 << 20
"""Bytes of data that are held at a time."""


def write(
    path: Path,
    recording: Recording,
    *,
    processor: str = "intel",
    scale: float = -0.1,
    units: str = "mm",
    up: str = "+Z",
) -> None:
    """The recording's points as a C3D file.

    Frame 1 is t = 0; a frame that the recording lacks is one in which nothing was seen.

    Args:
        path: The file.
        recording: What has the points.
        processor: Whose byte order: `intel`, `dec` or `mips`.
        scale: One unit of an integer, in `units`; negative for real numbers.
        units: Of lengths.
        up: The axis of the file that is up.

    Raises:
        ClearwayError: it has no points, or its times are not those of frames at one rate.
    """
    points = recording.points
    if points is None or not points.names or len(points.t) < 2:
        raise ClearwayError("there are no markers to write, with at least two frames", file=path)
    step = float(np.median(np.diff(points.t)))
    index = np.rint((points.t - points.t[0]) / step).astype(np.int64)
    # The mean step is the better one, once it is known how many steps there are: t of float32 or decimals is rounded.
    step = float(points.t[-1] - points.t[0]) / int(index[-1])
    if np.abs(points.t - points.t[0] - index * step).max() > 0.1 * step or not (np.diff(index) > 0).all():
        raise ClearwayError("its times are not those of frames at one rate; C3D has no others", file=path)
    frames, many = int(index[-1]) + 1, len(points.names)
    first = max(1, round(float(points.t[0]) / step) + 1)
    last = first + frames - 1
    head = Head(processor, many, 0, min(first, 65535), min(last, 65535), scale, 0, 1 / step)
    groups = _parameter_groups(points.names, head, first, last, units, up)
    start = 2 + len(parameter_section(groups, processor)) // BLOCK
    groups["POINT"]["DATA_START"] = integers([start], processor)
    section = parameter_section(groups, processor)
    turn = np.array(UP[up], dtype=np.float64) / UNITS[units] / (scale if scale > 0 else 1.0)
    with writing(path) as f:
        f.write(header_block(replace(head, data_block=start)) + section)
        at_once = max(1, CHUNK // (many * 16))
        for at in range(0, frames, at_once):
            begin, end = np.searchsorted(index, (at, at + at_once))
            rows = np.zeros((min(at_once, frames - at), many, 4))
            rows[..., 3] = -1
            xyz = points.xyz[begin:end] @ turn
            seen: Any = np.isfinite(xyz).all(axis=2)
            if scale > 0 and np.abs(xyz, out=np.zeros_like(xyz), where=seen[..., None]).max(initial=0.0) > 32767:
                raise ClearwayError(f"positions don't fit into 16 bits of {scale:g} {units}; take more", file=path)
            # One camera saw it, so that a marker at the origin is told from one that nobody saw.
            there = np.concatenate(
                (np.where(seen[..., None], xyz, 0.0), np.where(seen, 256.0, -1.0)[..., None]), axis=2
            )
            rows[index[begin:end] - at] = there
            f.write(word_bytes(np.rint(rows), processor) if scale > 0 else real_bytes(rows, processor))
        f.write(b"\0" * (-f.tell() % BLOCK))


def _parameter_groups(
    names: tuple[str, ...], head: Head, first: int, last: int, units: str, up: str
) -> dict[str, dict[str, Parameter]]:
    p = head.processor
    frames = last - first + 1
    point = {
        "USED": integers([head.points], p),
        "FRAMES": integers([min(frames, 65535)], p),
        "DATA_START": integers([0], p),
        "SCALE": real(head.scale, p),
        "RATE": real(head.rate, p),
        "UNITS": one_text(units),
        "X_SCREEN": one_text("+X"),
        "Y_SCREEN": one_text(up),
    }
    for kind in ("LABELS", "DESCRIPTIONS"):
        for k, at in enumerate(range(0, len(names), 255), start=1):
            title = kind if k == 1 else f"{kind}{k}"
            point[title] = text_parameter(
                names[at : at + 255] if kind == "LABELS" else [" "] * len(names[at : at + 255])
            )
    groups = {"POINT": point, "ANALOG": {"USED": integers([0], p)}}
    if last > 65535:
        point["LONG_FRAMES"] = real(frames, p)
        low_high = {"START": (first % 65536, first // 65536), "END": (last % 65536, last // 65536)}
        groups["TRIAL"] = {f"ACTUAL_{k}_FIELD": integers(v, p) for k, v in low_high.items()}
    return groups
