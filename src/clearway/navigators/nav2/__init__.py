"""The navigator `nav2`: Nav2's navigation, compiled, with its own parameters."""

from __future__ import annotations

from clearway.navigators.nav2.navigator import Nav2

__all__ = ["Nav2"]
