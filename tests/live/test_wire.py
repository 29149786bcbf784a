"""A navigator at the other end of a wire: what is said, whatever it does wrong, and that nothing of it stays behind."""

from __future__ import annotations

import gc
import json
import math
import os
import shlex
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import msgpack
import numpy as np
import pytest
from wire_scenes import PLANNERS, address, begin, drive, observations

from clearway.campaigns.by_robot import is_by_robot, navigator_of
from clearway.campaigns.checks import findings
from clearway.campaigns.pilot import TookTooLong, dismiss, guarded
from clearway.campaigns.plain import plain_command
from clearway.campaigns.provenance import code_of
from clearway.contract import Command
from clearway.errors import ClearwayError
from clearway.live import navigator as live_navigator
from clearway.live.conformance import said_of
from clearway.live.encodings import LONGEST, JsonLines, MessagePack, Nonsense
from clearway.live.line import WireError
from clearway.live.peers import Process
from clearway.navigators.registry import NAVIGATORS, drives_of, make_navigator, needs_of


def pid_of(navigator: Any) -> int:
    found: int = navigator._peer._process.pid
    return found


def alive(pid: int) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_it_decides_as_it_says() -> None:
    made = make_navigator(address("good"))
    assert needs_of("good", made) == {"scan"}
    assert drives_of("good", made) == {"differential"}
    begin(made)
    assert drive(made) == [Command(0.1, 0.0)] * 20
    pid = pid_of(made)
    begin(made)  # the same process, again and again
    assert drive(made) == [Command(0.1, 0.0)] * 20
    assert pid_of(made) == pid
    dismiss(made, None)
    assert not alive(pid)


def test_every_field_of_a_command_comes_through() -> None:
    made = make_navigator(address("gives-up"))
    begin(made)
    expected = Command(0.1, 0.0, arrived=False, gave_up="no way", status="lost", violated=("a", "b"))
    assert plain_command(drive(made, 6)[-1]) == expected


def test_its_seed_is_all_its_chance() -> None:
    def driven(seed: int) -> list[Command]:
        made = make_navigator(address("random"))
        begin(made, seed)
        return drive(made)

    assert driven(1) == driven(1) != driven(2)


@pytest.mark.parametrize("encoding", [MessagePack(), JsonLines()], ids=lambda e: e.name)
def test_what_is_said_is_what_is_specified(encoding: Any, tmp_path: Path) -> None:
    """A planner writes down each message; both encodings hold the same numbers, to the last bit."""
    log, script = tmp_path / "log", tmp_path / "planner.py"
    script.write_text(
        "import sys\n"
        f"sys.path[:] = {sys.path!r}\n"
        f"from clearway.live.encodings import {type(encoding).__name__} as Encoding\n"
        "speak, out, held = Encoding(), sys.stdout.buffer, bytearray()\n"
        "def say(**m): out.write(speak.pack(m)); out.flush()\n"
        "say(type='hello', version=1, needs=['map', 'scan', 'obstacles'], drives=['differential', 'omnidirectional'])\n"
        f"log = open({str(log)!r}, 'w', buffering=1)\n"
        "while piece := sys.stdin.buffer.read1():\n"
        "    held += piece\n"
        "    while end := speak.end(held):\n"
        "        m, held = speak.unpack(bytes(held[:end])), held[end:]\n"
        "        log.write(repr(m) + '\\n')\n"
        "        if m['type'] == 'reset': say(type='ready')\n"
        "        if m['type'] == 'step': say(type='command', v=1, omega=0.1 + 0.2)\n"
    )
    made: Any = make_navigator(f"exec:{sys.executable} {script}")
    assert made.encoding == encoding.name
    begin(made)
    assert drive(made, 4) == [Command(1, 0.1 + 0.2)] * 4
    made.close()
    inf = math.inf
    said = [eval(line, {"inf": inf}) for line in log.read_text().splitlines()]
    assert [m["type"] for m in said] == ["reset", *["step"] * 4, "bye"]
    packed = isinstance(encoding, MessagePack)

    def array(*values: Any, dtype: str = "<f8") -> Any:
        return np.array(values, dtype).tobytes() if packed else [None if v == inf else v for v in values]

    reset, step = said[0], said[3]
    assert reset["map"] == {
        "rows": 2, "columns": 3, "resolution": 0.05, "origin": [-1.0, 2.0], "cells": array(0, 100, -1, 0, 0, 0, dtype="i1"),
    }  # fmt: skip
    assert reset["task"]["start"] == [1.0, 2.0, 0.5]
    assert reset["task"]["time_limit"] == (inf if packed else None)
    assert reset["limits"]["kind"] == "differential"
    assert reset["robot"]["footprint"] == {"kind": "circle", "radius": 0.27}
    assert 0 <= reset["seed"] < 2**53
    assert [m["goal"]["number"] for m in said[1:-1]] == [0, 0, 1, 1]
    assert step["goal"] == {
        "number": 1, "pose": [5.0, 2.0, 0.25], "xy_tolerance": 0.2, "yaw_tolerance": None, "leg": 1,
    }  # fmt: skip
    assert step["pose"] == [0.0, 2.0, 0.5]
    assert step["scan"]["ranges"] == array(1.5, inf, 0.1 + 0.2)
    assert step["obstacles"] == {
        "count": 2, "position": array(1.0, 2.0, 3.0, 4.0), "velocity": array(0.1, 0.0, 0.0, -0.1), "radius": array(0.3, 0.4),
        "error": array(0.0, 0.0), "velocity_error": array(0.5, inf), "identity": array(7, 2**40, dtype="<i8"),
        "moving": array(True, False, dtype="?"),
    }  # fmt: skip


