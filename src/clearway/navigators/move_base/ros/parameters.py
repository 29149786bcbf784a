"""What a robot's own ROS 1 files mean for move_base here, and what becomes of each parameter in them.

Read from ros-planning/navigation (noetic): move_base/src/move_base.cpp, costmap_2d/src/costmap_2d_ros.cpp (resetOldParameters, where a
file lists no layers) and plugins/obstacle_layer.cpp (a sensor's ranges are looked for upwards through the namespaces).
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from clearway.errors import ClearwayError, shown
from clearway.navigators.common.costmaps.parameters import Costmap, InflationLayer, ObstacleLayer, StaticLayer
from clearway.navigators.common.parameter_table import ParameterTable, Row, as_written, nearest
from clearway.navigators.common.potentials.parameters import GlobalPlannerGroup
from clearway.navigators.move_base.local_parameters import DWAParameters, TrajectoryParameters
from clearway.navigators.move_base.parameters import ClearCostmapRecovery, MoveBaseGroup, Parameters, RotateRecovery
from clearway.navigators.move_base.ros import names
from clearway.navigators.move_base.ros.files import RosFiles, read_ros_files
from clearway.validation import first_problem

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
    told = Told(read_ros_files(place, robot), place)
    parameters = told.parameters()
    if told.problems:
        raise told.problems[0]
    return parameters


def table(place: str, robot: str) -> ParameterTable:
    """What becomes of each parameter in the files of a robot's package; as for `read`.

    Raises:
        ClearwayError: a file can't be read.
    """
    found = read_ros_files(place, robot)
    told = Told(found, place)
    try:
        told.parameters()
    except ClearwayError as error:
        told.problems.append(error)
    told.rows += [Row("ignored", str(file), note=what) for file, what in found.skipped.items()]
    return ParameterTable(place, ABOUT, tuple(told.rows), tuple(told.problems))


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
            ClearwayError: a value is wrong.
        """
        tree = self._tree
        groups: dict[str, Any] = {"move_base": self._move_base(tree)}
        for name, model in _LOCAL.items():
            groups[name] = self._take(
                _table(tree, name), model, name, names.LOCAL_PLANNER, names.RENAMED, but=_OURS[name]
            )
        groups["global_planner"] = self._global_planner(groups["move_base"])
        for name in ("global_costmap", "local_costmap"):
            groups[name] = self._costmap(_table(tree, name), name)
        try:
            return Parameters.model_validate(groups)
        except ValidationError as error:
            problem = first_problem(error, Parameters)
            raise ClearwayError(problem.problem, file=self._place, field=problem.field) from error

    def _take(
        self,
        space: Mapping[str, Any],
        model: type[BaseModel],
        where: str,
        ignored: Mapping[str, str],
        renamed: Mapping[str, str] | None = None,
        but: Collection[str] = (),
    ) -> dict[str, Any]:
        """The values of a namespace that a group reads; namespaces inside it are left alone."""
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
                self._row("unknown", at, value, note=nearest(name, [*fields, *ignored]))
        return values

    def _row(self, status: Any, name: str, value: Any = "", default: str = "", note: str = "") -> None:
        self.rows.append(Row(status, name, as_written(value), default, note))

    def _move_base(self, tree: Mapping[str, Any]) -> dict[str, Any]:
        """The node's own parameters; of what only a launch file says, the local planner, what fits the files."""
        own = {name: value for name, value in tree.items() if name != "recovery_behaviors"}
        values = self._take(own, MoveBaseGroup, "", names.MOVE_BASE)
        for name, planners in (("base_local_planner", MoveBaseGroup), ("base_global_planner", MoveBaseGroup)):
            plugin = values.get(name)
            built = planners.model_fields[name].annotation.__args__  # type: ignore[union-attr]
            if plugin is not None and plugin not in built:
                closest = next(
                    (c for p, c in names.CLOSEST.items() if p.rpartition("/")[2] == str(plugin).rpartition("/")[2]), ""
                )
                raise ClearwayError(
                    f"{shown(plugin)} is not built; {f'closest is {closest}; ' if closest else ''}there are {', '.join(built)}",
                    file=self._place,
                    field=name,
                )
        if "base_local_planner" not in values and "DWAPlannerROS" in tree:
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
                meant = nearest(name, known)
                self._row("unknown" if meant else "ignored", name, value, note=meant or "nothing names it")
        return values

    def _recovery_names(self, tree: Mapping[str, Any]) -> list[str]:
        listed = tree.get("recovery_behaviors", ())
        usual = ["conservative_reset", "aggressive_reset", "rotate_recovery"]
        return usual + [str(one.get("name")) for one in listed if isinstance(one, dict)]

    def _recoveries(self, tree: Mapping[str, Any]) -> tuple[dict[str, Any], ...]:
        found = []
        listed = tree["recovery_behaviors"]
        if not isinstance(listed, list) or not all(isinstance(b, dict) and {"name", "type"} <= set(b) for b in listed):
            raise ClearwayError(
                f"is {shown(listed)}; a list of behaviours, each with name and type, is read",
                file=self._place,
                field="recovery_behaviors",
            )
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

    def _global_planner(self, move_base: Mapping[str, Any]) -> dict[str, Any]:
        plugin = move_base.get("base_global_planner", "navfn/NavfnROS")
        own, other = ("NavfnROS", "GlobalPlanner") if plugin == "navfn/NavfnROS" else ("GlobalPlanner", "NavfnROS")
        few = [n for n in GlobalPlannerGroup.model_fields if n not in ("allow_unknown", "default_tolerance")]
        for name, value in _table(self._tree, other).items():
            self._row("ignored", f"{other}.{name}", value, note=f"base_global_planner is {plugin}")
        return self._take(
            _table(self._tree, own), GlobalPlannerGroup, own, names.GLOBAL_PLANNER, but=few if own == "NavfnROS" else ()
        )

    def _costmap(self, space: Mapping[str, Any], where: str) -> dict[str, Any]:
        """A costmap and its layers."""
        old = "plugins" not in space
        layers = _old_layers(space) if old else _layers(space["plugins"], self._place, f"{where}.plugins")
        ignored = names.COSTMAP | {"plugins": "see its layers below"}
        moved = set(_MOVED) | set(str(space.get("observation_sources", "")).split()) if old else set(_SEARCHED)
        own = {
            n: v for n, v in space.items() if n not in (*moved, "footprint", "robot_radius", "global_frame", *layers)
        }
        values = self._take(own, Costmap, where, ignored, but=_OURS["costmap"])
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
            elif part == "static_layer":
                values[part] = self._take(table, StaticLayer, at, names.LAYER)
            elif part == "inflation_layer":
                table = {**({n: space[n] for n in _INFLATION if n in space} if old else {}), **table}
                values[part] = self._take(table, InflationLayer, at, names.LAYER)
            else:
                values[part] = self._obstacles(space, table, name, at, old)
        for name, value in space.items():
            if isinstance(value, dict) and name not in layers and name not in moved:
                note = nearest(name, layers)
                self._row(
                    "unknown" if note else "ignored",
                    f"{where}.{name}",
                    value,
                    note=note or "it stands in no list of layers or sources",
                )
        return values

    def _outline(self, space: Mapping[str, Any], where: str) -> dict[str, Any]:
        """The footprint, which a radius gives way to; its vertices counter-clockwise."""
        footprint = space.get("footprint")
        given: dict[str, Any] = {}
        if footprint not in (None, "", "[]", []):
            points = _points(footprint)
            if points is None:
                self.problems.append(
                    ClearwayError(
                        f"{shown(footprint)} is no outline; three points or more, as [[0.3, 0.2], [0.3, -0.2], [-0.3, -0.2]]",
                        file=self._place,
                        field=f"{where}.footprint",
                    )
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

    def _obstacles(
        self, costmap: Mapping[str, Any], layer: Mapping[str, Any], name: str, where: str, old: bool
    ) -> dict[str, Any] | None:
        """An obstacle layer; its sensors that are lidars are all the robot's."""
        if old:
            layer = {**{n: costmap[n] for n in _OBSTACLES if n in costmap}, **layer}
        listed = str(layer.get("observation_sources", "")).split()
        sources = {s: _table(layer, s) or (_table(costmap, s) if old else {}) for s in listed}
        for source, table in sources.items():
            seen = "marking", "clearing", "inf_is_valid", "observation_persistence", *_SEARCHED
            known = {n: v for n, v in table.items() if n in seen}
            self._take(known, ObstacleLayer, f"{where}.{source}", {})
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
                    self._row("unknown", f"{where}.{source}.{n}", value, note=nearest(n, [*seen, *names.SOURCE]))
        own = {n: v for n, v in layer.items() if n not in (*sources, "observation_sources")}
        sensors = ("name", "marking", "clearing", "inf_is_valid", "observation_persistence")
        values = self._take(own, ObstacleLayer, where, names.LAYER, but=sensors)
        self._row("read", f"{where}.observation_sources", " ".join(listed))
        lidars = {s: t for s, t in sources.items() if t.get("data_type", "PointCloud") == "LaserScan"}
        marking = [t for t in lidars.values() if t.get("marking", True)]
        clearing = [t for t in lidars.values() if t.get("clearing", False)]
        first = (marking or clearing or [{}])[0]
        values |= {"name": name, "marking": bool(marking), "clearing": bool(clearing)}
        for field, usual in (("obstacle_range", marking), ("raytrace_range", clearing)):
            for space in (*usual[:1], layer, costmap, self._tree):
                if field in space:
                    values[field] = space[field]
                    if space is costmap and not old:
                        self._row("read", f"{where.rpartition('.')[0]}.{field}", space[field])
                    break
        values |= {n: first[n] for n in ("inf_is_valid", "observation_persistence") if n in first}
        return values


_SEARCHED = ("obstacle_range", "raytrace_range")
_OBSTACLES = (*_SEARCHED, "observation_sources", "max_obstacle_height")
_INFLATION = ("inflation_radius", "cost_scaling_factor")
_MOVED = (*_OBSTACLES, *_INFLATION)
"""What a costmap without a list of layers has for them."""


def _old_layers(space: Mapping[str, Any]) -> dict[str, str]:
    static = {"static_layer": "costmap_2d::StaticLayer"} if space.get("static_map") is True else {}
    kind = "costmap_2d::VoxelLayer" if space.get("map_type") == "voxel" else "costmap_2d::ObstacleLayer"
    return {**static, "obstacle_layer": kind, "inflation_layer": "costmap_2d::InflationLayer"}


def _layers(plugins: Any, place: str | Path, field: str) -> dict[str, str]:
    if not isinstance(plugins, list) or not all(isinstance(p, dict) and {"name", "type"} <= set(p) for p in plugins):
        raise ClearwayError(
            f"is {shown(plugins)}; a list of layers, each with name and type, is read", file=place, field=field
        )
    found: dict[str, str] = {}
    for plugin in plugins:
        name = str(plugin["name"])
        if name in found:
            raise ClearwayError(f"has the layer {name!r} twice", file=place, field=field)
        found[name] = str(plugin["type"])
    return found


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
