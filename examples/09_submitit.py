"""A campaign in shards with submitit (pip install submitit): here as processes of this machine, on a cluster as SLURM jobs.

On a cluster take executor="slurm" and a folder that all nodes see; nothing else changes.
"""

import sys
from functools import partial
from pathlib import Path

import submitit

import clearway

SHARDS = 2


def run_shard(number: int, suite: Path, folder: Path) -> None:
    """One job of the array. `resume`: a job that was preempted goes on where it stopped."""
    clearway.run(
        str(suite), robots=["tiago"], navigators=["move-base"], shard=f"{number}/{SHARDS}", workers=1,
        out=folder / f"part-{number}", resume=True,
    )  # fmt: skip


def main(suite: Path, folder: Path, executor: str = "local") -> None:
    """Run every shard as a job of its own, and merge what they leave."""
    cluster = submitit.AutoExecutor(folder=folder / "logs", cluster=executor)
    cluster.update_parameters(timeout_min=60, cpus_per_task=1)
    numbers = range(1, SHARDS + 1)
    jobs = cluster.map_array(partial(run_shard, suite=suite, folder=folder), numbers)
    for job in jobs:
        job.result()  # raises what a job has raised
    whole = clearway.merge(*(folder / f"part-{number}" for number in numbers), out=folder / "whole")
    print(f"{len(whole)} trials in {whole.path}")


if __name__ == "__main__":
    where = Path(sys.argv[1] if len(sys.argv) > 1 else "results/submitit").absolute()
    main(Path(__file__).with_name("my_suite.toml"), where)
