"""A cached kernel must not outlive an edit in a kernel that it calls."""

from __future__ import annotations

import gc
import pickle
import subprocess
import sys
from pathlib import Path

import numba
from numba.core.caching import NullCache

import clearway
from clearway.geometry import compiled

MODULES = {
    "inner.py": "from clearway.geometry.compiled import kernel\n@kernel\ndef inner(x):\n    return x + {number}\n",
    "outer.py": (
        "from clearway.geometry.compiled import kernel\nfrom clearway.inner import inner\n"
        "@kernel\ndef outer(x):\n    return inner(x)\n"
    ),
    "__init__.py": "",
    "geometry/__init__.py": "",
}


def result(folder: Path, number: int) -> int:
    """What `outer(1)` gives in a small package of its own, in a new process, with `inner` adding `number`."""
    for name, text in MODULES.items():
        path = folder / "clearway" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        text = text.replace("{number}", str(number))
        if not path.exists() or path.read_text() != text:
            path.write_text(text)
    (folder / "clearway/geometry/compiled.py").write_text(Path(compiled.__file__).read_text())
    code = f"import sys; sys.path.insert(0, {str(folder)!r}); from clearway.outer import outer; print(outer(1), outer.stats)"
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    return int(said.stdout.split()[0])


def test_an_edit_in_a_called_kernel_is_noticed(tmp_path: Path):
    assert result(tmp_path, 10) == 11
    assert result(tmp_path, 10) == 11  # from the cache
    assert result(tmp_path, 20) == 21


def test_a_cache_that_names_a_type_that_has_moved_is_compiled_anew(tmp_path: Path):
    assert result(tmp_path, 10) == 11
    (index,) = (tmp_path / "clearway/__pycache__").glob("outer.outer-*.nbi")
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
    for function in (_power, _sum_of_powers):
        monkeypatch.setattr(function, "_cache", NullCache())  # what an earlier run compiled has no signatures here
    assert _sum_of_powers(2.0) == 2.0 + 4.0 + 16.0
    signatures = {tuple(map(str, s)) for s in _power.signatures}
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
