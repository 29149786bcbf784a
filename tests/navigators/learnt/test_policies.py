"""Policies from files: what they see, what is wrong with them, and that two formats of one policy drive alike."""

from __future__ import annotations

import io
import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clearway import simulate
from clearway.errors import ClearwayError
from clearway.navigators.learnt.encoding import Acting, Seeing
from clearway.navigators.learnt.policy import Perceptron, read_npz, write_npz
from clearway.navigators.registry import make_navigator
from clearway.robots import load_robot

SEEING = Seeing(obstacles=2)
SIZE, AXES = 4 + 2 + 2 * 6, 2


def perceptron(size: int = SIZE, axes: int = AXES) -> Perceptron:
    """Whatever a generator says, with two layers; it drives ahead."""
    rng = np.random.default_rng(1)
    layers = [
        (rng.normal(0.0, 0.2, (size, 8)).astype(np.float32), rng.normal(0.0, 0.2, 8).astype(np.float32)),
        (rng.normal(0.0, 0.2, (8, axes)).astype(np.float32), np.array([0.5, *[0.0] * (axes - 1)], np.float32)),
    ]
    mean, scale = rng.normal(0.0, 1.0, size), rng.uniform(0.5, 2.0, size)
    return Perceptron(mean.astype(np.float32), scale.astype(np.float32), layers)


def written(folder: Path, **changes: Any) -> Path:
    """A policy's file, some of whose arrays are others; None: missing."""
    file = folder / "policy.npz"
    write_npz(file, SEEING, Acting(), perceptron())
    if changes:
        with np.load(file) as held:
            arrays = {k: v for k, v in {**held, **changes}.items() if v is not None}
        np.savez(file, **arrays)
    return file


def about(**changes: Any) -> np.ndarray:
    """What a policy's file tells of itself, some of it another."""
    return np.array(json.dumps({"format": 1, "beams": 0, "obstacles": 2, "normalised": True} | changes))


def onnx_of(policy: Perceptron, file: Path) -> Path:
    """The same policy in ONNX."""
    helper = pytest.importorskip("onnx").helper
    from onnx import TensorProto, numpy_helper

    arrays = {"mean": policy.mean, "scale": policy.scale, "low": np.float32(-10.0), "high": np.float32(10.0)}
    nodes = [("Sub", ("seen", "mean"), "s"), ("Div", ("s", "scale"), "d"), ("Clip", ("d", "low", "high"), "h0")]
    for k, (weight, bias) in enumerate(policy.layers):
        arrays |= {f"w{k}": weight, f"b{k}": bias}
        last = k + 1 == len(policy.layers)
        nodes += [("MatMul", (f"h{k}", f"w{k}"), f"m{k}"), ("Add", (f"m{k}", f"b{k}"), "said" if last else f"a{k}")]
        nodes += [] if last else [("Tanh", (f"a{k}",), f"h{k + 1}")]
    graph = helper.make_graph(
        [helper.make_node(kind, inputs, [output]) for kind, inputs, output in nodes],
        "policy",
        [helper.make_tensor_value_info("seen", TensorProto.FLOAT, [1, len(policy.mean)])],
        [helper.make_tensor_value_info("said", TensorProto.FLOAT, [1, len(policy.layers[-1][1])])],
        [numpy_helper.from_array(np.asarray(array), name) for name, array in arrays.items()],
    )
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=9)
    file.write_bytes(model.SerializeToString())
    return file


def test_a_file_holds_what_was_written(tmp_path: Path) -> None:
    policy, seen = read_npz(written(tmp_path)), np.random.default_rng(2).normal(size=SIZE).astype(np.float32)
    assert (policy.seeing, policy.acting, policy.sees, policy.says) == (SEEING, Acting(), SIZE, AXES)
    assert np.array_equal(policy.answer(seen), perceptron()(seen))
    assert np.array_equal(perceptron()(np.stack((seen, seen)))[1].round(5), perceptron()(seen).round(5))


def test_onnx_and_npz_of_one_policy_answer_alike(tmp_path: Path) -> None:
    pytest.importorskip("onnxruntime")
    file = onnx_of(perceptron(), tmp_path / "policy.onnx")
    one = make_navigator(f"npz:{written(tmp_path)}")
    other = make_navigator(f"onnx:{file}[obstacles=2]")
    for seed in range(20):
        seen = np.random.default_rng(seed).normal(size=SIZE).astype(np.float32)
        assert other._policy.answer(seen) == pytest.approx(one._policy.answer(seen), abs=1e-5)  # type: ignore[attr-defined]
    assert other.needs == {"obstacles"}
    with pytest.raises(ClearwayError, match=r"sees 18 numbers, and of robot 'tiago' there are 12"):
        make_navigator(f"onnx:{file}[obstacles=1]").read_parameters(load_robot("tiago"))  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("sees", "says", "said"),
    [
        ([1, SIZE], [AXES], r"its first output is \(2,\); \(1, k\) is expected"),
        ([1, SIZE], [], r"its first output is \(\); \(1, k\) is expected"),
        ([8, SIZE], [8, AXES], rf"its input is \(8, {SIZE}\); \(1, n\) is expected"),
    ],
)
def test_onnx_of_another_shape_is_refused_before_it_drives(
    tmp_path: Path, sees: list[int], says: list[int], said: str
) -> None:
    pytest.importorskip("onnxruntime")
    helper = pytest.importorskip("onnx").helper
    from onnx import TensorProto

    weight = helper.make_tensor("weight", TensorProto.FLOAT, (SIZE, AXES), np.zeros(SIZE * AXES))
    shape = helper.make_tensor("shape", TensorProto.INT64, (len(says),), says)
    nodes = [helper.make_node("MatMul", ["seen", "weight"], ["row"])]
    if says:
        nodes.append(helper.make_node("Reshape", ["row", "shape"], ["said"]))
    else:
        nodes.append(helper.make_node("ReduceSum", ["row"], ["said"], keepdims=0))
    graph = helper.make_graph(
        nodes,
        "policy",
        [helper.make_tensor_value_info("seen", TensorProto.FLOAT, sees)],
        [helper.make_tensor_value_info("said", TensorProto.FLOAT, says)],
        [weight, shape],
    )
    file = tmp_path / "policy.onnx"
    model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=9)
    file.write_bytes(model.SerializeToString())
    with pytest.raises(ClearwayError, match=said):
        make_navigator(f"onnx:{file}[obstacles=2]")


