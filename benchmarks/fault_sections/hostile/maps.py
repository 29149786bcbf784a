"""Hostile maps and their images."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

from fault_sections.hostile.good import MAP, REFUSED, TAKEN, map_of


def hostile_maps() -> Iterator[tuple[str, Callable[[Path], list[str]], tuple[int, ...]]]:
    bomb = "a: &a [x,x,x,x,x,x,x,x,x]\n" + "".join(
        f"{chr(98 + k)}: &{chr(98 + k)} [{','.join(['*' + chr(97 + k)] * 9)}]\n" for k in range(12)
    )
    for name, text in (
        ("anchors in anchors", bomb + MAP),
        ("anchors in anchors as origin", bomb + MAP.replace("[0.0, 0.0, 0.0]", "*m")),
        ("anchors in anchors as resolution", bomb + MAP.replace("resolution: 0.05", "resolution: *m")),
        ("anchors in anchors as image", bomb + MAP.replace("map.pgm", "*m")),
        ("anchors in anchors as mode", bomb + MAP + "mode: *m\n"),
        ("an anchor within itself", "a: &a [*a]\n" + MAP + "mode: *a\n"),
        ("merged maps", "a: &a {x: 1}\n<<: *a\n" + MAP),
        ("nested arrays", f"x: {'[' * 50_000}\n{MAP}"),
        ("closed nested arrays", f"x: {'[' * 5_000}{']' * 5_000}\n{MAP}"),
        ("nested maps", f"x: {'{a: ' * 5_000}1{'}' * 5_000}\n{MAP}"),
        ("nested blocks", "".join(f"{' ' * k}a:\n" for k in range(1000)) + " " * 1000 + "1\n"),
        ("nested lists in blocks", "- " * 20_000 + "1"),
        ("100 MB", MAP + "#" + "x" * 100_000_000),
        ("300,000 entries", MAP + "x: [" + "0," * 300_000 + "]\n"),
        ("20,000 entries in a flow", MAP + "x: {" + "".join(f"a{k}: 0, " for k in range(20_000)) + "}\n"),
        ("a text of 1 MB as mode", MAP + f'mode: "{"x" * 1_000_000}"\n'),
        ("a text of 1 MB as resolution", MAP.replace("0.05", f'"{"x" * 1_000_000}"')),
        ("an origin of 100,000 numbers", MAP.replace("[0.0, 0.0, 0.0]", f"[{'0,' * 100_000}0]")),
        ("a number of 5,000 digits", MAP.replace("0.05", "9" * 5000)),
        ("a number of 4,000 digits", MAP.replace("0.05", "9" * 4000)),
        ("a hexadecimal number of 50,000 digits", MAP.replace("0.05", "0x" + "f" * 50_000)),
        ("a number of base 60 without an end", MAP.replace("0.05", "1" + ":59" * 20_000)),
        ("an impossible date", MAP.replace("0.05", "2021-02-30")),
        ("a Python object", MAP + "mode: !!python/object/apply:os.system ['true']\n"),
        ("a set", MAP + "mode: !!set {a, b}\n"),
        ("binary", MAP + "mode: !!binary AAAA\n"),
        ("a broken tag", MAP + "mode: !<tag:x,2000:y> z\n"),
        ("a directive", "%YAML 9.9\n---\n" + MAP),
        ("two documents", MAP + "---\n" + MAP),
        ("NUL", MAP + "mode: '\0'\n"),
        ("control characters", MAP + "mode: '\x1b[31m'\n"),
        ("true as resolution", MAP.replace("0.05", "true")),
        ("nan as resolution", MAP.replace("0.05", ".nan")),
        ("10^-300 as resolution", MAP.replace("0.05", "1e-300")),
        ("10^300 as resolution", MAP.replace("0.05", "1.0e+300")),
        ("10^300 as origin", MAP.replace("[0.0, 0.0", "[1.0e+300, 0.0")),
        ("a list as key", MAP + "? [a, b]\n: 1\n"),
        ("a list instead of a table", "- 1\n- 2\n"),
        ("nothing", ""),
        ("its own yaml as image", MAP.replace("map.pgm", "map.yaml")),
        ("a folder as image", MAP.replace("map.pgm", ".")),
        ("a name of 5,000 letters as image", MAP.replace("map.pgm", "x" * 5000)),
        ("a name with NUL as image", MAP.replace("map.pgm", '"x\\0y"')),
        ("a number as image", MAP.replace("map.pgm", "7")),
        ("tabs", MAP.replace(": ", ":\t\t")),
        ("a quoted text without an end", MAP + 'mode: "' + "\\" * 100_001),
        ("a billion blanks of indentation", "x:\n" + " " * 3_000_000 + "y"),
    ):
        yield name, map_of(text), TAKEN if name in ("tabs", "a billion blanks of indentation") else REFUSED
    for name, image in (
        ("38 bytes of comments", b"P5" + b"#\n" * 18),
        ("1 MB of blanks", b"P5" + b" \n" * 500_000),
        ("1 MB of comments", b"P5" + b"#\n" * 500_000 + b"4"),
        ("comments and blanks in turn", b"P5 " + b" # \n \n" * 30_000 + b"x"),
        ("10^9 cells", b"P5\n100000 100000\n255\n" + b"\xfe" * 100),
        ("10^18 cells", b"P5\n1000000000 1000000000\n255\n"),
        ("5,000 digits", b"P5\n" + b"9" * 5000 + b" 4\n255\n"),
        ("no cells", b"P5\n0 0\n255\n"),
        ("a maximum of 0", b"P5\n4 4\n0\n" + b"\0" * 16),
        ("a maximum of 10^9", b"P5\n4 4\n1000000000\n" + b"\0" * 16),
        ("negative size", b"P5\n-4 -4\n255\n" + b"\0" * 16),
        ("another kind of image", b"P6\n4 4\n255\n" + b"\0" * 48),
        ("cut short", b"P5\n4 4\n255\n" + b"\0" * 15),
        ("a header only", b"P5"),
        ("nothing", b""),
        ("plain, 10^9 cells", b"P2\n100000 100000\n255\n" + b"0 " * 100),
        ("plain, words of 10,000 digits", b"P2\n2 2\n255\n" + (b"9" * 10_000 + b" ") * 4),
        ("plain, words that are none", b"P2\n2 2\n255\n1 x 3 4"),
        ("plain, 1 MB of hashes", b"P2\n2 2\n255\n" + b"#" * 1_000_000),
        ("plain, superscripts", b"P2\n2 2\n255\n\xb2 1 1 1"),
        ("a row of 10^6 cells, each second a wall", b"P5\n1000000 1\n255\n" + b"\x00\xfe" * 500_000),
        ("a board of 10^6 cells", b"P5\n1000 1000\n255\n" + (b"\x00\xfe" * 500 + b"\xfe\x00" * 500) * 500),
        ("16 bit, above its maximum", b"P5\n2 2\n300\n" + b"\xff" * 8),
    ):
        yield name, map_of(MAP, image), REFUSED

    def huge(folder: Path) -> list[str]:
        (folder / "map.yaml").write_text(MAP)
        with open(folder / "map.pgm", "wb") as f:
            f.write(b"P5\n20000 20000\n255\n")
            f.truncate(400_000_000)
        return ["check", "map.yaml"]

    yield "an image of 400 MB", huge, REFUSED

    def largest(folder: Path) -> list[str]:
        (folder / "map.yaml").write_text(MAP)
        (folder / "map.pgm").write_bytes(b"P5\n3000 3000\n255\n" + b"\xfe" * 9_000_000)
        return ["check", "map.yaml"]

    yield "an honest image of 9 million cells", largest, (0,)

    def plain(folder: Path) -> list[str]:
        (folder / "map.yaml").write_text(MAP)
        (folder / "map.pgm").write_bytes(b"P2\n2000 2000\n255\n" + b"254 " * 4_000_000)
        return ["check", "map.yaml"]

    yield "an honest plain image of 4 million cells", plain, (0,)
