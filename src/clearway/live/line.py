"""A line to somebody who answers: whole messages both ways, and what is said beside them on standard error."""

from __future__ import annotations

import os
import select
import time
from contextlib import suppress

from clearway.foreign import printable
from clearway.live.encodings import Encoding, Message, Nonsense, shown, spoken

_PIECE = 1 << 16
_LAST = 4096
"""Bytes that are remembered of its standard error."""
_WORDS = 300
"""Characters of its last line that are told."""


class WireError(RuntimeError):
    """What the navigator at the other end did, that it must not do: the end of a sentence that begins with its name."""


class Words:
    """What somebody writes for people: it is passed on to our standard error, and its last line is remembered.

    Args:
        descriptor: From which it is read.

    Attributes:
        descriptor: The same; None: it is closed.
    """

    def __init__(self, descriptor: int) -> None:
        os.set_blocking(descriptor, False)
        self.descriptor: int | None = descriptor
        self._last = b""

    def pass_on(self) -> bool:
        """Pass on what has come; whether there may come more."""
        while self.descriptor is not None:
            try:
                said = os.read(self.descriptor, _PIECE)
            except BlockingIOError:
                break
            except OSError:
                said = b""
            if not said:  # it has closed it
                self.descriptor = None
                break
            self._last = (self._last + said)[-_LAST:]
            with suppress(OSError):
                os.write(2, said)
        return self.descriptor is not None

    def last(self) -> str:
        """The last line, for the end of a sentence; empty for none."""
        self.pass_on()
        lines = [line for line in self._last.decode(errors="replace").splitlines() if line.strip()]
        return f"; the last line of its standard error: {printable(lines[-1].strip())[:_WORDS]!r}" if lines else ""


class Line:
    """Descriptors by which messages go and come.

    Args:
        read: From which its messages are read.
        write: To which those for it are written.
        errors: From which its standard error is read, and passed on to ours; None: nobody can.

    Attributes:
        encoding: What it speaks, known with the first byte that it sends; None: not yet.
        words: What it writes to its standard error; None: nobody can read that.
    """

    def __init__(self, read: int, write: int, errors: int | None = None) -> None:
        self._read, self._write, self._errors = read, write, errors
        self.words = None if errors is None else Words(errors)
        self.encoding: Encoding | None = None
        self._held = bytearray()
        self._ears, self._mouth = select.poll(), select.poll()
        for descriptor in (read, write):
            os.set_blocking(descriptor, False)
        self._ears.register(read, select.POLLIN)
        self._mouth.register(write, select.POLLOUT)
        if errors is not None:
            self._ears.register(errors, select.POLLIN)
            self._mouth.register(errors, select.POLLIN)

    def send(self, message: Message) -> None:
        """Send a message, in the encoding that is spoken.

        Raises:
            EOFError: it has closed the line, or ended.
            WireError: it has said something that nobody asked for.
        """
        assert self.encoding is not None
        self._refuse_unasked()
        left = memoryview(self.encoding.pack(message))
        while left:
            try:
                left = left[os.write(self._write, left) :]
            except BlockingIOError:
                for descriptor, _ in self._mouth.poll():  # it may be writing errors, and read only then
                    if descriptor == self._errors:
                        self._pass_on()
            except OSError as error:
                raise EOFError from error

    def receive(self, limit: float | None = None) -> Message:
        """The next message.

        Args:
            limit: How long to wait for it, s; None: as long as it takes.

        Raises:
            EOFError: it has closed the line, or ended.
            WireError: what it said is no message.
            TimeoutError: after `limit`.
        """
        until = None if limit is None else time.monotonic() + limit
        try:
            while not (end := self._complete()):
                self._hear(until)
            frame, self._held = bytes(self._held[:end]), self._held[end:]
            assert self.encoding is not None
            return self.encoding.unpack(frame)
        except Nonsense as error:
            raise WireError(str(error)) from error

    def ends(self, limit: float) -> bool:
        """Whether it closes the line within so many seconds, whatever it says before that."""
        until = time.monotonic() + limit
        try:
            while time.monotonic() < until:
                self._hear(until)
                self._held.clear()
        except EOFError:
            return True
        except TimeoutError:
            pass
        return False

    def last_words(self) -> str:
        """The last line that it wrote to its standard error, for the end of a sentence; empty for none."""
        return "" if self.words is None else self.words.last()

    def _complete(self) -> int:
        if self.encoding is None and self._held:
            try:
                self.encoding = spoken(self._held[0])
            except ModuleNotFoundError as error:
                raise WireError(
                    "speaks MessagePack, for which the package msgpack is needed here: pip install msgpack"
                ) from error
            if self.encoding is None:
                raise Nonsense(
                    f"said {shown(self._held)} where its hello is expected; what is to be read by people belongs to "
                    "standard error"
                )
        return 0 if self.encoding is None else self.encoding.end(self._held)

    def _hear(self, until: float | None) -> None:
        left = None if until is None else max(until - time.monotonic(), 0.0)
        heard = self._ears.poll(None if left is None else 1e3 * left)
        if not heard:
            raise TimeoutError
        for descriptor, _ in heard:
            if descriptor == self._errors:
                self._pass_on()
            else:
                self._held += self._taken()

    def _taken(self) -> bytes:
        try:
            said = os.read(self._read, _PIECE)
        except BlockingIOError:
            return b""
        except OSError as error:
            raise EOFError from error
        if not said:
            raise EOFError
        return said

    def _refuse_unasked(self) -> None:
        while not self._held and (heard := self._ears.poll(0)):
            for descriptor, _ in heard:
                if descriptor == self._errors:
                    self._pass_on()
                else:
                    self._held += self._taken()
        if self._held:
            raise WireError(f"said {shown(self._held)} unasked; each message of ours has one answer")

    def _pass_on(self) -> None:
        if self._errors is not None and self.words is not None and not self.words.pass_on():
            for poll in (self._ears, self._mouth):
                poll.unregister(self._errors)
            self._errors = None
