"""Does a navigator keep to the wire? `clearway check exec:./my_planner` asks this before it has it drive."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

from clearway.live.messages import VERSION
from clearway.live.navigator import Remote

Said = tuple[bool | None, str]
"""Whether something is as it should be, None if that could not be tested; and what, for people."""


def said_of(make: Callable[[], Remote]) -> Iterator[Said]:
    """What is right and wrong with how it begins and ends.

    Args:
        make: Starts it, or connects to it.

    Raises:
        ClearwayError: that can't be done, or it says no sound hello.
    """
    before = time.perf_counter()
    made = make()
    taken = time.perf_counter() - before
    yield True, f"says hello: version {VERSION}, in {made.encoding}, {1e3 * taken:.0f} ms after it was begun"
    for bye, when in ((True, "after bye"), (False, "when its line is closed without a bye")):
        wrong = made.leave(bye)
        yield not wrong, f"{when} it {wrong or 'ends'}"
        made = make() if bye else made
