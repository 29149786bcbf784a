"""The clairvoyant: a privileged navigator that knows every obstacle's future. A limit to compare with, not a rival."""

from __future__ import annotations

from clearway.navigators.oracle.navigator import Oracle

__all__ = ["Oracle"]
