"""Run a part of the hospital protocol from Python, look at the trials, draw a figure."""

import clearway

results = clearway.run(
    "hospital",
    robots=["tiago"],
    navigators=["move-base"],
    batches=["NO", "CE"],
    speeds=[0.6],
    repetitions=1,
    out="tiago",
)
trials = results.trials  # an Arrow table; .to_pandas() or polars.from_arrow() in one call
for row in trials.select(["batch", "size", "success", "CT", "MDO"]).to_pylist():
    print(row)
results.figure("trajectories", batch="CE").savefig("trajectories.svg")
print("report:", results.report())
