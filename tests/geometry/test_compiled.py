"""What is compiled once, what is kept between processes, and that neither is ever older than its source."""

from __future__ import annotations

import gc
import pickle
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest
from numba.core.caching import NullCache

import clearway
from clearway.geometry import compiled, dispatcher

MODULES = {
    "inner.py": "from clearway.geometry.compiled import kernel\n@kernel\ndef inner(x):\n    return x + {number}\n",
    "outer.py": (
        "from clearway.geometry.compiled import kernel\nfrom clearway.inner import inner\n"
        "@kernel\ndef outer(x):\n    return inner(x)\n"
    ),
    "__init__.py": "",
    "geometry/__init__.py": "",
}


def said(folder: Path, code: str) -> str:
    """What `code` prints in a new process that finds the modules in `folder` first."""
    code = f"import sys; sys.path.insert(0, {str(folder)!r}); {code}"
    return subprocess.run([sys.executable, "-B", "-c", code], capture_output=True, text=True, check=True).stdout


def anew(monkeypatch: pytest.MonkeyPatch, *kernels: Any) -> None:
    """Have `kernels` compiled here, whatever an earlier run has kept of them."""
    for kernel in kernels:
        monkeypatch.setattr(kernel, "_cache", NullCache())
        monkeypatch.setattr(kernel.called, "_cache", NullCache())


def result(folder: Path, number: int) -> int:
    """What `outer(1)` gives in a small package of its own, in a new process, with `inner` adding `number`."""
    for name, text in MODULES.items():
        path = folder / "clearway" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        text = text.replace("{number}", str(number))
        if not path.exists() or path.read_text() != text:
            path.write_text(text)
    for module in (compiled, dispatcher):
        (folder / "clearway/geometry" / Path(module.__file__).name).write_text(Path(module.__file__).read_text())
    return int(said(folder, "from clearway.outer import outer; print(outer(1))"))


def test_an_edit_in_a_called_kernel_is_noticed(tmp_path: Path):
    assert result(tmp_path, 10) == 11
    assert result(tmp_path, 10) == 11  # from the cache
    assert result(tmp_path, 20) == 21


def test_a_cache_that_names_a_type_that_has_moved_is_compiled_anew(tmp_path: Path):
    assert result(tmp_path, 10) == 11
    indices = list((tmp_path / "clearway/__pycache__").glob("*outer.outer-*.nbi"))
    assert len(indices) == 2  # for Python and for kernels
    for index in indices:
        with open(index, "rb") as file:
            version = pickle.load(file)
        gone = b"cclearway.outer\nMoved\n."  # pickle's word for a global of that module, which has none of that name
        index.write_bytes(pickle.dumps(version) + gone)
    assert result(tmp_path, 10) == 11


def test_a_fingerprint_reaches_through_imports():
    package = Path(clearway.__file__).parent
    reached = compiled._reached(package / "geometry" / "raycast.py")
    assert package / "geometry" / "compiled.py" in reached
    assert all(file.is_relative_to(package) for file in reached)


@compiled.kernel
def _power(x: float, n: int, twice: bool = False) -> float:
    return (2.0 if twice else 1.0) * x**n


@compiled.kernel
def _sum_of_powers(x: float) -> float:
    return _power(x, 1) + _power(x, 2, twice=False) + _power(x, n=3, twice=True)


def test_a_literal_argument_is_compiled_once_for_all_values(monkeypatch):
    anew(monkeypatch, _power, _sum_of_powers)
    assert _sum_of_powers(2.0) == 2.0 + 4.0 + 16.0
    signatures = {tuple(map(str, s)) for s in _power.called.signatures}
    assert signatures == {("float64", "int64", "omitted(default=False)"), ("float64", "int64", "bool")}


def test_the_cycle_collector_is_as_it_was_after_compiling():
    before = gc.get_threshold()

    @numba.njit
    def inner(x):
        return x + 1

    @numba.njit
    def outer(x):
        return inner(x)

    seen = []
    listener = compiled.event.RecordingListener()
    listener.on_start = lambda _: seen.append(gc.get_threshold()[0])
    with compiled.event.install_listener("numba:compile", listener):
        assert outer(1) == 2
    assert len(seen) == 2
    assert min(seen) >= 50_000
    assert gc.get_threshold() == before


