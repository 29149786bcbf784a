"""Compare two results test by test: TIAGo's two local planners among single obstacles."""

import clearway
from clearway.reports.text import comparison
from clearway.statistics import compare

part = {"batches": ["SO"], "configurations": ["single"], "speeds": [0.6], "sizes": [0.3, 0.6]}
dwa = clearway.run("hospital", robots=["tiago"], out="dwa", **part)
rollout = clearway.run("hospital", robots=["tiago:trajectory"], out="rollout", **part)

# Both met the same scenarios with the same seeds, so trials are paired. In the shell: clearway compare dwa rollout
found = compare(dwa.trials, rollout.trials, names=("DWA", "rollout"), indicators=["CT", "PL", "DE", "MDO"])
print(comparison(found))
for row in found.differences.to_pylist():  # an Arrow table with everything behind those lines
    if row["batch"] is None:
        print(
            row["indicator"], row["median_difference"], row["unit"], "smallest p that n can reach:", row["smallest_p"]
        )
