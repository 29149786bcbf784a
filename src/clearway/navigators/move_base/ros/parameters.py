"""What a robot's own ROS 1 files mean for move_base here, and what becomes of each parameter in them.

Read from ros-planning/navigation (noetic): move_base/src/move_base.cpp, costmap_2d/src/costmap_2d_ros.cpp (loadOldParameters, where a
file lists no layers; copyParentParameters, what a costmap puts over its layers' values) and plugins/obstacle_layer.cpp (a sensor's
ranges are looked for upwards through the namespaces).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from contextlib import suppress
from typing import Any

from pydantic import BaseModel, ValidationError

from clearway.errors import ClearwayError, shown
from clearway.navigators.common.costmaps.parameters import Costmap, InflationLayer, ObstacleLayer, StaticLayer
from clearway.navigators.common.parameter_table import ParameterTable, Row, as_written, did_you_mean
from clearway.navigators.common.potentials.parameters import GlobalPlannerGroup
from clearway.navigators.move_base.local_planners.parameters import DWAParameters, TrajectoryParameters
from clearway.navigators.move_base.parameters import ClearCostmapRecovery, MoveBaseGroup, Parameters, RotateRecovery
from clearway.navigators.move_base.ros import names
from clearway.navigators.move_base.ros.files import RosFiles, read_ros_files
from clearway.validation import problems

ABOUT = "defaults are those of ROS 1's navigation, noetic"
_LOCAL: dict[str, type[BaseModel]] = {"DWAPlannerROS": DWAParameters, "TrajectoryPlannerROS": TrajectoryParameters}
_OURS = {
    "DWAPlannerROS": {"acc_lim_th", "vtheta_samples"},
    "TrajectoryPlannerROS": {"meter_scoring_honoured"},
    "costmap": {"footprint", "robot_radius", "static_layer", "obstacle_layer", "inflation_layer"},
}
"""Names that the groups here have and ROS's files have not, or have in another way."""
_RECOVERIES: dict[str, type[BaseModel]] = {
    "clear_costmap_recovery/ClearCostmapRecovery": ClearCostmapRecovery,
    "rotate_recovery/RotateRecovery": RotateRecovery,
}


def read(place: str, robot: str) -> Parameters:
    """What move_base is given by the files of a robot's package; ROS's defaults hold for all else.

    Args:
        place: A folder, or several of folders and files joined by `+`.
        robot: The robot's name, by which a file is chosen among those of several.

    Raises:
        ClearwayError: a file can't be read, or something in it is wrong.
    """
    return Told(read_ros_files(place, robot), place).parameters()


def table(place: str, robot: str) -> ParameterTable:
    """What becomes of each parameter in the files of a robot's package; as for `read`.

    Raises:
        ClearwayError: a file can't be read.
    """
    found = read_ros_files(place, robot)
    told = Told(found, place)
    with suppress(ClearwayError):  # the first of the problems, which are told together
        told.parameters()
    wrong = {problem.field for problem in told.problems}
    rows = [row for row in told.rows if row.name not in wrong]
    rows += [Row("ignored", str(file), note=what) for file, what in found.skipped.items()]
    return ParameterTable(place, ABOUT, tuple(rows), tuple(told.problems))