@compiled.kernel
def _halves(x: np.ndarray) -> np.ndarray:
    if len(x) == 0:
        raise ValueError("nothing to halve")
    return 0.5 * x


@compiled.kernel
def _quarters(x: np.ndarray) -> np.ndarray:
    return _halves(_halves(x))


def test_machine_code_is_made_of_what_python_calls_alone(monkeypatch):
    anew(monkeypatch, _halves, _quarters)
    assert _quarters(np.full(2, 8.0)).tolist() == [2.0, 2.0]
    assert len(_halves.called.signatures) == 1
    assert not _halves.signatures
    assert _halves(np.full(2, 8.0)).tolist() == [4.0, 4.0]
    assert len(_halves.called.signatures) == 1
    assert len(_halves.signatures) == 1


def test_an_error_in_a_called_kernel_reaches_python():
    with pytest.raises(ValueError, match="nothing to halve"):
        _quarters(np.zeros(0))


def test_a_users_own_function_calls_kernels():
    _quarters(np.full(2, 8.0))  # machine code of the same name, which the other must not take for its own

    @numba.njit
    def users(x):
        return _quarters(x).sum()

    assert users(np.full(2, 8.0)) == 4.0


@pytest.mark.slow
def test_what_several_processes_have_compiled_fits_together(tmp_path: Path):
    """One compiles who calls, the next one what is called for Python, so that constants of either are others'; then both are loaded."""
    module = (
        "import numpy as np\nfrom clearway.geometry.compiled import kernel\n"
        "@kernel\ndef inner(x):\n    return np.zeros(2) + x\n@kernel\ndef outer(x):\n    return 2.0 * inner(x)\n"
    )
    (tmp_path / "together.py").write_text(module)
    for calls in ("outer(1.0)", "inner(1.0)", "outer(1.0), inner(1.0)", "inner(1.0), outer(1.0)"):
        told = said(tmp_path, f"from together import *; print({calls})")
        assert ("[2. 2.]" in told, "[1. 1.]" in told) == ("outer" in calls, "inner" in calls)


@compiled.kernel
def _factorial(n: int) -> int:
    return 1 if n < 2 else n * _factorial(n - 1)


@compiled.kernel
def _one_more(n: int) -> int:
    return _factorial(n) + 1


@compiled.kernel
def _with_squares(n: int, squares: dict[int, int]) -> dict[int, int]:
    for i in range(n):
        squares[i] = i * i
    return squares


@compiled.kernel
def _counting(n: int) -> Iterator[int]:
    yield n
    yield n + 1


def test_what_a_kernel_may_be(monkeypatch):
    anew(monkeypatch, _factorial, _one_more, _with_squares, _counting)
    assert _one_more(5) == 121
    assert _factorial(5) == 120
    assert dict(_with_squares(3, numba.typed.Dict.empty(numba.int64, numba.int64))) == {0: 0, 1: 1, 2: 4}
    with pytest.raises(TypeError, match="_counting is a generator, which no kernel can be"):
        _counting(3)


def test_an_older_copy_within_another_kernel_is_not_taken_for_it(tmp_path: Path):
    """Outside of the package nothing tells a kernel that one which it calls was edited; that one by itself is new."""
    imports = "import numpy as np\nfrom clearway.geometry.compiled import kernel\n"
    (tmp_path / "outer.py").write_text(
        f"{imports}from inner import inner\n@kernel\ndef outer(x):\n    return inner(x) + inner(-x)\n"
    )
    terms = "".join(
        f"    s += np.sin(s + {i} * x) * np.exp(s)\n" for i in range(40)
    )  # too long to become part of `outer`
    # By the length of its file Numba sees that it was edited, whatever the time. Compiled first, it has the same name both times.
    for number, first in ((1, "inner"), (22, "outer")):
        (tmp_path / "inner.py").write_text(
            f"{imports}@kernel\ndef inner(x):\n    s = 0.0\n{terms}    return {number} + 0.0 * s\n"
        )
        told = said(
            tmp_path, f"from inner import inner; from outer import outer; {first}(1.0); outer(1.0); print(inner(1.0))"
        )
        assert float(told) == number
