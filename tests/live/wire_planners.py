"""Planners at the other end of a wire, each of one kind: `python wire_planners.py KIND`. Most misbehave, after LATER steps."""

from __future__ import annotations

import json
import os
import random
import signal
import sys
import time
from typing import Any

LATER = 5
HELLO = {"type": "hello", "version": 1, "needs": ["scan"], "drives": ["differential"]}


def say(text: str) -> None:
    sys.stdout.write(text + "\n")
    sys.stdout.flush()


def tell(**message: Any) -> None:
    say(json.dumps(message))


def command(**more: Any) -> None:
    tell(type="command", **{"v": 0.1, "omega": 0.0} | more)


def hang() -> None:
    print("thinking hard", file=sys.stderr, flush=True)
    time.sleep(3600)


def die() -> None:
    print("first", file=sys.stderr)
    raise SystemExit("the map is upside down")


def slip(**more: Any) -> None:
    print("dividing by zero", file=sys.stderr, flush=True)
    command(**more)


def chatter() -> None:
    said = json.dumps({"type": "command", "v": 0.1, "omega": 0.0})
    say(f"{said}\n{said}")  # at once: of two writes, the second may pass for the next step's answer


def flood() -> None:
    for _ in range(300):
        print("x" * 1000, file=sys.stderr)
    command()


HELLOS: dict[str, Any] = {
    "silent": None,
    "text": "Loading the model ...",
    "ended": None,
    "version": HELLO | {"version": 2},
    "needs": HELLO | {"needs": ["radar"]},
    "needs-nothing": {"type": "hello", "version": 1},
    "drives": HELLO | {"drives": ["hexapod"]},
    "drives-nothing": HELLO | {"drives": []},
    "misspelt": HELLO | {"need": []},
    "greets": {"type": "ready"},
    "list": "[1, 2]",
    "broken": '{"type": "hello"',
}

STEPS = {
    "good": command,
    "random": lambda: command(omega=random.uniform(-0.1, 0.1)),
    "hangs": hang,
    "dies": die,
    "segfaults": lambda: os.kill(os.getpid(), signal.SIGSEGV),
    "closes": lambda: (os.close(1), time.sleep(3600)),
    "text": lambda: say("planning ..."),
    "long": lambda: say("x" * (1 << 21)),
    "nan": lambda: slip(v=float("nan")),
    "null": lambda: slip(omega=None),
    "words": lambda: slip(v="fast"),
    "half": lambda: tell(type="command", v=0.1),
    "misspelt": lambda: command(w=0.1),
    "ready": lambda: tell(type="ready"),
    "chatters": chatter,
    "floods": flood,
    "gives-up": lambda: command(gave_up="no way", status="lost", violated=["a", "b"], arrived=False),
    "deaf": command,
}


def main(kind: str) -> None:
    steps = 0
    hello = HELLOS.get(kind.removeprefix("hello-"), HELLO) if kind.startswith("hello-") else HELLO
    if kind == "hello-silent":
        time.sleep(3600)
    if kind == "hello-ended":
        sys.exit(0)
    say(hello if isinstance(hello, str) else json.dumps(hello))
    for line in sys.stdin:
        message = json.loads(line)
        if message["type"] == "bye":
            break
        if message["type"] == "reset":
            random.seed(message["seed"])
            if kind == "reset":
                raise RuntimeError("no such robot")
            steps = 0
            tell(type="ready")
            continue
        steps += 1
        (STEPS.get(kind, command) if steps > LATER else command)()
    while kind == "deaf":
        time.sleep(3600)


if __name__ == "__main__":
    main(sys.argv[1])
