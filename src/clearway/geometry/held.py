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

Arrays are held, not copied: what either side writes into them the other sees. A kernel that takes `held.value` counts each of them up and
down again; one that hands `held` on to a light one, which takes it there, counts `held` alone.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Generic, TypeVar

from numba.core import cgutils, types
from numba.core.imputils import impl_ret_borrowed, lower_getattr
from numba.core.pythonapi import NativeValue, _unboxers
from numba.core.runtime.nrtdynmod import _meminfo_struct_type
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

    @lower_getattr(HeldType, "value")
    def _value(context, builder, held_type, held):
        """What is held, as a structref answers it, but in a light kernel too: there nothing is counted, and Numba refuses to look."""
        header = cgutils.create_struct_proxy(held_type)(context, builder, value=held).meminfo
        start = builder.load(cgutils.gep(builder, builder.bitcast(header, _meminfo_struct_type.as_pointer()), 0, 3))
        of = held_type.get_data_type()
        place = builder.bitcast(start, context.data_model_manager[of].get_value_type().as_pointer())
        found = cgutils.create_struct_proxy(of)(context, builder, ref=place).value
        return impl_ret_borrowed(context, builder, held_type.field_dict["value"], found)

    _counting = _unboxers.lookup(HeldType)

    def _from_python(held_type, given, c):
        """As a structref is taken from Python, but for a light kernel not at all: it would never be let go again."""
        if c.context.enable_nrt:
            return _counting(held_type, given, c)
        c.pyapi.err_set_string("PyExc_TypeError", "what is held goes to a kernel; that one may hand it to a light one")
        return NativeValue(c.context.get_constant_null(held_type), is_error=cgutils.true_bit)

    _unboxers.functions[HeldType] = _from_python
