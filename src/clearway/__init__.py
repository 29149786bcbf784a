"""Clearway measures how well mobile robots find their way among people and obstacles."""
