"""The navigator `hp-tmpc`: heuristic planner and robust tube-based MPC (Rado, Baglioni, Jamshidnejad 2025: paper B)."""

from __future__ import annotations
