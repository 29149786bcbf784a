"""Finds navigators: those registered under the entry-point group `clearway.navigators`, and a user's own by address.

An address is `pkg.module:Class`, or `path/to/file.py:Class` for a file that is not installed; or it begins with a scheme, as
`exec:./my_planner --flag` for a program, `tcp://127.0.0.1:5555` for a server, `npz:policy.npz` for a learnt policy. Options for its
constructor may stand behind it, as in `hp-tmpc[solver=genetic,prediction_horizon=10]`: a variant with a name of its
own in the results.
"""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, get_args

from clearway.contract import Navigator, Need
from clearway.errors import ClearwayError, nearest, unknown
from clearway.registry import Registry, in_a_line
from clearway.robots import DriveKind, Robot

NAVIGATORS = Registry(
    "navigator",
    "clearway.navigators",
    {
        "move-base": "clearway.navigators.move_base:MoveBase",
        "nav2": "clearway.navigators.nav2:Nav2",
        "hp-tmpc": "clearway.navigators.hp_tmpc:HpTmpc",
        "hp-st": "clearway.navigators.hp_st:HpSt",
        "hp-st-foresight": "clearway.navigators.hp_st:HpStForesight",
        "hl-rrt": "clearway.navigators.hl_rrt:HlRrt",
        "colregs-apf": "clearway.navigators.colregs_apf:ColregsApf",
        "colregs-apf-retuned": "clearway.navigators.colregs_apf:RetunedColregsApf",
        "orca": "clearway.navigators.orca:Orca",
        "social-force": "clearway.navigators.social_force:SocialForceNavigator",
        "mpc-cbf": "clearway.navigators.mpc_cbf:MpcCbf",
        "mppi-forecast": "clearway.navigators.mppi_forecast:MppiForecast",
        "ppo": "clearway.navigators.learnt.ppo:Ppo",
        "oracle": "clearway.navigators.oracle:Oracle",
    },
    schemes={
        "exec": "clearway.live.addresses:program",
        "tcp": "clearway.live.addresses:server",
        "arena": "clearway.live.addresses:planner",
        "npz": "clearway.navigators.learnt.navigator:npz",
        "onnx": "clearway.navigators.learnt.navigator:onnx",
        "ros1": "clearway.live.ros1.address:stack",
        "ros2": "clearway.live.ros2.address:stack",
    },
)


def navigator_names() -> list[str]:
    """Names of the registered navigators, sorted.

    Raises:
        ClearwayError: two packages register different navigators under one name.
    """
    return sorted(NAVIGATORS.addresses())


def navigator_class(name: str) -> Callable[..., Navigator]:
    """The class (or other factory) behind a registered name or an address, whatever options stand behind it.

    Raises:
        ClearwayError: no such name, module, file or attribute, or its module fails to import.
    """
    name, _ = split_options(name)
    found = NAVIGATORS.find(name)
    if not callable(found):
        raise ClearwayError(f"navigator {name!r} is a {type(found).__name__}, not a class that makes a navigator")
    factory: Callable[..., Navigator] = found
    return factory


def make_navigator(name: str, **options: Any) -> Navigator:
    """A new navigator by registered name or address; `options` go to its constructor.

    Raises:
        ClearwayError: it can't be found, imported or constructed.
    """
    factory, given = navigator_class(name), split_options(name)[1] | options
    known, others = _options_of(factory)
    for option in given:
        if option not in known and (nearest(option, known, 0.75) or not others):
            raise unknown("option", option, known, field=f"navigator {name!r}")
    try:
        navigator = factory(**given)
    except ClearwayError:
        raise
    except (Exception, SystemExit) as error:  # and not what breaks it off, a limit or Ctrl-C
        raise ClearwayError(f"navigator {name!r} cannot be made: {in_a_line(error)}") from error
    for method in ("reset", "step"):
        if not callable(getattr(navigator, method, None)):
            raise ClearwayError(
                f"{name!r} is not a navigator: it has no method {method}(); see clearway.contract.Navigator"
            )
    return navigator


def _options_of(factory: Callable[..., Navigator]) -> tuple[list[str], bool]:
    """The options that a navigator's constructor names, and whether it takes others too."""
    try:
        parameters = inspect.signature(factory).parameters.values()
    except (TypeError, ValueError):  # of compiled code nothing is known
        return [], True
    named = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)
    return [p.name for p in parameters if p.kind in named], any(p.kind is p.VAR_KEYWORD for p in parameters)


def needs_of(name: str, navigator: Navigator) -> frozenset[str]:
    """What observations of `navigator`, which goes by `name`, must hold.

    Raises:
        ClearwayError: it says so in another way than by a set of what there is.
    """
    return _said_by(name, navigator, "needs", get_args(Need))


def wants_of(name: str, navigator: Navigator) -> frozenset[str]:
    """What `navigator`, which goes by `name`, is shown where it is to be had.

    Raises:
        ClearwayError: it says so in another way than by a set of what there is.
    """
    return _said_by(name, navigator, "wants", ("scan",))


