"""A policy: a function from what is seen to what is said, read from a file."""

from __future__ import annotations

import json
import re
import zipfile
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from clearway.errors import ClearwayError, shown
from clearway.navigators.learnt.encoding import Acting, Numbers, Seeing, axes
from clearway.robots import Robot

FORMAT = 1
"""Of an npz file with a policy."""
MOST_BYTES = 64 << 20
"""Of a policy's file: a hundred times any that drives a robot from a lidar."""

_BROKEN = (
    OSError, EOFError, ValueError, KeyError, TypeError, MemoryError, OverflowError, zlib.error, zipfile.BadZipFile
)  # fmt: skip
"""What reading a file raises that is none of ours, or whose arrays are not as large as they say."""


@dataclass(frozen=True, slots=True, eq=False)
class Policy:
    """What decides for a robot.

    Attributes:
        file: Where it was read from.
        seeing: What it sees, in a row.
        acting: What its answer means.
        answer: The function, (n,) to (k,).
        says: How many numbers it answers; None: nobody knows before.
        sees: How many it is to be given; None: nobody knows before.
    """

    file: Path
    seeing: Seeing
    acting: Acting
    answer: Callable[[Numbers], npt.NDArray[np.float32]]
    says: int | None
    sees: int | None

    def check(self, robot: Robot) -> None:
        """Whether it can drive `robot`.

        Raises:
            ClearwayError: the robot can't see what it sees, or is told another number of things.
        """
        self.seeing.check(robot)
        told, sizes = axes(robot), self.seeing.sizes(robot)
        if self.says not in (None, len(told)):
            raise ClearwayError(
                f"it answers {self.says} numbers, and robot {robot.name!r} is told {len(told)}: {', '.join(told)}",
                file=self.file,
            )
        if self.sees not in (None, sum(sizes.values())):
            parts = ", ".join(f"{name} {size}" for name, size in sizes.items())
            raise ClearwayError(
                f"it sees {self.sees} numbers, and of robot {robot.name!r} there are {sum(sizes.values())}: {parts}",
                file=self.file,
            )


def read_npz(file: Path) -> Policy:
    """A perceptron with tanh between its layers, as `write_npz` writes it.

    Raises:
        ClearwayError: there is no such file, or it is something else.
    """
    _refuse_large(file)
    try:
        with np.load(file, allow_pickle=False) as held:
            arrays = {name: held[name] for name in held.files}
        about = json.loads(str(arrays.pop("about")[()]))
        if about["format"] != FORMAT:
            raise ClearwayError(
                f"{shown(about['format'])} is no format that is read; {FORMAT} is", file=file, field="format"
            )
        for name, array in arrays.items():
            if array.dtype.kind not in "fiu":
                raise ClearwayError(f"holds {array.dtype}, and no numbers", file=file, field=name)
        mean, scale = (arrays.pop(name).astype(np.float32) for name in ("mean", "scale"))
        known = re.compile(r"(weight|bias)_\d+")
        if strange := [name for name in arrays if not known.fullmatch(name)]:
            raise ClearwayError(f"holds {shown(strange[0])} beside a policy; take it away", file=file)
        n = (len(arrays) + 1) // 2  # so that one without its other half is missed, not left out
        layers = [(arrays[f"weight_{k}"].astype(np.float32), arrays[f"bias_{k}"].astype(np.float32)) for k in range(n)]
        if not isinstance(normalised := about["normalised"], bool):
            raise ClearwayError(f"{shown(normalised)} is none; true or false is", file=file, field="normalised")
        seeing, acting = Seeing(about["beams"], about["obstacles"]), Acting(normalised)
    except ClearwayError as error:
        raise ClearwayError(error.problem, file=file, field=error.field) from error
    except _BROKEN as error:
        raise ClearwayError(
            f"holds no policy ({type(error).__name__}: {error}); docs/how-to/learning.md says what it must", file=file
        ) from error
    for name, array in [("mean", mean), *((f"bias_{k}", bias) for k, (_, bias) in enumerate(layers))]:
        if array.ndim != 1:
            raise ClearwayError(f"is {array.shape}; one row of numbers is expected", file=file, field=name)
    sizes = [len(mean), *(len(bias) for _, bias in layers)]
    for k, (weight, _) in enumerate(layers):
        if weight.shape != (sizes[k], sizes[k + 1]):
            raise ClearwayError(
                f"is {weight.shape}; {(sizes[k], sizes[k + 1])} is expected", file=file, field=f"weight_{k}"
            )
    flat = [scale, mean, *(array for layer in layers for array in layer)]
    if not layers or scale.shape != mean.shape or not all(np.isfinite(array).all() for array in flat):
        raise ClearwayError(
            "has no layers, numbers that are not finite, or a scale of another size than the mean", file=file
        )
    if not (scale > 0.0).all():
        raise ClearwayError("holds numbers that are not above 0, and divides by them", file=file, field="scale")
    return Policy(file, seeing, acting, Perceptron(mean, scale, layers), sizes[-1], sizes[0])


