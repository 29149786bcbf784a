"""How near to each trial's test its navigator's parameters were chosen."""

from __future__ import annotations

from collections.abc import Sequence

from clearway.campaigns.plan import CampaignPlan, TrialSpec
from clearway.contract import Navigator
from clearway.errors import ClearwayError
from clearway.scenarios.suite import draw_label
from clearway.tuning import Tuned, TunedOn


def tuned_on(name: str, navigator: Navigator) -> tuple[TunedOn, ...] | None:
    """On what `navigator`, which goes by `name`, says that its parameters were chosen; None if it says nothing.

    Raises:
        ClearwayError: what it says is no tuple of `TunedOn`.
    """
    said = getattr(navigator, "tuned_on", None)
    if said is None:
        return None
    if not isinstance(said, tuple) or not all(isinstance(one, TunedOn) for one in said):
        raise ClearwayError(
            f"navigator {name!r}: `tuned_on` is {said!r}; it must be a tuple of clearway.tuning.TunedOn, () for nothing"
        )
    return said


def in_words(tests: Sequence[TunedOn] | None) -> list[str] | None:
    """What a navigator declares, as its results have it."""
    return None if tests is None else [str(test) for test in tests]


def tuned(said: Sequence[TunedOn] | None, plan: CampaignPlan, spec: TrialSpec) -> Tuned:
    """How near to the trial's test the parameters were chosen.

    Args:
        said: What the trial's navigator declares.
        plan: The campaign that the trial belongs to.
        spec: The trial.
    """
    if said is None:
        return Tuned.UNDECLARED
    order = list(Tuned)
    return min((_near(one, plan, spec) for one in said), key=order.index, default=Tuned.NO)


def _near(one: TunedOn, plan: CampaignPlan, spec: TrialSpec) -> Tuned:
    scenario = spec.scenario
    if scenario.labels.suite != one.suite:
        return Tuned.NO
    if plan.selection.seeds is None:
        same = one.draws is None
    else:
        same = one.draws is not None and scenario.labels.configuration in map(draw_label, one.draws)
    if not same or one.floor_plan not in ("", scenario.floor_plan):
        return Tuned.SUITE
    very = (
        (not one.robots or spec.robots[spec.member].partition(":")[0] in one.robots)
        and (not one.seeds or plan.seed in one.seeds)
        and (not one.speeds or scenario.speed in one.speeds)
    )
    return Tuned.SCENARIO if very else Tuned.GEOMETRY