def _said_by(name: str, navigator: Navigator, attribute: str, choices: Iterable[str]) -> frozenset[str]:
    known = sorted(choices)
    try:
        said: object = getattr(navigator, attribute, frozenset())
        if isinstance(said, frozenset | set) and said <= set(known):
            return frozenset(said)
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        raise ClearwayError(f"navigator {name!r} cannot say what it {attribute}: {in_a_line(error)}") from error
    raise ClearwayError(
        f"navigator {name!r} {attribute} {said!r:.100}; `{attribute}` is a frozenset of some of {', '.join(known)}"
    )


def drives_of(name: str, navigator: object) -> frozenset[str]:
    """The kinds of bases that `navigator` (or its class), which goes by `name`, drives; who says nothing drives differential ones.

    Raises:
        ClearwayError: it says so in another way than by a set of what there is.
    """
    known = get_args(DriveKind)
    try:
        drives: object = getattr(navigator, "drives", None)
        if drives is None:
            return frozenset({"differential"})
        if isinstance(drives, frozenset | set) and drives and drives <= set(known):
            return frozenset(drives)
    except KeyboardInterrupt:
        raise
    except BaseException as error:
        raise ClearwayError(f"navigator {name!r} cannot say what it drives: {in_a_line(error)}") from error
    raise ClearwayError(
        f"navigator {name!r} drives {drives!r:.100}; `drives` is a frozenset of some of {', '.join(known)}"
    )


def check_drive(name: str, navigator: object, robot: Robot) -> None:
    """See that `navigator`, which goes by `name`, drives bases of the robot's kind.

    Raises:
        ClearwayError: it doesn't.
    """
    drives, kind = drives_of(name, navigator), robot.limits().kind
    if kind not in drives:
        raise ClearwayError(
            f"navigator {name!r} drives {' and '.join(sorted(drives))} bases, and that of the robot {robot.name!r} is "
            f"{kind}; `clearway list navigators` tells who drives it"
        )


def check_parameters(name: str, navigator: Navigator, robot: Robot, *, mapped: bool = True) -> Any:
    """Have `navigator`, which goes by `name`, read its parameters for `robot`; what it made of them, None if it reads none.

    Raises:
        ClearwayError: one of them is wrong, in the robot's file or among the navigator's options, or takes a map and the
            robot is not `mapped`.
    """
    read, check = getattr(navigator, "read_parameters", None), getattr(navigator, "check_without_map", None)
    try:
        if check is not None and not mapped:
            check(robot.model_copy(deep=True))
        return None if read is None else read(robot.model_copy(deep=True))
    except (ClearwayError, KeyboardInterrupt):
        raise
    except BaseException as error:
        raise ClearwayError(f"navigator {name!r} cannot read its parameters: {in_a_line(error)}") from error


def files_of(name: str, factory: object, options: Mapping[str, Any]) -> tuple[Path, ...]:
    """The files whose content decides what the navigators of `factory`, which goes by `name`, do with these options.

    Raises:
        ClearwayError: it says so in another way than by a list or tuple of paths.
    """
    say = getattr(factory, "files", None)
    if say is None:
        return ()
    try:
        said = say(**options)
    except (ClearwayError, KeyboardInterrupt):
        raise
    except BaseException as error:
        raise ClearwayError(f"navigator {name!r} cannot say which files it reads: {in_a_line(error)}") from error
    if not isinstance(said, list | tuple) or not all(isinstance(file, str | Path) for file in said):
        raise ClearwayError(
            f"navigator {name!r} reads {said!r:.100}; `files` answers with a tuple of paths, () for none"
        )
    return tuple(map(Path, said))


def split_options(name: str) -> tuple[str, dict[str, Any]]:
    """The name without its options, and these: numbers, true and false as such, all else as text. A command line (`exec:`) has none.

    Raises:
        ClearwayError: the brackets don't hold `option=value` parts.
    """
    if not name.endswith("]") or name.startswith("exec:"):
        return name, {}
    plain, _, inside = name[:-1].partition("[")
    options: dict[str, Any] = {}
    for part in inside.split(","):
        option, equals, value = (text.strip() for text in part.partition("="))
        if not (option.isidentifier() and equals and value):
            raise ClearwayError(f"navigator {name!r}: {part.strip()!r} is not an option; write name[option=value,...]")
        try:
            options[option] = json.loads(value)
        except (ValueError, RecursionError):  # no JSON, a number of 5,000 digits, brackets without end
            options[option] = value
    return plain, options


def with_option(name: str, option: str, value: str) -> str:
    """The name with `option=value` behind what stands in its brackets already: `hp-st` -> `hp-st[without=reverse]`."""
    head = f"{name[:-1]}," if name.endswith("]") else f"{name}["
    return f"{head}{option}={value}]"
