"""COLREGS APF (Lyu & Yin 2019), one of paper B's rivals."""

from __future__ import annotations

from clearway.navigators.colregs_apf.navigator import ColregsApf, RetunedColregsApf

__all__ = ["ColregsApf", "RetunedColregsApf"]
