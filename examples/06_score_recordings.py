"""Score recordings of a robot by a test plan: motion capture, the robot's own log, an attempt that nobody recorded."""

import json
from pathlib import Path

import clearway

folder = Path(__file__).with_suffix("")  # recordings and plan.toml; make.py says how they were made
results = clearway.score(folder / "plan.toml", out="scored")
for row in results.trials.to_pylist():
    print(f"\ntrial {row['trial']}: {row['batch']} {row['configuration']}, {row['outcome']} {row['reason']}")
    for name, unit in {"CT": "s", "PL": "m", "DE": "m", "OE": "rad", "MDO": "m", "DE_self": "m"}.items():
        if row[name] is None:
            print(f"  {name:<8} not computable: {json.loads(row['not_computable'])[name]}")
        else:
            sure = row.get(f"{name}_U")
            print(f"  {name:<8} {row[name]:.3f} {unit}" + (f" ± {sure:.3f}" if sure is not None else ""))
    for event in results.trial(row["trial"]).events:
        print(f"  {event.t:.2f} s: {event.kind}: {event.detail}")
print("\nreport:", results.report())
