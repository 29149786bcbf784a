"""Ground floor: shapes, distances, ray casting, grids, motion, search. Its kernels run only where Numba compiles them."""

import os

from clearway.errors import ClearwayError
from clearway.geometry.cache_place import settle_cache

if os.environ.get("NUMBA_DISABLE_JIT", "0") not in ("", "0"):
    raise ClearwayError(
        "NUMBA_DISABLE_JIT is set, and Clearway's kernels run only where Numba compiles them; unset it, and debug a "
        "navigator with --workers 0"
    )

settle_cache()
