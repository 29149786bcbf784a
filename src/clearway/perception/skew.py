"""The skew of a scan whose robot turned while it was taken, undone."""

from __future__ import annotations

from dataclasses import replace

from clearway.contract import Scan


def straightened(scan: Scan, turning: float) -> Scan:
    """The beams of `scan` as they lay at its stamp, the time of its middle.

    A robot that turns evenly turns each beam by as much beside the one before: that makes the angle between them another, and no
    more. What the robot drives meanwhile, at most v times half a sweep, is left as it is: 2 cm for TIAGo.

    Args:
        scan: What the lidar saw.
        turning: The robot's omega, rad/s.
    """
    more = turning * scan.time_increment
    if more == 0.0:
        return scan
    half = 0.5 * (len(scan.ranges) - 1)
    return replace(scan, angle_min=scan.angle_min - half * more, angle_increment=scan.angle_increment + more)
