"""The bounded reader: what no file may hold, however it is written."""

import os
import time
from pathlib import Path

import numpy as np
import pytest

from clearway.errors import LONGEST, ClearwayError, shown
from clearway.reading import limits, parse_toml, read_bytes, read_json, read_pgm, read_toml, read_yaml


def refused(read: object, file: Path, text: str | bytes) -> str:
    """What `read` says of a file with this text, within a second or two."""
    file.write_bytes(text.encode() if isinstance(text, str) else text)
    began = time.process_time()
    with pytest.raises(ClearwayError) as told:
        read(file)  # type: ignore[operator]
    assert time.process_time() - began < 5
    assert len(str(told.value)) < 1000
    assert told.value.file == str(file)
    return told.value.problem


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (f"x = {'[' * 100_000}", "nested deeper than 32"),
        (f"x = {'{a=' * 1000}1{'}' * 1000}", "nested deeper than 32"),
        (f"x{'.a' * 100_000} = 1", "nested deeper than 32"),
        (f"[x{' . a' * 40}]", "nested deeper than 32"),
        ("".join(f"[[x{'.a' * k}]]\n" for k in range(40)), "nested deeper than 32"),
        (f"x = {'9' * 5000}", "line 1: a number or key has at most 100 characters; this one has 5,000"),
        (f"\nx = 0x{'f' * 200}", "line 2: a number or key"),
        ("x = 99999999999999999999", "between -2^63 and 2^63 - 1"),
        ("x = 2021-02-30", "not a TOML file: Invalid date"),
        (f"x = [{'0,' * 300_000}]", "more than 250,000 entries"),
        ("#" * (limits.TOML + 1), "larger than the 2 MB"),
        (b'x = "\xff"', "it is not UTF-8 at byte 5"),
        ('x = "\\u0000"', "a text cannot hold NUL"),
        (f'x = "{"y" * 20_000}"', "a text has at most 10,000 characters; this one has 20,000"),
        ('x = """' + '\\"""' * 100_000, "not a TOML file: Unterminated string"),
    ],
)
def test_toml_beyond_what_is_read(tmp_path: Path, text: str | bytes, said: str) -> None:
    assert said in refused(read_toml, tmp_path / "x.toml", text)


def test_toml_that_only_looks_like_it() -> None:
    """Brackets, dots and digits within texts and comments count for nothing."""
    deep = "[" * 100 + "{." * 100 + "1" * 500
    text = f"""x = "{deep}" # {deep}
y = '{deep}'
z = \"\"\"{deep}
{deep}" ""\\" \"\"\"
w = ['''{deep}''']
v = "a \\" {deep}"
"""
    assert parse_toml(text)["w"] == [deep]


def test_toml_in_a_file_as_windows_writes_it(tmp_path: Path) -> None:
    (tmp_path / "x.toml").write_bytes("\ufeffx = 1\r\n".encode())
    assert read_toml(tmp_path / "x.toml") == {"x": 1}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("a: &a [1]\nb: *a\n", "line 1: anchors (&) and aliases (*) are not read"),
        ("b: *a\n", "line 1: anchors"),
        ("x: " + "[" * 20_000, "nested deeper than 32"),
        ("- " * 5_000 + "1", "nested deeper than 32"),
        ("x: " + "9" * 5000, "not a YAML file"),
        ("x: 0x" + "f" * 100, "between -2^63 and 2^63 - 1"),
        ("x: 2021-02-30", "not a YAML file: day is out of range"),
        ("x: !!python/object/apply:os.system ['true']", "not a YAML file"),
        ("x: 1\ny: 2\nx: 3\n", "line 1: the key 'x' stands twice"),
        ("#" * (limits.YAML + 1), "larger than the 64 kB"),
        ("x: " + "y" * 20_000, "a text has at most 10,000 characters"),
        ("x: !!timestamp z", "not a YAML file"),
        ("x: !!int z", "not a YAML file"),
        ("x: !!bool z", "not a YAML file"),
        ("x: 1" + ":59" * 9_000, "between -2^63 and 2^63 - 1"),
    ],
)
def test_yaml_beyond_what_is_read(tmp_path: Path, text: str, said: str) -> None:
    assert said in refused(read_yaml, tmp_path / "x.yaml", text)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[" * 100_000, "nested deeper than 32"),
        ("[" * 40 + "]" * 40, "nested deeper than 32"),
        ("9" * 5000, "is not JSON"),
        ("99999999999999999999", "between -2^63 and 2^63 - 1"),
        (f"[{'0,' * 2_000_001}0]", "more than 2,000,000 entries"),
        (
            f'"{"x" * (limits.JSON // 4)}\U0001f600"',
            "larger than the 24 MB that are read of such a file with characters beyond",
        ),
        ("{", "is not JSON"),
        (b'"\xff"', "is not JSON"),
    ],
)
def test_json_beyond_what_is_read(tmp_path: Path, text: str | bytes, said: str) -> None:
    assert said in refused(read_json, tmp_path / "x.json", text)


