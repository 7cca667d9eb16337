# mypy: ignore-errors
"""What kernels are linked from: every function once, and optimised in the kernel alone.

numba links into each function all that it calls, so that a function that stands eight calls deep is copied
eight times on its way into a kernel.
"""

from numba.core.codegen import JITCodeLibrary
from numba.core.codegen import ll as llvm

__all__ = ["InnerLibrary", "KernelLibrary"]


class InnerLibrary(JITCodeLibrary):
    """Code for others to link. What it calls stays beside it: kernels link each function once."""

    def finalize(self):
        """Nothing is linked here."""
        self._raise_if_finalized()
        self._finalize_dynamic_globals()
        self._finalized = True

    def alone(self):
        """The module of this function."""
        self._ensure_finalized()
        for function in self._final_module.functions:
            if not function.is_declaration and function.linkage == llvm.Linkage.external:
                function.linkage = "linkonce_odr"
        return self._final_module

    def _get_module_for_linking(self):
        """For callers that numba compiles in its own way: with all that it calls."""
        if self._shared_module is None:
            whole = self.alone().clone()
            for library in _with_all_called(self._linking_libraries):
                whole.link_in(library._get_module_for_linking(), preserve=True)
            self._shared_module = whole
        return self._shared_module


class _Alone:
    """A library to link that brings itself only."""

    def __init__(self, library):
        self._get_module_for_linking = library.alone
        self._reload_init = getattr(library, "_reload_init", ())  # newer numba asks for it


def _with_all_called(libraries):
    """These libraries and those that they call, each once and behind all its callers.

    LLVM leaves out a function that nothing asks for when it is linked.
    """
    seen, callees_first = set(), []

    def visit(library):
        if library in seen:
            return
        seen.add(library)
        inner = isinstance(library, InnerLibrary)
        for called in library._linking_libraries[::-1] if inner else ():
            visit(called)
        callees_first.append(_Alone(library) if inner else library)

    for library in libraries[::-1]:
        visit(library)
    return callees_first[::-1]


class KernelLibrary(JITCodeLibrary):
    """Optimised once: numba does it twice, to find reference counts, and there are none."""

    def finalize(self):
        """Link what was called, optimise, make machine code."""
        self._linking_libraries = _with_all_called(self._linking_libraries)
        super().finalize()

    def _optimize_final_module(self):
        for function in self._final_module.functions:
            if function.is_declaration and function.name.startswith("_ZN"):
                raise AssertionError(f"{function.name} is called in a kernel and not linked")
        made = self._codegen._module_pass_manager()  # with its builder where LLVM's new passes are used
        passes, *builder = made if isinstance(made, tuple) else (made,)
        passes.run(self._final_module, *builder)
