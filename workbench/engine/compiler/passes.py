# mypy: ignore-errors
"""How numba compiles the kernels: the passes they need, and machine code for the outer ones alone.

numba's own pipeline takes any Python function. The kernels are loops over arrays and calls of each other: no
closures, generators, contexts or parallel loops, nothing that owns memory, so the passes for these go. Inner
functions are linked into the kernels that call them, and optimised and turned into machine code there only.
"""

import gc
from contextlib import contextmanager

from numba import _dynfunc
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import CompilerBase, Flags
from numba.core.compiler_machinery import PassManager, register_pass
from numba.core.typed_passes import (
    AnnotateTypes,
    IRLegalization,
    NativeLowering,
    NoPythonBackend,
    NopythonTypeInference,
    PreLowerStripPhis,
)
from numba.core.untyped_passes import (
    DeadBranchPrune,
    FixupArgs,
    GenericRewrites,
    IRProcessing,
    ReconstructSSA,
    RewriteSemanticConstants,
    TranslateByteCode,
)

__all__ = ["InnerCompiler", "KernelCompiler"]


class _Flags(Flags):
    """Compared by what was set, not option by option: numba compares them 30 000 times for a gradient."""

    _hash = hash(tuple(sorted(Flags.options)))  # as of any `Flags`: equal ones stay equal

    def __hash__(self):
        return self._hash

    def __eq__(self, other):
        return self._values == other._values if isinstance(other, _Flags) else super().__eq__(other)


@contextmanager
def _collector_at_rest():
    """Leave cyclic garbage lying while a kernel compiles: millions of objects come and go, few in cycles."""
    running = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if running:
            gc.enable()


class _Passes(PassManager):
    _ENFORCING = False  # no rebuilding of the control flow after every pass; those here leave it in order


class KernelCompiler(CompilerBase):
    """For kernels that Python calls."""

    lowering = NativeLowering

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
            IRProcessing,
            RewriteSemanticConstants,
            DeadBranchPrune,  # what stands behind arguments that are None
            GenericRewrites,
            ReconstructSSA,
            NopythonTypeInference,
            PreLowerStripPhis,
            IRLegalization,
            AnnotateTypes,
            self.lowering,
            NoPythonBackend,
        ):
            passes.add_pass(step, step.__name__)
        passes.finalize()
        return [passes]


class _InnerLibrary(JITCodeLibrary):
    """Code for other libraries to link."""

    def _optimize_final_module(self):
        pass

    def _finalize_final_module(self):
        self._finalize_dynamic_globals()
        self._finalized = True


@register_pass(mutates_CFG=True, analysis_only=False)
class _InnerLowering(NativeLowering):
    _name = "inner_lowering"

    def run_pass(self, state):
        library = _InnerLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
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
