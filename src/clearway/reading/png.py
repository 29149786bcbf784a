"""PNG images within bounds: the header says how many pixels there are before any is unpacked."""

from __future__ import annotations

import io
import warnings
from pathlib import Path

import numpy as np

from clearway.errors import ClearwayError
from clearway.foreign import said
from clearway.reading.bounded import read_bytes
from clearway.reading.limits import CELLS
from clearway.reading.pgm import Image

_MAGIC = b"\x89PNG\r\n\x1a\n"
_MOST_BYTES = 4 * CELLS + (1 << 20)
"""Of the file: four bytes a pixel, not packed at all, and some for the rest."""


def read_png(path: str | Path) -> Image:
    """A PNG image as grey values; of colours the mean of red, green and blue, as `map_server` takes it, whatever their opacity.

    Raises:
        ClearwayError: It isn't a PNG, is damaged, or has more pixels than a grid may have cells.
    """
    import PIL.Image

    path = Path(path)
    raw = read_bytes(path, _MOST_BYTES)
    if not raw.startswith(_MAGIC):
        raise ClearwayError("isn't a PNG image", file=path)
    cols, rows = int.from_bytes(raw[16:20], "big"), int.from_bytes(raw[20:24], "big")
    if not 0 < rows * cols <= CELLS:
        raise ClearwayError(f"has {cols} x {rows} pixels; at most {CELLS:,} are read", file=path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of bombs: it is no larger than that
            with PIL.Image.open(io.BytesIO(raw), formats=["PNG"]) as image:
                if image.mode.startswith("I"):  # 16 bits
                    return Image(np.asarray(image).astype(np.uint16), 65535)
                colours = np.asarray(image.convert("RGB"), dtype=np.uint16)
    except Exception as error:  # whatever the decoder makes of damage
        raise ClearwayError(f"is damaged: {said(error)}", file=path) from error
    return Image((colours.sum(axis=2) // 3).astype(np.uint8), 255)
