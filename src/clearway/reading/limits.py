"""How much of anything is taken from outside, each with its reason. `docs/limits.md` shows them to users.

They are there for the machine, not for taste: whatever keeps them is read and checked in seconds and within 1 GB. Each
leaves an honest user ten times what any use that we know has needed.
"""

TOML = 2 << 20
"""Bytes of a TOML file. Paper A's whole protocol for a robot, 336 trials, is a test plan of 0.17 MB; 2 MB take Python's
parser 2 to 5 s."""
YAML = 64 << 10
"""Bytes of a ROS map's yaml, which has seven lines; PyYAML reads 30 kB/s at worst."""
BAG_METADATA = 256 << 10
"""Bytes of a ROS 2 bag's metadata.yaml; a topic takes about 0.5 kB."""
ROS_PARAMETERS = 128 << 10
"""Bytes of a file of ROS parameters; Nav2's own, which has every server, has 15 kB."""
TREE_NODES = 10_000
"""Nodes of a behaviour tree whose subtrees are written out; the largest that ships with Nav2 has 49."""
JSON = 96 << 20
"""Bytes of a results directory's campaign.json, which has a line of 85 bytes for each scenario and robot; a million have 85 MB."""
JSON_ENTRIES = 2_000_000
"""Values in it, as many commas and brackets as it has."""
NESTING = 32
"""Tables and arrays within each other, by brackets or by dots; nothing of ours has more than eight."""
ENTRIES = 250_000
"""Keys and values of a file. A floor plan of 5,000 walls has 40,000."""
WORD = 100
"""Characters of a number or of a key without quotes; a float64 has no more than 24."""
LONGEST_NAME = 1000
"""Characters of a navigator's name with its options, which stands in every row."""
TEXT = 10_000
"""Characters of a text: a page or two, for a name or a note."""
WHOLE = 2**63
"""Beyond every whole number, as TOML itself has it; no less than minus this."""

CELLS = 16_000_000
"""Cells of a grid: 200 m x 200 m at 0.05 m. Checking whether a robot fits through takes 50 bytes and 0.3 us each."""
PGM_HEADER = 64 << 10
"""Bytes before a PGM's pixels; comments stand there."""
PLAIN_CELL = 8
"""Bytes that a plain PGM (P2) may take for a cell: five digits, a blank, and some for comments."""

COORDINATE = 1e7
"""Metres from the origin: the northings of UTM end there."""
TURN = 6.284
"""Radians either way of an angle: a full turn, rounded up. What is beyond was meant in degrees."""
ANGLE = 1e4
"""rad/s either way of a yaw rate, and of a standard deviation, rad."""
LENGTH = 1e4
"""Metres of a thing, from edge to edge or from end to end."""
SHORTEST = 1e-4
"""Metres of a thing, at least: a tenth of a millimetre."""
SPEED = 100.0
"""m/s; no robot among people comes near."""
SECONDS = 86_400.0
"""A day: of a leg, a delay, a decision."""
NUMBER = 1e12
"""Any other number, either way; dates in seconds have 1.8e9."""

VERTICES = 500
"""Of a polygon. Whether it crosses itself is found edge by edge: 0.1 s for so many."""
CORNERS = 40_000
"""Of all that stands in a floor plan, together; drawing it takes 30 us each."""
FIXTURES = 5_000
"""Walls and pieces of furniture of a floor plan; the ward has 97."""
RECTANGLES = 50_000
"""Of the occupied cells of a map that serves as a floor plan. A map that a robot built of a hospital has 2,000."""
OBSTACLES = 1_000
"""Of a scenario."""
PEOPLE = 500
"""Of a scenario."""
ROBOTS = 100
"""Of a scenario, beside its own; each has a lidar to cast and a navigator to ask."""
STOPS = 100
"""Of a person's route."""
LEGS = 1_000
"""Of a scenario or of a recorded trial."""
POINTS = 10_000
"""Way points of a path; rows of a recorded person's track."""
TRACK = 10 << 20
"""Bytes of a CSV file with such a track; a row of the three columns that count has 30."""
ROW = 10_000
"""Characters of a row of it."""
SAMPLES = 200_000
"""Of all tracks that a scenario or a suite names, together: 50 people for two minutes and a half at 25 Hz. Reading and checking them takes 4 us each."""
RUNS = 1_000
"""Passes of a moving obstacle."""
COMPARISONS = 50_000_000
"""Places of moving obstacles times what stands near their way, in a check: 50 ns each."""
DRAWN = 500_000_000
"""Cells that the things in a plan cover, each counted as its bounding box: 5 ns each."""
SCENARIOS = 10_000
"""Of a suite's file, with those in files that it names."""
ROUTE_NODES = 10_000
"""Of a graph of routes; those that ship with Nav2 have up to 40."""
ROUTE_EDGES = 50_000
"""Of it; read in 3 s, and a search looks at each once, in some 10 us."""
PRESETS = 100
"""Of a robot."""
TRIALS = 1_000_000
"""Of a campaign: the results directory is made for so many."""
