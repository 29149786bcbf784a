"""Localises a recorded robot afterwards: by its scans and its odometry on a map, where nothing else measured it."""

from __future__ import annotations

from clearway.localising.files import localise_recording
from clearway.localising.offline import Localised, localise

__all__ = ["Localised", "localise", "localise_recording"]