class Told:
    """Goes through the parameters, and notes what becomes of each.

    Args:
        found: What the files say.
        place: Where they are, for messages.
    """

    def __init__(self, found: RosFiles, place: str) -> None:
        self.rows: list[Row] = []
        self.problems: list[ClearwayError] = []
        self._tree, self._place = found.tree, place

    def parameters(self) -> Parameters:
        """What they mean.

        Raises:
            ClearwayError: a value is wrong, the first of all those in `problems`.
        """
        tree = self._tree
        groups: dict[str, Any] = {"move_base": self._move_base(tree)}
        for name, model in _LOCAL.items():
            groups[name] = self._take(
                _table(tree, name), model, name, names.LOCAL_PLANNER, names.RENAMED, but=_OURS[name]
            )
        groups["global_planner"] = self._global_planner()
        for name in ("global_costmap", "local_costmap"):
            groups[name] = self._costmap(_table(tree, name), name)
        try:
            found = Parameters.model_validate(groups)
        except ValidationError as error:
            for problem in problems(error, Parameters):
                self._problem(problem.problem, problem.field or "")
        if self.problems:
            raise self.problems[0]
        return found

    def _take(
        self,
        space: Mapping[str, Any],
        model: type[BaseModel],
        where: str,
        ignored: Mapping[str, str],
        renamed: Mapping[str, str] | None = None,
        but: Collection[str] = (),
        also: Collection[str] = (),
    ) -> dict[str, Any]:
        """The values of a namespace that a group reads and that are right; namespaces inside it are left alone.

        Args:
            space: What the files have there.
            model: The group.
            where: The namespace's name.
            ignored: Names that mean nothing here, each with why.
            renamed: Old names of the group's.
            but: Names of the group's that ROS has not.
            also: Names that something else reads there.
        """
        fields = {name: field for name, field in model.model_fields.items() if name not in but}
        renamed = {old: new for old, new in (renamed or {}).items() if new in fields and old not in fields}
        values: dict[str, Any] = {}
        for name, value in space.items():
            at = f"{where}.{name}".lstrip(".")
            if name in fields and not isinstance(value, dict):
                values[name] = tuple(value) if isinstance(value, list) else value
                default = fields[name].get_default(call_default_factory=True)
                self._row("read", at, value, "" if default in (value, None) else as_written(default))
            elif name in ignored:
                self._row("ignored", at, value, note=ignored[name])
            elif name in renamed:
                self._row(
                    "unknown",
                    at,
                    value,
                    note=f"is called {renamed[name]!r} in noetic, which does not read the old name",
                )
            elif not isinstance(value, dict):
                self._row("unknown", at, value, note=did_you_mean(name, [*fields, *ignored, *also]))
        try:
            model.model_validate(values)
        except ValidationError as error:
            for problem in problems(error, model):
                name = (problem.field or "").partition(".")[0]
                if name in values:  # else it is missing yet, or of several values together
                    del values[name]
                    self._problem(problem.problem, f"{where}.{problem.field}".lstrip("."))
        return values

    def _problem(self, problem: str, field: str) -> None:
        self.problems.append(ClearwayError(problem, file=self._place, field=field))

    def _row(self, status: Any, name: str, value: Any = "", default: str = "", note: str = "") -> None:
        self.rows.append(Row(status, name, as_written(value), default, note))

    def _move_base(self, tree: Mapping[str, Any]) -> dict[str, Any]:
        """The node's own parameters; of what only a launch file says, the local planner, what fits the files."""
        own = {name: value for name, value in tree.items() if name != "recovery_behaviors"}
        for name in ("base_local_planner", "base_global_planner"):
            plugin = own.get(name)
            built = MoveBaseGroup.model_fields[name].annotation.__args__  # type: ignore[union-attr]
            if plugin is not None and plugin not in built:
                closest = next(
                    (c for p, c in names.CLOSEST.items() if p.rpartition("/")[2] == str(plugin).rpartition("/")[2]), ""
                )
                hint = f"closest is {closest}; " if closest else ""
                self._problem(f"{shown(plugin)} is not built; {hint}there are {', '.join(built)}", name)
                del own[name]
        values = self._take(own, MoveBaseGroup, "", names.MOVE_BASE)
        if "base_local_planner" not in tree and "DWAPlannerROS" in tree:
            values["base_local_planner"] = "dwa_local_planner/DWAPlannerROS"
            self._row(
                "default",
                "base_local_planner",
                "dwa_local_planner/DWAPlannerROS",
                note="no file says it, and there are parameters for it; move-base[...,base_local_planner=TrajectoryPlannerROS] says otherwise",
            )
        if "recovery_behaviors" in tree:
            values["recovery_behaviors"] = self._recoveries(tree)
        known = {*_LOCAL, "GlobalPlanner", "NavfnROS", "global_costmap", "local_costmap", *self._recovery_names(tree)}
        for name, value in tree.items():
            if not isinstance(value, dict) or name in known:
                continue
            built = next((c for p, c in names.CLOSEST.items() if p.endswith(f"/{name}")), None)
            if built is not None:
                self._row("missing", name, value, note=f"is not built; closest is {built}")
            else:
                meant = did_you_mean(name, known)
                self._row("unknown" if meant else "ignored", name, value, note=meant or "nothing names it")
        return values

    def _recovery_names(self, tree: Mapping[str, Any]) -> list[str]:
        found = tree.get("recovery_behaviors")
        listed = found if isinstance(found, list) else ()
        usual = ["conservative_reset", "aggressive_reset", "rotate_recovery"]
        return usual + [str(one.get("name")) for one in listed if isinstance(one, dict)]

    def _recoveries(self, tree: Mapping[str, Any]) -> tuple[dict[str, Any], ...]:
        found = []
        listed = tree["recovery_behaviors"]
        if not isinstance(listed, list) or not all(isinstance(b, dict) and {"name", "type"} <= set(b) for b in listed):
            self._problem(
                f"is {shown(listed)}; a list of behaviours, each with name and type, is read", "recovery_behaviors"
            )
            return ()
        for one in listed:
            name, kind = str(one["name"]), str(one["type"])
            if kind not in _RECOVERIES:
                self._row(
                    "missing",
                    f"recovery_behaviors.{name}",
                    kind,
                    note=f"closest is {names.CLOSEST.get(kind, 'none')}; it is left out",
                )
                continue
            self._row("read", f"recovery_behaviors.{name}", kind)
            values = self._take(_table(tree, name), _RECOVERIES[kind], name, {}, but=("name", "type"))
            found.append({"name": name, "type": kind, **values})
        return tuple(found)

    def _global_planner(self) -> dict[str, Any]:
        plugin = self._tree.get("base_global_planner", "navfn/NavfnROS")
        own, other = (
            ("GlobalPlanner", "NavfnROS") if plugin == "global_planner/GlobalPlanner" else ("NavfnROS", "GlobalPlanner")
        )
        few = [n for n in GlobalPlannerGroup.model_fields if n not in ("allow_unknown", "default_tolerance")]
        for name, value in _table(self._tree, other).items():
            self._row("ignored", f"{other}.{name}", value, note=f"base_global_planner is {plugin}")
        return self._take(
            _table(self._tree, own), GlobalPlannerGroup, own, names.GLOBAL_PLANNER, but=few if own == "NavfnROS" else ()
        )

    def _costmap(self, space: Mapping[str, Any], where: str) -> dict[str, Any]:
        """A costmap and its layers."""
        old = "plugins" not in space
        layers = _old_layers(space) if old else self._layers(space["plugins"], f"{where}.plugins")
        built = {names.LAYERS.get(kind) for kind in layers.values()}
        idle = {n: "no layer is listed that would get it" for part in _COPIED.keys() - built for n in _COPIED[part]}
        ignored = names.COSTMAP | idle | {"plugins": "see its layers below"}
        moved = {n for part in _COPIED.keys() & built for n in _COPIED[part]} - set(Costmap.model_fields)
        if old:
            moved |= {"observation_sources", *str(space.get("observation_sources", "")).split()}
        here = {
            n: v for n, v in space.items() if n not in (*moved, "footprint", "robot_radius", "global_frame", *layers)
        }
        values = self._take(here, Costmap, where, ignored, but=_OURS["costmap"], also=moved)
        given = {n: v for n, v in space.items() if n not in here} | values
        values |= self._outline(space, where)
        if "global_frame" in space:
            self._row("read", f"{where}.global_frame", space["global_frame"])
            values["global_frame"] = str(space["global_frame"]).strip("/").rpartition("/")[2]
        values |= {"static_layer": None, "obstacle_layer": None, "inflation_layer": None}
        values.setdefault("rolling_window", False)
        values.setdefault("global_frame", "map")
        for name, kind in layers.items():
            at, table = f"{where}.{name}", _table(space, name)
            part = names.LAYERS.get(kind)
            if part is None or values[part] is not None:
                closest = (
                    names.CLOSEST.get(kind, "none") if part is None else f"the {part} above, of which there is one here"
                )
                self._row("missing", at, kind, note=f"closest is {closest}; it is left out")
            elif part == "obstacle_layer":
                searched = kind == "costmap_2d::VoxelLayer" and not old
                values[part] = {"name": name, **self._obstacles(given, table, at, old, searched)}
            else:
                values[part] = self._layer(given, table, part, at)
        for name, value in space.items():
            if isinstance(value, dict) and name not in layers and name not in moved:
                if note := did_you_mean(name, layers):
                    self._row("unknown", f"{where}.{name}", value, note=note)
                elif layers or old:
                    self._row("ignored", f"{where}.{name}", value, note="it stands in no list of layers or sources")
                else:
                    self._row("missing", f"{where}.{name}", value, note="no layer is listed that would read it")
        return values

    def _layers(self, plugins: Any, field: str) -> dict[str, str]:
        """The layers that a list names, each with its type."""
        if not isinstance(plugins, list) or not all(
            isinstance(p, dict) and {"name", "type"} <= set(p) for p in plugins
        ):
            self._problem(f"is {shown(plugins)}; a list of layers, each with name and type, is read", field)
            return {}
        found: dict[str, str] = {}
        for plugin in plugins:
            name = str(plugin["name"])
            if name in found:
                self._problem(f"has the layer {name!r} twice", field)
            found[name] = str(plugin["type"])
        return found

    def _outline(self, space: Mapping[str, Any], where: str) -> dict[str, Any]:
        """The footprint, which a radius gives way to; its vertices counter-clockwise."""
        footprint = space.get("footprint")
        given: dict[str, Any] = {}
        if footprint not in (None, "", "[]", []):
            points = _points(footprint)
            if points is None:
                self._problem(
                    f"{shown(footprint)} is no outline; three points or more, as [[0.3, 0.2], [0.3, -0.2], [-0.3, -0.2]]",
                    f"{where}.footprint",
                )
                return {}
            area = sum(a[0] * b[1] - b[0] * a[1] for a, b in zip(points, (*points[1:], points[0]), strict=True))
            given["footprint"] = points if area > 0 else points[::-1]
            self._row("read", f"{where}.footprint", footprint)
        if "robot_radius" in space:
            if given:
                self._row("ignored", f"{where}.robot_radius", space["robot_radius"], note="there is a footprint")
            else:
                given["robot_radius"] = space["robot_radius"]
                self._row("read", f"{where}.robot_radius", space["robot_radius"])
        return given

    def _layer(
        self,
        costmap: Mapping[str, Any],
        layer: Mapping[str, Any],
        part: str,
        where: str,
        but: Collection[str] = (),
        searched: bool = False,
    ) -> dict[str, Any]:
        """A layer's values, and what it has of its costmap.

        Args:
            costmap: The costmap's values.
            layer: The layer's own.
            part: That it plays.
            where: Its name.
            but: As for `_take`.
            searched: Whether the costmap's ranges hold where the layer has none, and nothing is copied.
        """
        above, model = where.rpartition(".")[0], _PARTS[part]
        shared = {n: costmap[n] for n in (_SEARCHED if searched else _COPIED[part]) if n in costmap}
        for n in [n for n in shared if n in layer]:
            if searched:
                self._row("ignored", f"{above}.{n}", shared.pop(n), note=f"{where}.{n} holds")
            else:
                self._row("ignored", f"{where}.{n}", layer[n], note=f"{above}.{n} is copied over it")
        values = self._take({n: v for n, v in layer.items() if n not in shared}, model, where, names.LAYER, but=but)
        told = {
            n: v for n, v in shared.items() if n in Costmap.model_fields
        }  # which has its line, as the costmap's own
        return values | told | self._take({n: v for n, v in shared.items() if n not in told}, model, above, {})

    def _obstacles(
        self, costmap: Mapping[str, Any], layer: Mapping[str, Any], where: str, old: bool, searched: bool
    ) -> dict[str, Any]:
        """An obstacle layer; its sensors that are lidars are all the robot's."""
        lists = costmap if old and "observation_sources" in costmap else layer
        listed = str(lists.get("observation_sources", "")).split()
        sources = {s: _table(lists, s) or _table(layer, s) for s in listed}
        for source, table in sources.items():
            seen = "marking", "clearing", "inf_is_valid", "observation_persistence", *_SEARCHED
            known = {n: v for n, v in table.items() if n in seen}
            right = self._take(known, ObstacleLayer, f"{where}.{source}", {})
            sources[source] = {n: v for n, v in table.items() if n in right or n not in known}
            for n, value in table.items():
                if n == "data_type" and value != "LaserScan":
                    self._row(
                        "missing",
                        f"{where}.{source}.{n}",
                        value,
                        note="closest is LaserScan; this sensor sees nothing here",
                    )
                elif n in names.SOURCE:
                    self._row("ignored", f"{where}.{source}.{n}", value, note=names.SOURCE[n])
                elif n not in known:
                    self._row("unknown", f"{where}.{source}.{n}", value, note=did_you_mean(n, [*seen, *names.SOURCE]))
        own = {n: v for n, v in layer.items() if n not in (*sources, "observation_sources")}
        sensors = ("name", "marking", "clearing", "inf_is_valid", "observation_persistence")
        values = self._layer(costmap, own, "obstacle_layer", where, sensors, searched)
        self._row("read", f"{where}.observation_sources", " ".join(listed))
        lidars = {s: t for s, t in sources.items() if t.get("data_type", "PointCloud") == "LaserScan"}
        marking = [t for t in lidars.values() if t.get("marking", True)]
        clearing = [t for t in lidars.values() if t.get("clearing", False)]
        first = (marking or clearing or [{}])[0]
        values |= {"marking": bool(marking), "clearing": bool(clearing)}
        for field, usual in (("obstacle_range", marking), ("raytrace_range", clearing)):
            found = next((space for space in (*usual[:1], values, self._tree) if field in space), {})
            values |= {n: v for n, v in found.items() if n == field}
        values |= {n: first[n] for n in ("inf_is_valid", "observation_persistence") if n in first}
        return values


