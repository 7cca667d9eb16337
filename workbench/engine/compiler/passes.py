# mypy: ignore-errors
"""How numba compiles the kernels: the passes they need, and machine code for the outer ones alone.

numba's own pipeline takes any Python function. The kernels are loops over arrays and calls of each other: no
closures, generators, contexts or parallel loops, nothing that owns memory, so the passes for these go. Inner
functions are linked into the kernels that call them, and optimised and turned into machine code there only.

Indices count from the front: numba reads x[-1] as the last item, which costs every x[i] a comparison, and
loops their vectors.
"""

import gc
from contextlib import contextmanager

from numba import _dynfunc, types
from numba.core.compiler import CompilerBase, Flags
from numba.core.compiler_machinery import FunctionPass, PassManager, register_pass
from numba.core.errors import UnsupportedError
from numba.core.ir import Assign, Expr, SetItem, StaticSetItem
from numba.core.typed_passes import AnnotateTypes, NativeLowering, NoPythonBackend
from numba.core.untyped_passes import (
    DeadBranchPrune,
    FixupArgs,
    RewriteSemanticConstants,
    TranslateByteCode,
)

from .inference import KernelTypeInference
from .libraries import InnerLibrary, KernelLibrary
from .lowering import KernelLower
from .preparation import AssignedOnce, InOrder, Rewritten, WithoutPhis

__all__ = ["CalledCompiler", "InnerCompiler", "KernelCompiler"]


class _Flags(Flags):
    """Compared by what was set, not option by option: numba compares them 30 000 times for a gradient."""

    _hash = hash(tuple(sorted(Flags.options)))  # as of any `Flags`: equal ones stay equal

    def __hash__(self):
        return self._hash

    def __eq__(self, other):
        return self._values == other._values if isinstance(other, _Flags) else super().__eq__(other)


@contextmanager
def _collector_at_rest():
    """Leave cyclic garbage lying while a kernel compiles: millions of objects come and go, few in cycles.

    What is left would be looked through at once then; frozen and thawed it counts as old.
    """
    running = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if running:
            if not gc.get_freeze_count():
                gc.freeze()
                gc.unfreeze()
            gc.enable()


class _Passes(PassManager):
    _ENFORCING = False  # no rebuilding of the control flow after every pass; those here leave it in order


def _from_the_front(index):
    """The type of an index without those that count from the end."""
    if isinstance(index, types.BaseTuple):
        return types.BaseTuple.from_types([_from_the_front(kind) for kind in index])
    if not isinstance(index, types.Integer):
        return index
    return types.uintp


@register_pass(mutates_CFG=False, analysis_only=False)
class _CountFromTheFront(FunctionPass):
    """Take the indices of arrays as unsigned numbers."""

    _name = "count_from_the_front"

    def __init__(self):
        super().__init__()

    def run_pass(self, state):
        for block in state.func_ir.blocks.values():
            for statement in block.body:
                if isinstance(statement, SetItem):
                    self.count(state, statement, statement.target, statement.index, statement)
                elif isinstance(statement, StaticSetItem):
                    self.count(state, statement, statement.target, statement.index_var, statement)
                elif isinstance(statement, Assign) and isinstance(statement.value, Expr):
                    read = statement.value
                    if read.op == "getitem":
                        self.count(state, read, read.value, read.index, statement)
                    elif read.op == "static_getitem":
                        self.count(state, read, read.value, read.index_var, statement)
        return True

    def count(self, state, key, array, index, statement):
        """Change the index in the signature of one access, and what holds several."""
        if not isinstance(state.typemap[array.name], types.Array):
            return
        constant = getattr(key, "index", None)
        for one in constant if isinstance(constant, tuple) else (constant,):
            if isinstance(one, int) and one < 0:
                raise UnsupportedError("kernels of the engine count from the front", statement.loc)
        signature = state.calltypes.pop(key)
        args = list(signature.args)
        args[1] = _from_the_front(args[1])
        state.calltypes[key] = signature.replace(args=tuple(args))
        if index is not None and index.is_temp and isinstance(args[1], types.BaseTuple):
            state.typemap.pop(index.name)
            state.typemap[index.name] = args[1]


@register_pass(mutates_CFG=True, analysis_only=False)
class _KernelLowering(NativeLowering):
    _name = "kernel_lowering"
    lowering_class = KernelLower

    def run_pass(self, state):
        state.library = KernelLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return super().run_pass(state)


class KernelCompiler(CompilerBase):
    """For kernels that Python calls."""

    lowering = _KernelLowering

    def __init__(self, typingctx, targetctx, library, args, return_type, flags, locals):
        super().__init__(typingctx, targetctx, library, args, return_type, _Flags(flags), locals)

    def _compile_core(self):
        with _collector_at_rest():
            return super()._compile_core()

    def define_pipelines(self):
        """One list of passes, in order."""
        passes = _Passes("kernel")
        for step in (
            TranslateByteCode,
            FixupArgs,
            InOrder,
            RewriteSemanticConstants,
            DeadBranchPrune,  # what stands behind arguments that are None
            Rewritten,
            AssignedOnce,
            KernelTypeInference,
            _CountFromTheFront,
            WithoutPhis,
            AnnotateTypes,
            self.lowering,
            NoPythonBackend,
        ):
            passes.add_pass(step, step.__name__)
        passes.finalize()
        return [passes]


@register_pass(mutates_CFG=True, analysis_only=False)
class _InnerLowering(NativeLowering):
    _name = "inner_lowering"
    lowering_class = KernelLower

    def run_pass(self, state):
        library = InnerLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library = library
        super().run_pass(state)
        made = state.cr
        # callers find the function by an entry of its own; nothing can be called there
        module, name = made.fndesc.lookup_module(), made.fndesc.qualname
        entry = _dynfunc.make_function(module, name, f"inner kernel {name}", 0, made.env, (library,))
        state.targetctx.insert_user_function(entry, made.fndesc, [library])
        state.cr = made._replace(cfunc=entry)
        return True


class InnerCompiler(KernelCompiler):
    """For functions that only kernels call."""

    lowering = _InnerLowering

    def __init__(self, *arguments):
        super().__init__(*arguments)
        self.state.flags.no_compile = True


class _CalledLower(KernelLower):
    def setup_function(self, fndesc):
        super().setup_function(fndesc)
        self.function.attributes.add("noinline")


@register_pass(mutates_CFG=True, analysis_only=False)
class _CalledLowering(_InnerLowering):
    _name = "called_lowering"
    lowering_class = _CalledLower


class CalledCompiler(InnerCompiler):
    """For functions of loops that kernels call at several places: LLVM writes them once."""

    lowering = _CalledLowering
