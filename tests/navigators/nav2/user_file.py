"""A user's file of Nav2's parameters, and the controller that is made up for it."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

from pydantic import Field

from clearway.navigators.nav2.parameters import plugins
from clearway.navigators.nav2.parameters.group import Group, Readers
from clearway.navigators.nav2.parameters.table import table
from clearway.quantities import Finite, Positive, Whole


class Critic(Group):
    cost_weight: Finite = 4.0


class Driver(Group):
    """The controller."""

    batch_size: Whole = Field(default=1000, ge=1)
    temperature: Positive = 0.3
    mode: str = "a"
    critics: tuple[str, ...] = ("Goal",)

    IGNORED: ClassVar[dict[str, str]] = {"visualize": "nothing is drawn"}
    MISSING: ClassVar[dict[str, str]] = {"b": "a", "adaptive": "batch_size"}
    RENAMED: ClassVar[dict[str, str]] = {"samples": "batch_size"}
    JAZZY: ClassVar[dict[str, Any]] = {"temperature": 0.25}

    @classmethod
    def children(cls, table: dict[str, Any]) -> Readers:
        critics = table.get("critics", ("Goal",))
        return dict.fromkeys(critics, Critic) | plugins.twice(critics, "critics")


CONTROLLER = """
controller_server:
  ros__parameters:
    controller_plugins: ["FollowPath"]
    FollowPath:
      plugin: "t/Driver"
"""


def written(tmp_path: Path, text: str) -> Path:
    path = tmp_path / "nav2_params.yaml"
    path.write_text(text)
    return path


def told(tmp_path: Path, lines: str) -> dict[str, Any]:
    """The table's rows of the controller's parameters, by name, where the file gives it these lines."""
    found = table(written(tmp_path, CONTROLLER + "".join(f"      {line}\n" for line in lines.splitlines())))
    assert not found.problems
    return {row.name.removeprefix("controller_server.FollowPath."): row for row in found.rows}