@pytest.mark.parametrize(
    ("image", "said"),
    [
        (b"P5" + b"#\n" * 18, "its size and maximum can't be read"),
        (b"P5" + b" # x\n \n" * 9_000 + b"y", "its size and maximum can't be read"),
        (b"P5\n" + b"9" * 5000 + b" 4\n255\n", "its size and maximum can't be read"),
        (b"P5\n100000 100000\n255\n", "100000 x 100000 pixels; at most 16,000,000"),
        (b"P5\n0 4\n255\n", "size 0 x 4"),
        (b"P5\n4 4\n70000\n", "maximum 70000"),
        (b"P5\n4 4\n255\n" + b"\0" * 15, "cut short: 15 of 16"),
        (b"P5\n4 4\n255 # no line's end", "cut short: 0 of 16"),
        (b"P2\n2 2\n255\n1 2 3", "cut short: 3 of 4"),
        (b"P2\n2 2\n255\n1 2 x 4", "isn't a number"),
        (b"P2\n2 2\n255\n1 2 \xb2 4", "isn't a number"),
        (b"P2\n2 2\n255\n1 2 999999 4", "more than five digits"),
        (b"P2\n2 2\n65535\n1 2 70000 4", "above 65535"),
        (b"P2\n2 2\n100\n1 2 101 4", "a pixel is 101, above the maximum 100"),
        (b"P2\n2 2\n255\n#" + b"x" * 100_000, "more than 8 bytes for a pixel"),
    ],
)
def test_images_beyond_what_is_read(tmp_path: Path, image: bytes, said: str) -> None:
    assert said in refused(read_pgm, tmp_path / "x.pgm", image)


def test_plain_and_raw_images_are_the_same(tmp_path: Path) -> None:
    pixels = np.random.default_rng(1).integers(0, 65536, (7, 11), dtype=np.uint16)
    (tmp_path / "raw.pgm").write_bytes(b"P5\n#c\n11 7\n65535\n" + pixels.astype(">u2").tobytes())
    rows = "\n".join(" ".join(map(str, row)) for row in pixels.tolist())
    (tmp_path / "plain.pgm").write_text(f"P2 11\t7 # c 9\n\n65535\n{rows} # the end 3")
    for name in ("raw", "plain"):
        assert (read_pgm(tmp_path / f"{name}.pgm").pixels == pixels).all()


def test_only_regular_files_are_read(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    (tmp_path / "zero").symlink_to("/dev/zero")
    for name, said in {
        "pipe": "is a pipe, not a file",
        ".": "is a directory, not a file",
        "zero": "is a device, not a file",
        "loop": "cannot be read",
        "none": "no such file",
        "x\0y": "no file's name has such characters",
        "x" * 5000: "cannot be read: File name too long",
        "x/" * 3000: "cannot be read: File name too long",
    }.items():
        with pytest.raises(ClearwayError, match=said):
            read_bytes(tmp_path / name, 10)


def test_a_message_shows_little_of_a_large_value() -> None:
    deep: list[object] = []
    for _ in range(100_000):
        deep = [deep]
    for value in ("x" * 10**7, list(range(10**6)), deep, dict.fromkeys(range(1000), "y" * 10000), 10**4000):
        assert len(shown(value)) < 3000
    assert shown({"kind": "square", "edge": 0.3}) == "{'kind': 'square', 'edge': 0.3}"
    told = str(ClearwayError("x" * 10**6 + "\x1b[31m\0", file="y" * 10**6, field="z" * 10**6))
    assert len(told) < 2 * LONGEST
    assert told.isprintable()
    assert str(ClearwayError("no such file", file="a\nb", field="c\nd")) == r"a\nb: c\nd: no such file"
