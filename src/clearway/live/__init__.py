"""Robots' brains that are not Python classes: a navigator is a process, or a server on this machine, and a wire leads to it.

Stands on top of the house: nothing below knows it but by the addresses in `navigators/registry.py`. `docs/wire.md` specifies
the wire.
"""