_PARTS: dict[str, type[BaseModel]] = {
    "static_layer": StaticLayer,
    "obstacle_layer": ObstacleLayer,
    "inflation_layer": InflationLayer,
}
_SEARCHED = ("obstacle_range", "raytrace_range")
_COPIED = {
    "static_layer": ("lethal_cost_threshold", "track_unknown_space"),
    "obstacle_layer": (*_SEARCHED, "track_unknown_space"),
    "inflation_layer": ("inflation_radius", "cost_scaling_factor"),
}
"""What a costmap puts over the values of its layers; of a VoxelLayer in a list only heights, which mean nothing here."""


def _old_layers(space: Mapping[str, Any]) -> dict[str, str]:
    static = {"static_layer": "costmap_2d::StaticLayer"} if space.get("static_map") is True else {}
    kind = "costmap_2d::VoxelLayer" if space.get("map_type") == "voxel" else "costmap_2d::ObstacleLayer"
    return {**static, "obstacle_layer": kind, "inflation_layer": "costmap_2d::InflationLayer"}


def _points(footprint: Any) -> tuple[tuple[float, float], ...] | None:
    """The points of a footprint, which is a list or a text of one."""
    if isinstance(footprint, str):
        import json

        try:
            footprint = json.loads(footprint)
        except (ValueError, RecursionError):
            return None
    if not isinstance(footprint, list) or len(footprint) < 3:
        return None
    points = []
    for point in footprint:
        if not (isinstance(point, list) and len(point) == 2 and all(isinstance(c, int | float) for c in point)):
            return None
        points.append((float(point[0]), float(point[1])))
    return tuple(points)


def _table(tree: Mapping[str, Any], name: str) -> dict[str, Any]:
    found = tree.get(name)
    return found if isinstance(found, dict) else {}