def write_npz(
    file: Path, seeing: Seeing, acting: Acting, perceptron: Perceptron, about: Mapping[str, Any] | None = None
) -> None:
    """Write a policy that `npz:FILE` drives by.

    Args:
        file: Where to.
        seeing: What it sees.
        acting: What it says.
        perceptron: Itself.
        about: What else is told of it, as JSON values.
    """
    told = {
        **(about or {}), "format": FORMAT, "beams": seeing.beams, "obstacles": seeing.obstacles, "normalised": acting.normalised
    }  # fmt: skip
    layers: Any = {
        f"{what}_{k}": a
        for k, layer in enumerate(perceptron.layers)
        for what, a in zip(("weight", "bias"), layer, strict=True)
    }
    np.savez_compressed(
        file, about=np.array(json.dumps(told, sort_keys=True)), mean=perceptron.mean, scale=perceptron.scale, **layers
    )  # type: ignore[arg-type]


@dataclass(frozen=True, slots=True, eq=False)
class Perceptron:
    """Layers with tanh between them.

    Attributes:
        mean: (n,) what is taken from what is seen.
        scale: (n,) by what the rest is divided.
        layers: Of each its weights (in, out) and biases (out,).
    """

    mean: Numbers
    scale: Numbers
    layers: Sequence[tuple[Numbers, Numbers]]

    def __call__(self, seen: Numbers) -> npt.NDArray[np.float32]:
        """(..., k) its answer to (..., n) what is seen."""
        h = np.clip((seen - self.mean) / self.scale, -10.0, 10.0)
        for weight, bias in self.layers[:-1]:
            h = np.tanh(h @ weight + bias)
        weight, bias = self.layers[-1]
        answer: npt.NDArray[np.float32] = h @ weight + bias
        return answer


def read_onnx(file: Path, seeing: Seeing, acting: Acting) -> Policy:
    """Whatever ONNX says, of one input (1, n) in float32, whose first output is (1, k).

    Raises:
        ClearwayError: there is no such file, it is something else, or the package onnxruntime is missing.
    """
    _refuse_large(file)
    try:
        import onnxruntime
    except ModuleNotFoundError as error:
        raise ClearwayError(
            "a policy in ONNX takes the package onnxruntime: pip install 'clearway[onnx]'", file=file
        ) from error
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1  # the same bits, and one core a worker
    options.log_severity_level = 4
    try:
        session = onnxruntime.InferenceSession(str(file), options, providers=["CPUExecutionProvider"])
    except Exception as error:
        raise ClearwayError(f"holds no policy in ONNX: {str(error).strip()[:300]}", file=file) from error
    inputs, first = session.get_inputs(), session.get_outputs()[0]
    if len(inputs) != 1 or inputs[0].type != "tensor(float)" or len(inputs[0].shape) != 2:
        raise ClearwayError("has not one input of two axes in float32, as a policy here must", file=file)
    for what, shape, right in (("input", inputs[0].shape, "(1, n)"), ("first output", first.shape, "(1, k)")):
        if len(shape) != 2 or (isinstance(shape[0], int) and shape[0] != 1):
            raise ClearwayError(f"its {what} is {tuple(shape)}; {right} is expected", file=file)

    def answer(seen: Numbers) -> npt.NDArray[np.float32]:
        said: npt.NDArray[np.float32] = session.run([first.name], {inputs[0].name: seen[None]})[0][0]
        return said

    sees, says = ((size if isinstance(size, int) else None) for size in (inputs[0].shape[1], first.shape[-1]))
    return Policy(file, seeing, acting, answer, says, sees)


def _refuse_large(file: Path) -> None:
    try:
        size = file.stat().st_size
        file.open("rb").close()
    except OSError as error:
        raise ClearwayError(f"cannot be read: {error.strerror}", file=file) from error
    if size > MOST_BYTES:
        raise ClearwayError(f"has {size:,} bytes; a policy has at most {MOST_BYTES:,}", file=file)
