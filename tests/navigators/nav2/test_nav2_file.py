"""A file of ROS 2 parameters is read as ROS reads it: words, names, wildcards; what ROS would not take is one error."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest

from clearway.errors import ClearwayError
from clearway.navigators.nav2.parameters.file import is_ros_parameters, merged, nested, read_nodes
from clearway.navigators.nav2.parameters.nav2_parameters import namespace, tables_of
from clearway.navigators.nav2.parameters.outline import points_of


def nodes_of(tmp_path: Path, text: str) -> Any:
    path = tmp_path / "nav2_params.yaml"
    path.write_text(text)
    return read_nodes(path)


@pytest.mark.parametrize(
    ("word", "value"),
    [
        ("1e-3", 0.001),  # a text in YAML 1.1, a double for rcl
        ("1.0e-10", 1e-10),
        (".5", 0.5),
        ("1.", 1.0),
        ("-7", -7),
        ("0x1F", 31),
        ("010", 8),  # strtoll with base 0
        ("08", 8.0),  # no octal number, but a double
        ("-.inf", -math.inf),
        ("Infinity", math.inf),
        ("on", True),
        ("NO", False),
        ("y", True),
        ("yEs", "yEs"),
        ("'true'", "true"),
        ('"1.5"', "1.5"),
        ("12:30:45", "12:30:45"),  # sexagesimal in YAML 1.1
        ("2020-01-01", "2020-01-01"),
        ("1_000", "1_000"),
        ("1e999", "1e999"),  # strtod: out of range
        ("9223372036854775808", 9223372036854775808.0),
        ("~", "~"),
        ("null", "null"),
        ("!!str 5", "5"),
    ],
)
def test_words_are_read_as_rcl_reads_them(tmp_path: Path, word: str, value: object) -> None:
    found = merged(nodes_of(tmp_path, f"n:\n  ros__parameters:\n    x: {word}\n    y: 2\n"), "/n")
    assert found == {"x": value, "y": 2}  # the key y is no truth
    assert type(found["x"]) is type(value)


def test_nan_is_a_number(tmp_path: Path) -> None:
    found = merged(nodes_of(tmp_path, "n: {ros__parameters: {x: .nan, z: nan}}"), "/n")
    assert all(isinstance(v, float) and math.isnan(v) for v in found.values())


def test_wildcards_match_by_the_names_between_slashes_and_the_later_wins(tmp_path: Path) -> None:
    text = """