WRONG = {
    "dies": r"ended with exit code 1; the last line of its standard error: 'the map is upside down'",
    "segfaults": "was ended by SIGSEGV",
    "closes": "closed its standard output",
    "text": r"said 'planning ...', which is no message in JSON",
    "long": "said 'x{80}' in a line of more than 1,048,576 bytes, which are the most",
    "half": r"gave a command without 'omega': \{'type': 'command', 'v': 0.1\}",
    "misspelt": "gave command a 'w', which it has not; it has arrived, cut, gave_up, omega, status, v, v_y, violated",
    "ready": r"answered a step with \{'type': 'ready'\}; a command is expected",
    "chatters": 'said \'{"type": "command".*unasked; each message of ours has one answer',
}


@pytest.mark.parametrize("kind", WRONG)
def test_what_it_does_wrong_is_said_and_the_next_trial_begins_it_anew(
    kind: str, capfd: pytest.CaptureFixture[str]
) -> None:
    made: Any = make_navigator(address(kind))
    begin(made)
    pid = pid_of(made)
    with pytest.raises(WireError, match=f"^navigator 'exec:.*{kind}' {WRONG[kind]}"):
        drive(made)
    assert not alive(pid)
    with pytest.raises(WireError, match="has failed before"):
        drive(made, 1)
    begin(made)
    assert pid_of(made) != pid
    assert drive(made, 5) == [Command(0.1, 0.0)] * 5
    made.close()
    assert ("first\nthe map" in capfd.readouterr().err) == (kind == "dies")  # what it says there is passed on


@pytest.mark.parametrize(
    ("kind", "says"),
    [("nan", "v = nan is not finite"), ("null", "omega is None, not a number"), ("words", "v is 'fast', not a number")],
)
def test_a_command_that_is_none_of_numbers(kind: str, says: str) -> None:
    made = make_navigator(address(kind))
    begin(made)
    pid = pid_of(made)
    with pytest.raises(WireError, match=f"a command that is none: .*{says}; the last line of .*'dividing by zero'$"):
        drive(made)
    assert not alive(pid)


def test_one_that_hangs_is_broken_off_with_its_last_words() -> None:
    made: Any = make_navigator(address("hangs"))
    begin(made)
    pid = pid_of(made)
    with pytest.raises(TookTooLong, match=r"took longer than 0.5 s for a decision; the last line .*'thinking hard'$"):
        guarded(0.5, "for a decision", drive, made)
    assert not alive(pid)


def test_one_that_says_no_hello_is_broken_off_as_it_is_made() -> None:
    with pytest.raises(TookTooLong, match=r"^took longer than 0\.3 s to be made"):
        guarded(0.3, "to be made", make_navigator, "exec:sleep 20")


def test_much_on_its_standard_error_does_not_block(capfd: pytest.CaptureFixture[str]) -> None:
    made = make_navigator(address("floods"))
    begin(made)
    assert len(drive(made)) == 20
    assert len(capfd.readouterr().err) > 15 * 300 * 1000


def test_a_reset_that_fails_tells_why() -> None:
    made = make_navigator(address("reset"))
    with pytest.raises(WireError, match=r"ended with exit code 1; .* 'RuntimeError: no such robot'"):
        begin(made)


