"""Up to Kilted: the parameters of the rotation shim's primary controller, which stand beside its own."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from user_file import CONTROLLER, written

from clearway.navigators.nav2.parameters.branch import settle
from clearway.navigators.nav2.parameters.file import read_nodes
from clearway.navigators.nav2.parameters.nav2_parameters import reader_of, tables_of
from clearway.navigators.nav2.parameters.table import table

SHIM = CONTROLLER.replace("t/Driver", "nav2_rotation_shim_controller::RotationShimController")


DWB = (
    "max_vel_x: 0.4\n      max_angular_accel: 2.0\n      critics: [GoalDist, Oscillation]\n      GoalDist.scale: 24.0\n"
    "      transform_tolerance: 0.2\n"
)


def test_up_to_kilted_the_primary_controllers_parameters_stand_beside_the_rotation_shims(tmp_path: Path) -> None:
    path = written(tmp_path, f"{SHIM}      primary_controller: dwb_core/DWBLocalPlanner\n      {DWB}")
    given = tables_of(read_nodes(path), path)["controller_server"]
    shim = settle(reader_of("controller_server"), given, "controller_server", path).children["FollowPath"]
    assert shim.group.max_angular_accel == 2.0  # type: ignore[attr-defined]
    primary = shim.children["primary_controller"]
    assert primary.group.max_vel_x == 0.4  # type: ignore[attr-defined]
    assert {name: child.group.scale for name, child in primary.children.items()} == {"GoalDist": 24.0, "Oscillation": 1.0}  # type: ignore[attr-defined]  # fmt: skip
    found = table(path)
    status = {row.name.removeprefix("controller_server.FollowPath."): row.status for row in found.rows}
    assert not found.problems
    assert {name for name, word in status.items() if word == "read"} >= {
        "primary_controller", "max_vel_x", "max_angular_accel", "critics", "GoalDist.scale",
    }  # fmt: skip
    assert status["transform_tolerance"] == "ignored"
    assert found.all_known


def test_a_misspelt_name_beside_the_primary_controllers_is_one_of_either(tmp_path: Path) -> None:
    lines = f"{DWB}      max_vel_thta: 1.0\n      angular_dist_treshold: 1.0\n      GaolDist: {{scale: 1.0}}\n"
    text = (
        f"{SHIM}      primary_controller: dwb_core::DWBLocalPlanner\n      {lines.replace('GoalDist.scale: 24.0', '')}"
    )
    notes = {
        row.name.rpartition(".")[2]: row.note for row in table(written(tmp_path, text)).rows if row.status == "unknown"
    }
    assert notes == {
        "max_vel_thta": "did you mean 'max_vel_theta'?",
        "angular_dist_treshold": "did you mean 'angular_dist_threshold'?",
        "GaolDist": "did you mean 'GoalDist'?",
    }


@pytest.mark.parametrize(
    ("primary", "lines", "said"),
    [
        ("nav2_graceful_controller::GracefulController", "k_phi: 3.0", r"primary_controller: .* is not built here"),
        ("nav2_rotation_shim_controller::RotationShimController", "a: 1", r"FollowPath\.primary_controller: names"),
        ("dwb_core::DWBLocalPlanner", "critics: [GoalDist]\n      max_vel_x: 1", r"FollowPath\.max_vel_x: is 1, an int"),
        (
            "nav2_regulated_pure_pursuit_controller::RegulatedPurePursuitController",
            "max_angular_accel: 3",
            r"FollowPath\.max_angular_accel: is 3, an integer",
        ),
    ],
)  # fmt: skip
def test_what_is_wrong_with_a_primary_controller_beside_is_one_problem(
    tmp_path: Path, primary: str, lines: str, said: str
) -> None:
    found = table(written(tmp_path, f"{SHIM}      primary_controller: {primary}\n      {lines}\n"))
    (problem,) = found.problems
    assert re.search(said, str(problem))
    if "k_phi" in lines:
        assert {row.status for row in found.rows if row.name.endswith("k_phi")} == {"missing"}
