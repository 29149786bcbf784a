"""The navigator `social-force`: a robot that goes among people as one of them would by the social force model."""

from __future__ import annotations

from clearway.navigators.social_force.navigator import SocialForceNavigator

__all__ = ["SocialForceNavigator"]
