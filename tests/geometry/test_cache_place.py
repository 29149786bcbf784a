"""Kernels are cached where that is possible, and for a while where it isn't."""

from __future__ import annotations

import os
from pathlib import Path

import numba
import pytest

from clearway.geometry import cache_place
from clearway.geometry.cache_place import VARIABLE, settle_cache


@pytest.fixture
def nowhere(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A package and a home that are files, in which even root makes no folder; the temporary folder is `tmp_path`."""
    (tmp_path / "package").touch()
    (tmp_path / "home").touch()
    monkeypatch.setenv(VARIABLE, "")
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    monkeypatch.setattr(cache_place.tempfile, "tempdir", str(tmp_path))
    monkeypatch.setattr(numba.config, "CACHE_DIR", "")
    return tmp_path


def test_a_package_that_can_be_written_keeps_its_caches(nowhere: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (nowhere / "site").mkdir()
    assert settle_cache(nowhere / "site") is None
    assert not os.environ[VARIABLE]
    assert capsys.readouterr().err == ""


def test_so_does_a_home(nowhere: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (nowhere / "own").mkdir()
    monkeypatch.setenv("HOME", str(nowhere / "own"))
    assert settle_cache(nowhere / "package") is None


def test_without_either_it_is_a_folder_of_the_user_alone_and_one_sentence(
    nowhere: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = settle_cache(nowhere / "package")
    assert folder is not None
    assert folder.parent == nowhere
    assert folder.stat().st_mode & 0o777 == 0o700
    assert os.environ[VARIABLE] == numba.config.CACHE_DIR == str(folder)
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert str(folder) in said
    assert settle_cache(nowhere / "package") is None, "said once"


def test_a_folder_that_others_may_write_is_not_taken(nowhere: Path) -> None:
    shared = nowhere / f"clearway-kernels-{os.getuid()}"
    shared.mkdir()
    shared.chmod(0o777)
    assert settle_cache(nowhere / "package") not in (None, shared)
