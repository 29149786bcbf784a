"""What a kernel is given again and again, handed over once.

Whenever Python calls a kernel, each array that it passes is taken apart anew, and those in a NamedTuple at three times
the price: some 0.4 us each. What stays the same for a whole trial is therefore held where kernels find it at once:

    @kernel
    def hold(setting: Setting) -> Held[Setting]:  # beside `Setting`: a cached kernel must know the types it is cached for
        return Held(setting)

    @kernel
    def tick(state: FloatArray, held: Held[Setting]) -> None:
        setting = held.value

    held = hold(Setting(...))  # once
    tick(state, held)  # at each period: as cheap as one array

Arrays are held, not copied: what either side writes into them the other sees.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Generic, TypeVar

from numba.core import types
from numba.experimental import structref

T = TypeVar("T")

if TYPE_CHECKING:

    class Held(Generic[T]):
        """A value for kernels, which read it as `value`."""

        def __init__(self, value: T) -> None: ...

        value: T
else:

    @structref.register
    class HeldType(types.StructRef):
        """Numba's type of a `Held`; one for each type of value."""

    class Held(structref.StructRefProxy):
        """A value for kernels, which read it as `value`."""

        _numba_type_ = structref.StructRefProxy._type  # asked for at every call: a slot answers faster than a property

        def __class_getitem__(cls, _):
            return cls

    structref.define_proxy(Held, HeldType, ["value"])
