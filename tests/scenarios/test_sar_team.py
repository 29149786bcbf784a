"""The suite `sar-team`: each robot has a start, a goal and a way past what stands; obstacles keep paper B's rules."""

from __future__ import annotations

import json
import math
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import clearway
from clearway.campaigns.drawing import drawn
from clearway.campaigns.plan import CampaignPlan
from clearway.errors import ClearwayError
from clearway.robots import load_robot
from clearway.scenarios import sar_rules as rules
from clearway.scenarios.check import check_scenario
from clearway.scenarios.sar_draws import CASES, Case
from clearway.scenarios.sar_team import HELD_OUT_SAR_TEAM, NUMBERS, SAR_TEAM, _read, _written
from clearway.scenarios.sar_team_draws import KINDS, STREAMS, TEAM, WIDEST, draw
from clearway.scenarios.static_way import static_way
from clearway.scenarios.suite import Selection

RESCUE = load_robot("rescue")


@settings(max_examples=15, deadline=None)
@given(
    case=st.sampled_from([CASES["case 1 confined"], CASES["case 2 confined"], STREAMS]),
    robots=st.integers(2, 8),
    seed=st.integers(0, 10**6),
)
def test_what_is_drawn_holds_what_it_must(case: Case, robots: int, seed: int) -> None:
    found = draw(case, robots, seed)
    layout, (starts, goals) = found.layout, list(zip(*found.ends, strict=True))
    assert (len(layout.static), len(layout.start), len(starts)) == (case.static, case.moving, robots)
    assert min(math.dist(p, q) for ends in (starts, goals) for p, q in combinations(ends, 2)) >= TEAM["apart"]
    assert min(math.dist(a, b) for a, b in found.ends) >= TEAM["way"]
    assert not rules.overlaps(layout)
    assert not rules.leavers(layout).any()
    at = np.concatenate([layout.static, layout.start])
    for ends, obstacles in ((starts, at), (goals, layout.static)):
        assert min(math.dist(e, o) for e in ends for o in obstacles) - rules.RADIUS >= TEAM["clear"]
    discs = np.column_stack([layout.static, np.full(len(layout.static), WIDEST + rules.RADIUS)])
    for a, b in found.ends:
        assert static_way(np.array(a), np.array(b), discs, rules.AREA) is not None
    again = _read(json.loads(json.dumps(_written(found))))
    assert again.ends == found.ends
    assert (again.layout.start == layout.start).all()


def test_frozen_ones_are_sound_and_mixed_ones_are_the_same_with_robots_of_three_kinds() -> None:
    made = {s.name: s for s in SAR_TEAM.build(RESCUE, Selection())}
    assert len(made) == 4 * 10 * len(NUMBERS)
    for scenario in list(made.values())[::9]:
        assert [str(problem) for problem in check_scenario(scenario, RESCUE)] == []
    equal, mixed = made["case-2-8-scenario-3-v1-r1"], made["case-2-mixed-8-scenario-3-v1.2-r1"]
    assert equal.obstacles == mixed.obstacles
    assert [r.start for r in equal.robots] == [r.start for r in mixed.robots]
    assert {r.robot for r in equal.robots} == {None}
    assert {r.robot for r in mixed.robots} == set(KINDS)


def test_held_out_robots_cross_in_two_streams_at_speeds_of_their_own() -> None:
    made = HELD_OUT_SAR_TEAM.build(RESCUE, Selection(configurations=("4",)))
    assert {(s.labels.batch, s.speed) for s in made} == {("streams", 0.8), ("streams mixed", 1.0)}
    low, high = TEAM["margin"] + TEAM["streams"]["band"], rules.SIZE - TEAM["margin"] - TEAM["streams"]["band"]
    for scenario in made:
        ways = [(s.start[0], s.legs[0].goal[0]) for s in (scenario, *scenario.robots)]
        assert [a < b for a, b in ways] == [True, False, True, False]
        assert all(min(way) <= low < high <= max(way) for way in ways)


def test_the_kinds_differ_in_size_speed_and_sight() -> None:
    scout, carrier, rescue = map(load_robot, KINDS)
    for value in (lambda r: r.footprint.radius, lambda r: r.drive.v_max, lambda r: r.camera.range):
        assert len({value(scout), value(carrier), value(rescue)}) == 3


def test_seeds_draw_others_when_a_trial_needs_them() -> None:
    plan = CampaignPlan(("sar-team",), selection=Selection(seeds=(3, 5), batches=("case 1",), configurations=("2",)))
    specs = plan.specs()
    assert {s.scenario.name for s in specs} == {"case-1-2-seed-3-v1-r1", "case-1-2-seed-4-v1-r1"}
    assert all(s.scenario.obstacles == () for s in specs)
    ready = drawn(plan, specs[0]).scenario
    assert len(ready.obstacles) == 11
    assert ready.start != drawn(plan, specs[2]).scenario.start


def test_a_team_replaces_the_kinds() -> None:
    team = Selection(team=("rescue", "rescue:carrier", "rescue"))
    made = SAR_TEAM.build(RESCUE, team)
    assert {s.labels.batch for s in made} == {"case 1", "case 2"}
    assert [r.robot for r in made[0].robots] == ["rescue:carrier", "rescue"]
    with pytest.raises(
        ClearwayError, match="9 robots are more than the arena of the suite 'sar-team' is meant for; at most 8"
    ):
        SAR_TEAM.build(RESCUE, Selection(team=("rescue",) * 9))


def test_a_mixed_pair_gets_there(tmp_path: Path) -> None:
    results = clearway.run(
        "sar-team",
        navigators=["orca"],
        scenarios=["case-1-mixed-2-scenario-2-v1.2-r1"],
        workers=1,
        out=tmp_path / "out",
    )
    rows = results.trials.to_pylist()
    assert [row["robot"] for row in rows] == ["rescue", "rescue:scout"]
    assert [row["outcome"] for row in rows] == ["reached", "reached"]
