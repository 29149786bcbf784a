"""Robots' public Nav2 files: one TOML file each, with its source and licence."""

from clearway.navigators.nav2.presets.preset import Preset, preset_for, preset_names, read_preset, with_own, without_map

__all__ = ["Preset", "preset_for", "preset_names", "read_preset", "with_own", "without_map"]
