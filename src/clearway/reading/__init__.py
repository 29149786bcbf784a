"""Reads what users write and bring (TOML, YAML, JSON, PGM, PNG) within bounds: a file can't fill the memory, hang, or end in a
traceback. Whatever is wrong with it is one `ClearwayError`."""

from clearway.reading.bounded import is_there, opened, read_bytes, take
from clearway.reading.json_files import read_json
from clearway.reading.pgm import Image, read_pgm
from clearway.reading.png import read_png
from clearway.reading.toml_files import parse_toml, read_toml
from clearway.reading.yaml_files import read_ros_yaml, read_yaml, ros_word

__all__ = [
    "Image",
    "is_there",
    "opened",
    "parse_toml",
    "read_bytes",
    "read_json",
    "read_pgm",
    "read_png",
    "read_ros_yaml",
    "read_toml",
    "read_yaml",
    "ros_word",
    "take",
]
