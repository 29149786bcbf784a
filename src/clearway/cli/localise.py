"""`clearway localise`: where a recorded robot was, from its own scans and odometry on a map."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from clearway.cli._options import Json, RobotName, numbers, tell


def localise(
    recording: Annotated[Path, typer.Argument(help="A bag with scans and odometry.", show_default=False)],
    map_: Annotated[
        str,
        typer.Option("--map", help="A floor plan: a shipped name or a file; or a ROS map's yaml.", show_default=False),
    ],
    start: Annotated[
        str,
        typer.Option(
            help="Where the robot was at the beginning, in the map: X,Y,THETA in m and rad, or 90deg.",
            show_default=False,
        ),
    ],
    robot: RobotName = "tiago",
    out: Annotated[
        Path | None, typer.Option(help="The table; default: RECORDING.localised.csv.", show_default=False)
    ] = None,
    within: Annotated[str, typer.Option(help="Standard uncertainty of the start: m,rad.")] = "0.5,0.26",
    scan: Annotated[str | None, typer.Option(help="Topic of the scans; default: the only one.")] = None,
    odometry: Annotated[
        str | None, typer.Option(help="Topic of the odometry, or odom->base_link; default: the only one.")
    ] = None,
    mount: Annotated[
        str | None, typer.Option(help="Where the lidar sits on the robot: X,Y,THETA; default: as /tf_static says.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, max=2**63 - 1, help="Of the filters' random numbers.")] = 0,
    as_json: Json = False,
) -> None:
    """Localise a recorded robot on a map (AMCL, forth and back), for a test without motion capture.

    Writes its poses with their uncertainty as a table that a test plan can name. Overwrites nothing.
    """
    import numpy as np

    from clearway.localising import localise_recording

    target = recording.with_name(recording.name + ".localised.csv") if out is None else out
    x, y, theta = numbers(start, "--start", (3,), angle=2)
    at = None if mount is None else numbers(mount, "--mount", (3,), angle=2)
    far, turned = numbers(within, "--within", (2,), angle=1)
    found = localise_recording(
        recording,
        map_,
        robot,
        (x, y, theta),
        target,
        scan=scan,
        odometry=odometry,
        mount=None if at is None else (at[0], at[1], at[2]),
        within=(far, turned),
        seed=seed,
    )
    known = np.isfinite(found.sigma[:, 0])
    middle, worst = (f(found.sigma[known], axis=0).tolist() if known.any() else [] for f in (np.median, np.max))
    if as_json:
        said = {"table": str(target), "updates": len(found.updates), "sigma": middle, "largest_sigma": worst}
        tell(said | {"agreement": float(np.median(found.agreement)), "notes": found.notes}, indent=2)
        return
    typer.echo("\n".join(found.notes))
    if known.any():
        typer.echo(
            f"standard uncertainty: {1000 * middle[0]:.0f} mm and {1000 * middle[1]:.0f} mrad (median), at most {1000 * worst[0]:.0f} mm"
            f" and {1000 * worst[1]:.0f} mrad"
        )
    typer.echo(f'{target}: name it in the test plan, with frame = {{ same = true }} and [robot] track = "robot"')