HELLOS = {
    "text": r"said 'Loading the model ...' where its hello is expected; .* belongs to standard error",
    "ended": "ended with exit code 0",
    "version": "speaks version 2 of the wire; version 1 is spoken here",
    "needs": "says hello with needs = 'radar'; there is only map, scan, obstacles",
    "needs-nothing": "says hello with needs = None; a list of some of map, scan, obstacles is expected",
    "drives": "drives = 'hexapod'; there is only differential, omnidirectional, ackermann",
    "drives-nothing": r"drives = \[\]; at least one kind of base is needed",
    "misspelt": "gave hello a 'need', which it has not; it has drives, needs, version",
    "greets": r"said \{'type': 'ready'\} where its hello is expected",
    "list": r"said '\[1, 2\]' where its hello is expected; .*",
    "broken": r"""said '\{"type": "hello"', which is no message in JSON""",
    "silent": "said no hello within 0.2 s",
}


@pytest.mark.parametrize("kind", HELLOS)
def test_a_hello_that_is_none(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if kind == "silent":
        monkeypatch.setattr(live_navigator, "HELLO_LIMIT", 0.2)
    with pytest.raises(ClearwayError, match=f"^navigator 'exec:.*hello-{kind}' .*{HELLOS[kind]}$") as told:
        make_navigator(address(f"hello-{kind}"))
    assert "\n" not in str(told.value)


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("exec:", "'exec:' names no program"),
        ("exec:'a", "is no command line: no closing quotation"),
        ("exec:./no_such_planner --flag", "there is no program './no_such_planner'$"),
        ("exec:no_such_planner", "there is no program 'no_such_planner'$"),
        ("exec:planner", "no program 'planner' on the path; the file that lies here is ./planner"),
        ("exec:./planner", "'./planner' is not executable; chmod"),
        ("exec:./folder", "'./folder' is a folder"),
        ("exec:./text", "'exec:./text' cannot be started: Exec format error$"),
        ("exec:true[speed=1]", r"there is no program 'true\[speed=1\]'"),
        ("tcp:5555", "is no address; write tcp://127.0.0.1:5555"),
        ("tcp://127.0.0.1", "is no address"),
        ("tcp://127.0.0.1:no", "is no address"),
        ("tcp://127.0.0.1:99999", "is no address"),
        ("tcp://a@127.0.0.1:5555", "is no address"),
        ("tcp://127.0.0.1:5555/path", "is no address"),
        ("tcp://192.0.2.1:5555", r"is not on this machine .*; tcp://192.0.2.1:5555\[remote=true\] allows that"),
        ("tcp://example.org:5555", "is not on this machine"),
        ("tcp://127.0.0.1:1", "cannot be reached .*start it first"),
    ],
)
def test_an_address_that_leads_nowhere(name: str, says: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("planner").write_text("")
    Path("folder").mkdir()
    Path("text").write_text("hello")
    Path("text").chmod(0o755)
    with pytest.raises(ClearwayError, match=says):
        make_navigator(name)


def test_a_command_line_may_hold_what_separates_robots() -> None:
    name = "exec:./my_planner --weights=w.npz,b"
    assert not is_by_robot(name)
    assert navigator_of(name, "tiago") == name
    assert (
        navigator_of("tiago=exec:./my_planner --weights=w.npz,hosbot=orca", "tiago")
        == "exec:./my_planner --weights=w.npz"
    )
    assert NAVIGATORS.scheme_of("own.py:Class") is None


def test_its_files_decide_the_bits(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for name, text in (("planner.py", "import helper\n"), ("helper.py", "a = 1\n"), ("w.npz", "w"), ("other", "")):
        Path(name).write_text(text)
    name = f"exec:{shlex.quote(sys.executable)} planner.py --weights=w.npz --robot tiago"
    before = code_of(name)
    assert before is not None
    for file in ("planner.py", "helper.py", "w.npz"):
        old = Path(file).read_text()
        Path(file).write_text(old + "\n")
        assert code_of(name) != before, file
        Path(file).write_text(old)
    Path("other").write_text("more")
    assert code_of(name) == before
    assert code_of("tcp://127.0.0.1:5555") is None


def test_it_goes_with_the_object_and_with_the_process() -> None:
    made = make_navigator(address("deaf"))
    pid = pid_of(made)
    del made
    gc.collect()
    assert not alive(pid)
    code = (
        "import sys, time\nfrom clearway.navigators.registry import make_navigator\n"
        f"made = make_navigator({address('deaf')!r})\nprint(made._peer._process.pid, flush=True)\ntime.sleep(3600)\n"
    )
    parent = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert parent.stdout is not None
    child = int(parent.stdout.readline())
    assert alive(child)
    os.kill(parent.pid, signal.SIGKILL)
    parent.wait()
    for _ in range(50):
        if not alive(child):
            break
        time.sleep(0.1)
    assert not alive(child)


@contextmanager
def served(connections: int, keeps: float = 0.0) -> Iterator[int]:
    """A server in another thread that speaks MessagePack, one connection after another, and closes each so late; its port."""

    def say(line: socket.socket, **message: Any) -> None:
        body = msgpack.packb(message)
        line.sendall(len(body).to_bytes(4, "big") + body)

    def answer(line: socket.socket) -> None:
        with line, line.makefile("rb") as heard:
            say(line, type="hello", version=1, needs=[])
            while head := heard.read(4):
                message = msgpack.unpackb(heard.read(int.from_bytes(head, "big")))
                if message["type"] == "reset":
                    say(line, type="ready")
                if message["type"] == "step":
                    say(line, type="command", v=message["t"], omega=0.0)
            time.sleep(keeps)

    with socket.create_server(("127.0.0.1", 0)) as listening:
        thread = threading.Thread(target=lambda: [answer(listening.accept()[0]) for _ in range(connections)])
        thread.start()
        yield listening.getsockname()[1]
        thread.join(10.0)
        assert not thread.is_alive()


def gone(pid: int) -> bool:
    """Whether it is, within five seconds."""
    until = time.monotonic() + 5.0
    while alive(pid) and time.monotonic() < until:
        time.sleep(0.01)
    return not alive(pid)


def number_in(file: Path) -> int:
    """What a shell writes there, within ten seconds."""
    until = time.monotonic() + 10.0
    while not (file.exists() and file.read_text().endswith("\n")) and time.monotonic() < until:
        time.sleep(0.01)
    return int(file.read_text())


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="needs /proc to look for processes")
@pytest.mark.parametrize("how", ["ended", "left", "this process is killed"])
def test_what_a_shell_script_starts_ends_with_it(how: str, tmp_path: Path) -> None:
    file = tmp_path / "pid"
    command = ["sh", "-c", f"sleep 600 & echo $! > {file}; {'exit' if how == 'left' else 'wait'}"]
    if how == "this process is killed":
        code = f"import time\nfrom clearway.live.peers import Process\none = Process({command!r})\ntime.sleep(600)"
        this = subprocess.Popen([sys.executable, "-c", code], process_group=0)
        pid = number_in(file)
        this.kill()
        this.wait()
    else:
        one = Process(command)
        pid = number_in(file)
        assert os.getpgid(pid) != os.getpgrp()  # nor does Ctrl-C come there
        if how == "left":
            one.leave()
        one.end()
        one.end()  # which is nothing more
    assert gone(pid)


def test_one_that_leaves_its_group_ends_too() -> None:
    one = Process([sys.executable, "-c", "import os, time\nos.setsid()\nprint(1, flush=True)\ntime.sleep(600)"])
    one._process.stdout.read(1)  # type: ignore[union-attr]
    one.end()
    assert not alive(one._process.pid)


def test_a_server_answers_as_a_process_does() -> None:
    with served(2) as port:
        for _ in range(2):
            made = make_navigator(f"tcp://localhost:{port}")
            begin(made)
            assert [c.v for c in drive(made, 4)] == [o.t for o in observations(4)]
            dismiss(made, None)


def test_a_program_that_does_not_end_is_found() -> None:
    said = []
    for passed, text in findings(address("deaf")):
        said.append((passed, text))
        if len(said) == 3:
            break
    assert said[0][1].startswith("says hello: version 1, in JSON lines")
    assert [s for s in said if not s[0]] == [(False, "after bye it had not ended after 1 s"), (False, said[2][1])]


def test_a_server_that_keeps_the_connection_is_found() -> None:
    for keeps, wrong in ((0.0, "ends"), (1.5, "had not closed the connection after 1 s")):
        with served(2, keeps) as port:
            connect: Any = partial(make_navigator, f"tcp://127.0.0.1:{port}")
            said = list(said_of(connect))
        assert [passed for passed, _ in said] == [True, not keeps, not keeps]
        assert [text for _, text in said[1:]] == [
            f"after bye it {wrong}",
            f"when its line is closed without a bye it {wrong}",
        ]


def test_a_message_that_is_too_long_is_told_by_its_length() -> None:
    length = (LONGEST + 1).to_bytes(4, "big")
    with pytest.raises(Nonsense, match=r"^said a message of 1,048,577 bytes; 1,048,576 are the most$"):
        MessagePack().end(bytearray(length))
    assert MessagePack().end(bytearray(LONGEST.to_bytes(4, "big"))) == 0


def test_json_has_no_infinity() -> None:
    assert json.loads(JsonLines().pack({"a": [math.inf, {"b": math.nan}, 0.5]})) == {"a": [None, {"b": None}, 0.5]}
    assert PLANNERS.is_file()
