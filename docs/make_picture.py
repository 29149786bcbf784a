"""Draws the picture of the tutorial from the results of `make demo`.

python docs/make_picture.py [RESULTS]
"""

import sys
from pathlib import Path

import clearway

results = clearway.open_results(sys.argv[1] if len(sys.argv) > 1 else "results/demo")
picture = Path(__file__).parent / "images" / "trajectories.svg"
picture.parent.mkdir(exist_ok=True)
results.figure("trajectories", robot="tiago").savefig(picture, metadata={"Date": None})
print(picture)
