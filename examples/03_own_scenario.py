"""How narrow a passage does the robot take? A suite written as TOML by a few lines of Python, run and read.

The same fields, written by hand and explained: my_corridor.toml and my_suite.toml.
"""

from pathlib import Path

import clearway

LENGTH, FREE = 0.5, (-1.2, 1.2)  # of the two cupboards along the ward's corridor, and its free width there, m


def passage(gap: float) -> str:
    """One scenario: through a gap [m] between two cupboards and back."""
    width = (FREE[1] - FREE[0] - gap) / 2 - 0.02
    shape = f"{{ kind = 'rectangle', length = {LENGTH}, width = {width} }}"
    return f"""
[[scenario]]
name = "gap {gap} m"
floor_plan = "ward"
start = [5.5, 0.0, 0.0]
speed = 0.6
legs = [
  {{ name = "forth", goal = [10.4, 0.0, 0.0], time_limit = 60.0 }},
  {{ name = "back", goal = [5.5, 0.0, 3.14159265], time_limit = 60.0 }},
]
obstacles = [
  {{ name = "left cupboard", shape = {shape}, pose = [7.7, {(gap + width) / 2}, 0.0] }},
  {{ name = "right cupboard", shape = {shape}, pose = [7.7, {-(gap + width) / 2}, 0.0] }},
]
"""


suite = Path("passages.toml")
suite.write_text("name = 'passages'\nrepetitions = 2\n" + "".join(passage(gap) for gap in (0.7, 0.9, 1.2)))
results = clearway.run(str(suite), robots=["tiago"], out="passages")
for row in results.trials.select(["scenario", "outcome", "CT", "MDO"]).to_pylist():
    print(row)
