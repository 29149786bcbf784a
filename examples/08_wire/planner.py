"""A navigator that is a process of its own, in plain Python: JSON, a message a line. docs/wire.md specifies what is said.

clearway check "exec:python3 examples/08_wire/planner.py"
clearway run hospital --robot tiago --batch NO --speed 0.6 --navigator "exec:python3 examples/08_wire/planner.py" --out results/wire
"""

import json
import math
import sys

CLEARANCE = 0.7  # m that are kept ahead of the lidar


def say(**message):
    print(json.dumps(message), flush=True)


def room_ahead(scan):
    """How far the lidar sees within 35 degrees of straight ahead, m; null is a beam without a return."""
    beams = enumerate(scan["ranges"])
    ahead = (r for i, r in beams if r is not None and abs(scan["angle_min"] + i * scan["angle_increment"]) < 0.6)
    return min(ahead, default=scan["range_max"])


def decide(o, v_max, omega_max):
    """Turn to the goal and drive there, as fast as the room ahead allows; at the goal turn to its heading."""
    dx, dy = o["goal"]["pose"][0] - o["pose"][0], o["goal"]["pose"][1] - o["pose"][1]
    near = math.hypot(dx, dy) < 0.5 * o["goal"]["xy_tolerance"]
    heading = o["goal"]["pose"][2] if near else math.atan2(dy, dx)
    error = math.remainder(heading - o["pose"][2], math.tau)
    fast = min(v_max, math.hypot(dx, dy), 0.7 * max(0.0, room_ahead(o["scan"]) - CLEARANCE))
    v = 0.0 if near else max(0.0, math.cos(error)) * fast
    return v, max(-omega_max, min(omega_max, 1.5 * error))


say(type="hello", version=1, needs=["scan"], drives=["differential"])
v_max = omega_max = 0.0
for line in sys.stdin:  # it ends when Clearway closes it
    message = json.loads(line)
    if message["type"] == "reset":
        v_max = min(message["task"]["speed_limit"], message["limits"]["v_max"])
        omega_max = message["limits"]["omega_max"]
        say(type="ready")
    elif message["type"] == "step":
        v, omega = decide(message, v_max, omega_max)
        say(type="command", v=v, omega=omega)
    elif message["type"] == "bye":
        break
