"""The navigator `ppo`: a policy that comes with Clearway, learnt by `benchmarks/train_ppo.py`."""

from __future__ import annotations

from pathlib import Path
from typing import ClassVar

from clearway.contract import Need
from clearway.navigators.learnt.navigator import Learnt
from clearway.navigators.learnt.policy import read_npz
from clearway.robots import DriveKind
from clearway.tuning import TunedOn

FILE = Path(__file__).with_name("ppo.npz")
"""Its policy."""


class Ppo(Learnt):
    """Sees the five nearest obstacles as discs, and moves a holonomic base without turning it."""

    needs: frozenset[Need] = frozenset({"obstacles"})  # type: ignore[misc]
    drives: frozenset[DriveKind] = frozenset({"omnidirectional"})
    tuned_on: ClassVar[tuple[TunedOn, ...]] = (
        TunedOn("crowd", ("crowdnav-disc",), draws=range(2**31, 2**32 - 2000), note="its training"),
    )

    def __init__(self) -> None:
        super().__init__(read_npz(FILE))

    @classmethod
    def files(cls) -> tuple[Path, ...]:
        """Its policy's."""
        return (FILE,)
