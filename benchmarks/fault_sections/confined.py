"""Runs the command line in a forked process whose memory and time are bounded: imports are paid for once."""

from __future__ import annotations

import contextlib
import os
import re
import resource
import select
import signal
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

SECONDS = 10
"""Of processor time that a command may take."""
WAIT = 60.0
"""Seconds until one that takes none counts as hung."""
MEMORY = 1 << 30
"""Bytes that a command may take beyond what the imports have taken."""
SAID = 20_000
"""Characters of output that are kept."""
SENTENCE = re.compile(r"clearway: [^\n]+\n|Usage: [^\n]+\n(Try [^\n]+\n)?\nError: [^\n]+\n")
"""All that a command says that refuses: a sentence, after how it is used where it was its words that are wrong."""


@dataclass(frozen=True, slots=True)
class Ended:
    """How a command ended.

    Attributes:
        code: Exit code; minus a signal's number; None: it was still running after `WAIT`.
        said: What it printed on either stream.
        seconds: How long it took.
        echo: Characters of the arguments, which a sentence may repeat.
    """

    code: int | None
    said: str
    seconds: float
    echo: int

    def wrong(self, codes: Sequence[int] = (2,)) -> str | None:
        """What is wrong with that end, if an exit code of `codes` and, with code 2, one sentence are right."""
        if self.code is None:
            return f"no end within {WAIT:g} s"
        if self.code in (-signal.SIGXCPU, -signal.SIGKILL):
            return f"no end within {SECONDS} s of processor time, or killed"
        if "Traceback (most recent call last)" in self.said:
            return f"traceback: {self.said.strip().splitlines()[-1][:200]}"
        if "not enough memory" in self.said:
            return f"{MEMORY >> 20} MB are not enough"
        if self.code not in codes:
            return f"exit code {self.code}: {self.said.strip()[-200:]}"
        if len(self.said) > 8000 + 2 * self.echo:
            return f"{len(self.said)} characters of output"
        if self.code == 1 and not self.said.strip():
            return "not a word"
        if self.code == 2 and not SENTENCE.fullmatch(self.said):
            return f"not one sentence: {self.said.strip()[:300]!r}"
        return None


def command(*arguments: str, within: Path | None = None) -> Ended:
    """Run `clearway ARGUMENTS` in a process of its own, in the folder `within`."""
    came, goes = os.pipe()
    began = time.monotonic()
    child = os.fork()
    if not child:
        _be_the_command(arguments, goes, within)
    os.close(goes)
    said, status, going = bytearray(), 0, True
    while going and (left := began + WAIT - time.monotonic()) > 0:  # workers of it may hold the pipe for longer
        ended, status = os.waitpid(child, os.WNOHANG)
        going = not ended
        while select.select([came], [], [], min(left, 0.02) if going else 0)[0] and (block := os.read(came, 1 << 16)):
            said += block[: max(0, SAID - len(said))]
    seconds = time.monotonic() - began
    with contextlib.suppress(ProcessLookupError):
        os.killpg(child, signal.SIGKILL)
    if going:
        os.waitpid(child, 0)
    os.close(came)
    code = None if going else os.waitstatus_to_exitcode(status)
    return Ended(code, said.decode("utf-8", "replace"), seconds, sum(map(len, arguments)))


def _be_the_command(arguments: Sequence[str], out: int, within: Path | None) -> None:
    code = 70
    try:
        os.setpgid(0, 0)
        held = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS + 1))
        resource.setrlimit(resource.RLIMIT_AS, (held + MEMORY, held + MEMORY))
        os.dup2(out, 1)
        os.dup2(out, 2)
        os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
        os.close(out)
        sys.stdout, sys.stderr = (
            os.fdopen(1, "w", errors="backslashreplace"),
            os.fdopen(2, "w", errors="backslashreplace"),
        )
        if within is not None:
            os.chdir(within)
        sys.argv = ["clearway", *arguments]
        from clearway.cli import main

        try:
            main()
            code = 0
        except SystemExit as end:
            code = end.code if isinstance(end.code, int) else 0 if end.code is None else 1
    except BaseException:
        import traceback

        traceback.print_exc()
        code = 70
    finally:
        sys.stdout.flush()
        sys.stderr.flush()
        os._exit(code)
