"""Speaks the step protocol of Arena's planners, in our own words: heads for its goal, or misbehaves as ARENA_KIND says."""

from __future__ import annotations

import math
import os
import sys
from typing import Any

import msgpack
import numpy as np
import zmq

KIND = os.environ.get("ARENA_KIND", "good")


def array(value: dict[Any, Any]) -> Any:
    """What msgpack-numpy makes of a map."""
    if value.get(b"nd"):
        return np.frombuffer(value[b"data"], value[b"type"]).reshape(value[b"shape"])
    return value


def main() -> None:
    context, poller, steps = zmq.Context(), zmq.Poller(), 0
    lines = {}
    for name, kind in (("OBS", zmq.PULL), ("CONTROL", zmq.PULL), ("ACTION", zmq.PUSH), ("CTRL_ACK", zmq.PUSH)):
        lines[name] = context.socket(kind)
        lines[name].connect(os.environ[f"ARENA_PLANNER_{name}_ENDPOINT"])
    for name in ("OBS", "CONTROL"):
        poller.register(lines[name], zmq.POLLIN)

    def say(where: str, **frame: Any) -> None:
        lines[where].send(msgpack.packb(frame))

    while True:
        for line, _ in poller.poll():
            frame = msgpack.unpackb(line.recv(), raw=False, strict_map_key=False, object_hook=array)
            if frame["op"] == "init":
                assert frame["protocol_version"] == 2
                say("CTRL_ACK", op="init_ack", capabilities={})
            elif frame["op"] == "reset":
                say("CTRL_ACK", op="heartbeat", seq=1)
                say("CTRL_ACK", op="reset_ack", applied_state=None)
            elif frame["op"] == "shutdown":
                say("CTRL_ACK", op="bye")
                return
            elif frame["op"] == "obs":
                steps += 1
                if KIND == "dies" and steps > 5:
                    raise SystemExit("out of thrust")
                if KIND == "fails" and steps > 5:
                    say("ACTION", op="error", code="step_failed", msg="no weights", severity="error")
                    continue
                f = frame["features"]
                assert f["scan"].dtype == np.float32
                assert f["scan"].shape == (8,)
                assert f["people"].shape == (1, 5)
                assert f["plan"].shape[1] == 3
                assert f["goal"] is not None
                assert math.dist(f["goal"][:2], f["pose"][:2]) < 2.0 + 1e-9  # the lookahead
                turn = math.remainder(f["goal"][2] - f["pose"][2], math.tau)
                wrong = {"fast": [2.0, 1.0], "east": [0.5, 0.0]}
                action = wrong.get(KIND, [0.5, turn])
                if KIND == "beams":
                    action = [0.01 * float(f["scan"][1]), 0.01 * float(f["scan"][4])]
                if KIND == "nan" and steps > 5:
                    print("no way out", file=sys.stderr, flush=True)
                    action = [float("nan")] * 2
                say("ACTION", op="action", seq=frame["seq"], action=action, action_type="differential_drive", signal="")


if __name__ == "__main__":
    main()