def test_a_policy_drives_a_trial(tmp_path: Path) -> None:
    trial = simulate("people", "tiago", f"npz:{written(tmp_path)}", name="passing-r1")
    moved = float(np.hypot(*np.diff(trial.pose[:, :2], axis=0).T).sum())
    assert moved > 0.1
    assert "npz:" in trial.attempt.navigator


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"about": None}, "holds no policy"),
        ({"about": np.array("{}")}, "holds no policy"),
        ({"about": np.array(json.dumps({"format": 7}))}, "format: 7 is no format"),
        ({"mean": None}, "holds no policy"),
        ({"mean": np.zeros(3, np.float32)}, "weight_0: is"),
        ({"bias_0": np.zeros(9, np.float32)}, "weight_0: is"),
        ({"bias_1": np.full(2, np.nan, np.float32)}, "not finite"),
        ({"scale": np.zeros(2, np.float32)}, "another size"),
        ({"scale": np.zeros(SIZE, np.float32)}, "above 0"),
        ({"mean": np.array([{}] * 3, object)}, "holds no policy"),
        ({"about": about(normalised="false")}, "normalised: 'false' is none; true or false is"),
        ({"about": about(normalised=0)}, "normalised: 0 is none; true or false is"),
        ({"weight_2": np.zeros((2, 2), np.float32)}, "holds no policy .*bias_2"),
        ({"log_std": np.zeros(2, np.float32)}, "holds 'log_std' beside a policy"),
        ({"mean": np.zeros(3, complex)}, "mean: holds complex128, and no numbers"),
        ({"bias_1": None}, "holds no policy .*bias_1"),
        ({"mean": np.float32(0.0)}, r"mean: is \(\); one row"),
        ({"bias_0": np.float32(0.0)}, r"bias_0: is \(\); one row"),
    ],
)
def test_a_file_that_holds_no_policy(tmp_path: Path, changes: dict[str, Any], said: str) -> None:
    file = written(tmp_path, **changes)
    with pytest.raises(ClearwayError, match=said) as told:
        make_navigator(f"npz:{file}")
    assert str(file) in str(told.value)


def test_a_file_whose_array_says_that_it_is_larger_than_any(tmp_path: Path) -> None:
    file = written(tmp_path)
    with zipfile.ZipFile(file) as held:
        parts = {name: held.read(name) for name in held.namelist()}
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(head, {"descr": "<f4", "fortran_order": False, "shape": (1 << 55,)})
    with zipfile.ZipFile(file, "w") as lying:
        for name, part in (parts | {"mean.npy": head.getvalue()}).items():
            lying.writestr(name, part)
    with pytest.raises(ClearwayError, match="holds no policy"):
        make_navigator(f"npz:{file}")


@pytest.mark.parametrize("scheme", ["npz", "onnx"])
def test_a_file_that_is_none(tmp_path: Path, scheme: str) -> None:
    with pytest.raises(ClearwayError, match="No such file"):
        make_navigator(f"{scheme}:{tmp_path / 'none'}")
    (tmp_path / "text").write_text("no policy")
    with pytest.raises(ClearwayError, match="holds no policy"):
        make_navigator(f"{scheme}:{tmp_path / 'text'}")
    with pytest.raises(ClearwayError, match="cannot be read"):
        make_navigator(f"{scheme}:{tmp_path}")


def test_what_a_robot_has_not_is_said_before_it_drives(tmp_path: Path) -> None:
    policy = read_npz(written(tmp_path))
    with pytest.raises(ClearwayError, match="it answers 2 numbers, and robot 'crowdnav-disc' is told 3: v, v_y, omega"):
        policy.check(load_robot("crowdnav-disc"))
    write_npz(tmp_path / "lidar.npz", Seeing(beams=10), Acting(), perceptron(17, 3))
    with pytest.raises(ClearwayError, match="has no lidar"):
        read_npz(tmp_path / "lidar.npz").check(load_robot("crowdnav-disc"))