/**: {ros__parameters: {a: 1, b: 1, c: 1}}
'*': {ros__parameters: {b: 2}}
controller_server: {ros__parameters: {c: 3}}
/**/controller_server: {ros__parameters: {d: 4}}
/*/controller_server: {ros__parameters: {e: 5}}
robot1: {'*': {ros__parameters: {f: 6}}}
"""
    nodes = nodes_of(tmp_path, text)
    assert merged(nodes, "/controller_server") == {"a": 1, "b": 2, "c": 3, "d": 4}
    assert merged(nodes, "/robot1/controller_server") == {"a": 1, "b": 1, "c": 1, "d": 4, "e": 5, "f": 6}
    assert merged(nodes, "/a/b/controller_server") == {"a": 1, "b": 1, "c": 1, "d": 4}


def test_a_wildcard_after_a_node_overrides_it(tmp_path: Path) -> None:
    nodes = nodes_of(tmp_path, "n: {ros__parameters: {a: 1}}\n/**: {ros__parameters: {a: 2}}\n")
    assert merged(nodes, "/n") == {"a": 2}


def test_dotted_and_nested_names_are_one(tmp_path: Path) -> None:
    text = "n: {ros__parameters: {FollowPath: {scale: 1.0, PathAlign.scale: 2.0}, FollowPath.GoalAlign: {scale: 3.0}}}"
    found = nested(merged(nodes_of(tmp_path, text), "/n"))
    assert found == {"FollowPath": {"scale": 1.0, "PathAlign": {"scale": 2.0}, "GoalAlign": {"scale": 3.0}}}


def test_a_name_that_is_a_value_and_a_namespace_is_told(tmp_path: Path) -> None:
    with pytest.raises(ClearwayError, match=r"a\.b: is a value and a namespace"):
        nested(merged(nodes_of(tmp_path, "n: {ros__parameters: {a.b: 1, a: {b: {c: 1}}}}"), "/n"))


def test_nested_nodes_and_namespaces_of_robots(tmp_path: Path) -> None:
    text = """
robot1:
  local_costmap:
    local_costmap:
      ros__parameters: {width: 4}
  controller_server:
    ros__parameters: {controller_frequency: 10.0}
/**: {ros__parameters: {use_sim_time: true}}
"""
    nodes = nodes_of(tmp_path, text)
    assert namespace(nodes, tmp_path) == "/robot1"
    tables = tables_of(nodes, tmp_path)
    assert tables["local_costmap"] == {"width": 4, "use_sim_time": True}
    assert tables["controller_server"] == {"controller_frequency": 10.0, "use_sim_time": True}


def test_a_launch_files_placeholder_for_the_namespace_is_no_name(tmp_path: Path) -> None:
    nodes = nodes_of(
        tmp_path, "<robot_namespace>:\n  controller_server: {ros__parameters: {controller_frequency: 9.0}}\n"
    )
    assert namespace(nodes, tmp_path) == ""
    assert tables_of(nodes, tmp_path)["controller_server"] == {"controller_frequency": 9.0}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("n:\n\tros__parameters:\n    a: 1\n", "line 2 has a tab"),
        ("a: &a [x, x]\nb: *a\n", "anchors"),
        ("n: {ros__parameters: {a: [1, 0.5]}}", "n.a: .*mixes an integer with a double.*0.0"),
        ("n: {ros__parameters: {a: [[1, 2], [3, 4]]}}", r"n.a.0: .*\[\[0.1, 0.1\]"),
        ("n: {ros__parameters: {a: }}", "n.a: has no value"),
        ("n: {ros__parameters: 5}", "not parameters"),
        ("n: {a: 5}", "n.a: is 5 before 'ros__parameters'"),
        ("n: {ros_parameters: {a: 5}}", "n.ros_parameters: ROS 2 has no such name; .* two underscores"),
        ("n: {m: {ros__params: {a: 5}}}", "n.m.ros__params: ROS 2 has no such name"),
        ("n: {m: {}}", "holds no ROS 2 parameters"),
        ("ros__parameters: {a: 1}", "outside of any node"),
        ("/foo**: {ros__parameters: {a: 1}}", "no name of a node"),
        ("n: {ros__parameters: {a: 1, a: 2}}", "'a' stands twice"),
        ("n: {ros__parameters: {a: 1, a: '1'}}", "'a' stands twice"),
        ("n: {ros__parameters: {a: {b: 1}, a: {b: 1}}}", "'a' stands twice"),
        ("n: {ros__parameters: {a: !!python/object/apply:os.system [id]}}", "not a YAML file"),
        ("[1, 2]", "a mapping of nodes"),
        (
            "r1: {controller_server: {ros__parameters: {a: 1}}}\nr2: {controller_server: {ros__parameters: {a: 1}}}",
            "several robots: /r1, /r2",
        ),
    ],
)
def test_what_ros_does_not_take_is_one_error(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(ClearwayError, match=said) as told:
        tables_of(nodes_of(tmp_path, text), tmp_path / "nav2_params.yaml")
    assert "nav2_params.yaml" in str(told.value)


def test_a_key_may_stand_twice_with_the_same_word(tmp_path: Path) -> None:
    assert merged(nodes_of(tmp_path, "n: {ros__parameters: {a: yes, b: 2, a: yes}}"), "/n") == {"a": True, "b": 2}


def test_a_file_of_parameters_is_known_by_what_it_holds_and_not_by_its_name(tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text("n:\n\tros__parameters:\n")  # a broken one is one still
    (tmp_path / "b.yaml").write_text("image: map.pgm\nresolution: 0.05\n")
    (tmp_path / "d.yaml").write_text("n: {ros_parameters: {a: 1}}\n")  # so is one that misspells the word
    assert is_ros_parameters(tmp_path / "a.yaml")
    assert is_ros_parameters(tmp_path / "d.yaml")
    assert not is_ros_parameters(tmp_path / "b.yaml")
    assert not is_ros_parameters(tmp_path / "c.yaml")


def test_an_outline_is_a_text() -> None:
    assert points_of("[ [0.254, .2], [0.254,-0.2],[-1e-1, 0] ]") == ((0.254, 0.2), (0.254, -0.2), (-0.1, 0.0))
    assert points_of("[[0.1 0.1] [0.1 -0.1] [-0.1 0.0]]") == ((0.1, 0.1), (0.1, -0.1), (-0.1, 0.0))
    assert points_of("[]") == points_of("") == ()
    for wrong in (
        "[[0.1, 0.1], [0.1, 0.2]]",
        "0.3",
        "[[a, b], [0, 0], [1, 1]]",
        "[[1], [2], [3]]",
        "[[1,2],[3,4],[5,6]",
        "[x[1,2],[3,4],[5,6]]",
    ):
        with pytest.raises(ValueError, match="outline"):
            points_of(wrong)
