"""Which navigators `--without` and `--guarantee` make of the chosen ones."""

from __future__ import annotations

from pathlib import Path

import pytest
from dodging_variants import Tries

import clearway
from clearway.api.arguments import options_of
from clearway.campaigns.objects import navigator_name
from clearway.campaigns.variants import variants
from clearway.errors import ClearwayError
from clearway.navigators.registry import split_options, with_option

TRIES = f"{Path(__file__).with_name('dodging_variants.py')}:Tries"


def test_beside_each_navigator_that_knows_it_runs_the_variant_without() -> None:
    chosen, options = variants(["hp-tmpc", TRIES], {TRIES: {"x": 1}}, without=["waits", "speed", "waits+speed"])
    made = [f"{TRIES}[without={w}]" for w in ("waits", "speed", "waits+speed")]
    assert chosen == ("hp-tmpc", TRIES, *made)
    assert options == {name: {"x": 1} for name in (TRIES, *made)}


def test_guarantees_are_run_apart_each_with_and_without() -> None:
    chosen, _ = variants([TRIES, "oracle"], {}, without=["waits"], guarantees=["none", "passive"])
    assert chosen == (
        f"{TRIES}[guarantee=none]",
        f"{TRIES}[guarantee=none,without=waits]",
        f"{TRIES}[guarantee=passive]",
        f"{TRIES}[guarantee=passive,without=waits]",
        "oracle",
    )
    assert split_options(chosen[1])[1] == {"guarantee": "none", "without": "waits"}


def test_a_privileged_reference_keeps_all_its_ingredients() -> None:
    knows = TRIES.replace(":Tries", ":Knows")
    chosen, _ = variants([TRIES, knows], {}, without=["waits"], guarantees=["none"])
    assert chosen == (
        f"{TRIES}[guarantee=none]",
        f"{TRIES}[guarantee=none,without=waits]",
        f"{knows}[guarantee=none]",
    )
    with pytest.raises(ClearwayError, match="none of the navigators has ingredients"):
        variants([knows], {}, without=["waits"])


def test_brackets_that_are_there_stay_and_nothing_is_left_out_twice() -> None:
    one, other = f"{TRIES}[guarantee=passive]", f"{TRIES}[without=speed]"
    chosen, _ = variants([one, other], {}, without=["waits"])
    assert chosen == (one, f"{TRIES}[guarantee=passive,without=waits]", other)
    assert variants([TRIES, other], {}, without=["speed"])[0] == (TRIES, other)
    assert variants(["hp-tmpc"], {"else": {}}) == (("hp-tmpc",), {"else": {}})


@pytest.mark.parametrize(
    ("navigators", "options", "asked", "said"),
    [
        ([TRIES], {}, {"without": ["wait"]}, "--without: unknown ingredient 'wait'; did you mean 'waits'? known: speed, waits"),
        ([TRIES], {}, {"without": ["waits+sped"]}, "did you mean 'speed'"),
        (["hp-tmpc"], {}, {"without": ["waits"]}, "--without: none of the navigators has ingredients: hp-tmpc"),
        (["hp-tmpc"], {}, {"guarantees": ["none"]}, "--guarantee: none of the navigators has guarantees: hp-tmpc"),
        ([TRIES], {}, {"guarantees": ["pasive"]}, "unknown guarantee 'pasive'; did you mean 'passive'"),
        ([TRIES], {}, {"guarantees": ["none+passive"]}, "unknown guarantee 'none+passive'"),
        ([with_option(TRIES, "guarantee", "none")], {}, {"guarantees": ["passive"]}, "says its own guarantee already"),
        ([TRIES], {TRIES: {"guarantee": "none"}}, {"guarantees": ["passive"]}, "says its own guarantee already"),
    ],
)  # fmt: skip
def test_what_nobody_knows_is_refused(navigators, options, asked, said) -> None:
    with pytest.raises(ClearwayError) as error:
        variants(navigators, options, **asked)
    assert said in str(error.value)


@pytest.mark.parametrize("name", ["Tries", "hp-tmcp"])
def test_options_of_nobody_who_drives_are_refused_before_anything_runs(name: str, tmp_path: Path) -> None:
    with pytest.raises(ClearwayError, match=f"options: unknown navigator '{name}'"):
        clearway.run(
            "hospital",
            robots="tiago",
            navigators="hp-tmpc",
            batches="NO",
            options={name: {"x": 1}},
            out=tmp_path / "out",
        )
    assert not (tmp_path / "out").exists()


def test_a_class_may_say_whose_options_they_are() -> None:
    name = navigator_name(Tries)
    assert options_of({Tries: {"x": 1}}) == options_of({name: {"x": 1}}) == {name: {"x": 1}}
