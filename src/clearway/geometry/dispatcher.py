"""Machine code for what Python calls alone.

Of each function that it compiles, Numba makes machine code, with a copy of all that it calls, at any depth, and with a wrapper that takes
Python's arguments apart. But of some 300 kernels that a trial needs Python calls 30. So for other kernels a kernel is compiled to LLVM's
intermediate code only. That is optimised, and machine code made of it, once, as part of a kernel that Python calls.
"""

from __future__ import annotations

import copy
from typing import Any, cast

import llvmlite.binding as llvm
from numba.core import caching, codegen, compiler, types
from numba.core.dispatcher import _FunctionCompiler
from numba.core.lowering import Environment
from numba.core.registry import CPUDispatcher


class Kernel(CPUDispatcher):  # type: ignore[misc]
    """What Python calls.

    Attributes:
        called: What other kernels call.
    """

    def __init__(self, py_func: Any, locals: Any, targetoptions: Any) -> None:
        super().__init__(py_func, locals, targetoptions)
        self.called = _Called(py_func, locals, targetoptions)
        self._compiler = _ForPython(self.called)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """For kernels that call this one. With a literal they ask for the same code as with any other number."""
        number = cast(Any, types.unliteral)
        return self.called.get_call_template(tuple(map(number, args)), {name: number(a) for name, a in kws.items()})

    def get_overload(self, sig: Any) -> Any:
        """What `get_call_template` has found."""
        return self.called.get_overload(sig)

    @property
    def is_compiling(self) -> Any:
        """Whether it is being compiled for kernels, itself among them: by that Numba knows a recursion."""
        return self.called.is_compiling

    def enable_caching(self) -> None:
        """Keep both, each in files of its own."""
        super().enable_caching()
        self.called.enable_caching()


class _Called(CPUDispatcher):  # type: ignore[misc]
    """What other kernels call, as intermediate code."""

    def __init__(self, py_func: Any, locals: Any, targetoptions: Any) -> None:
        super().__init__(py_func, locals, targetoptions)
        self._compiler = _ForKernels(self)

    def add_overload(self, cres: Any) -> None:
        """Keep what is compiled; there is nothing that Python could call."""
        self.overloads[tuple(cres.signature.args)] = cres

    def enable_caching(self) -> None:
        """Keep it from process to process."""
        self._cache = _Cache(self.py_func)


class _Compiler(_FunctionCompiler):  # type: ignore[misc]
    def __init__(self, of: CPUDispatcher) -> None:
        super().__init__(of.py_func, of.targetdescr, of.targetoptions, of.locals, compiler.Compiler)

    def _flags(self) -> Any:
        flags = compiler.Flags()
        self.targetdescr.options.parse_as_flags(flags, self.targetoptions)
        return flags


class _ForKernels(_Compiler):
    def _compile_core(self, args: Any, return_type: Any) -> Any:
        flags, target = self._flags(), self.targetdescr.target_context
        flags.no_cpython_wrapper = flags.no_cfunc_wrapper = flags.no_compile = True
        library = _Intermediate(target.codegen(), self.py_func.__qualname__)
        result = compiler.compile_extra(
            self.targetdescr.typing_context, target, self.py_func, args, return_type, flags, self.locals, library=library
        )  # fmt: skip
        library.finalize()
        if isinstance(result.signature.return_type, types.Generator):
            raise TypeError(f"{self.py_func.__qualname__} is a generator, which no kernel can be")
        result = result._replace(entry_point=object())
        target.insert_user_function(result.entry_point, result.fndesc, [library])
        return result


class _ForPython(_Compiler):
    def __init__(self, called: _Called) -> None:
        super().__init__(called)
        self._called = called

    def _compile_core(self, args: Any, return_type: Any) -> Any:
        self._called.compile(tuple(args))
        result = self._called.overloads[tuple(args)]
        intermediate = result._asdict()["library"]
        flags = self._flags()
        target = compiler._make_subtarget(self.targetdescr.target_context, flags)
        library = _Machine(target.codegen(), intermediate.name)
        library.enable_object_caching()
        described = copy.copy(result.fndesc)
        described.env_name += "python"  # the wrapper's constants: those of `called` may be loaded as they were without
        environment = Environment.from_fndesc(described)
        with target.push_code_library(library):
            target.create_cpython_wrapper(library, described, environment, None, release_gil=flags.release_gil)
        library.add_linking_library(intermediate)
        entry = target.get_executable(library, described, environment)
        result = result._replace(
            library=library, entry_point=entry, fndesc=described, environment=environment, metadata={}
        )  # fmt: skip
        known = result._find_referenced_environments()
        for other in known:
            library.codegen.set_env(other.env_name, other)
        return result._replace(referenced_envs=known)


class _Machine(codegen.JITCodeLibrary):  # type: ignore[misc]
    """Machine code that shares no function with any other, which might be of an older version that is loaded as well.

    LLVM may change how its functions are called: internal ones, which the loader finds by name as well, won't do.
    """

    def _optimize_final_module(self) -> None:
        for function in self._final_module.functions:
            if function.linkage == llvm.Linkage.linkonce_odr and function.name.startswith("_ZN"):
                function.linkage = "private"
        super()._optimize_final_module()


class _Intermediate(codegen.JITCodeLibrary):  # type: ignore[misc]
    """Intermediate code that is neither optimised beyond each function nor made machine code of."""

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage == llvm.Linkage.external:
                function.linkage = (
                    "linkonce_odr"  # as what is linked has to be; else Numba keeps a second copy that has it
                )
        self._finalize_dynamic_globals()
        self._finalized = True

    def serialize_using_object_code(self) -> tuple[str, str, bytes]:
        """What is cached, as Numba asks for it."""
        return cast(tuple[str, str, bytes], self.serialize_using_bitcode())


class _CacheFiles(caching.CompileResultCacheImpl):  # type: ignore[misc]
    def get_filename_base(self, fullname: str, abiflags: str) -> str:
        """How its files begin."""
        return f"called-{super().get_filename_base(fullname, abiflags)}"

    def rebuild(self, target_context: Any, payload: Any) -> Any:
        """What was compiled, from what `CompileResult._reduce` made of it."""
        kept, described, environment, signature, objectmode, lifted, annotation, reload_init, environments = payload
        name, _, bitcode = kept
        library = _Intermediate(target_context.codegen(), name)
        library._final_module = llvm.parse_bitcode(bitcode)
        library._finalize_final_module()
        return compiler.compile_result(
            typing_context=target_context.typing_context, target_context=target_context, entry_point=object(),
            type_annotation=annotation, signature=signature, objectmode=objectmode, lifted=lifted, fndesc=described,
            library=library, environment=environment, reload_init=reload_init, referenced_envs=environments,
        )  # fmt: skip


class _Cache(caching.FunctionCache):  # type: ignore[misc]
    _impl_class = _CacheFiles
