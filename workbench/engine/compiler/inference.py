# mypy: ignore-errors
"""Types of operators on numbers, of items of arrays and of ranges, found once.

numba tries all that an operator could mean, and again for every statement; half of the time for types goes
there. The answer depends on the types alone.
"""

import operator

from numba.core import types
from numba.core.compiler_machinery import register_pass
from numba.core.typed_passes import NopythonTypeInference

__all__ = ["KernelTypeInference"]

SCALARS = (types.Number, types.Boolean)
OTHERS = (bool, range)  # beside operators
# signatures by operator, whose type changes when numba learns new meanings of it, and by types of arguments
FOUND = {}


def _is_plain(kind):
    """Whether a type is a number, an array, or a tuple of numbers."""
    if isinstance(kind, types.BaseTuple):
        return all(isinstance(one, SCALARS) for one in kind)
    return isinstance(kind, (*SCALARS, types.Array))


def _is_operator(key):
    """Whether the meaning of a function depends on the types of its arguments alone."""
    return key in OTHERS if isinstance(key, type) else getattr(key, "__module__", None) == "_operator"


class _Remembering:
    """A typing context that knows what it found for operators."""

    def __init__(self, context):
        self._context = context

    def __getattr__(self, name):
        return getattr(self._context, name)

    def resolve_function_type(self, function, args, kws):
        """The signature of a call, remembered for operators on plain arguments."""
        if function is operator.getitem:  # other operators come as their types
            function = self._context.resolve_value_type(function)
        if (
            kws
            or type(function) is not types.Function
            or not _is_operator(function.typing_key)
            or not all(map(_is_plain, args))
        ):
            return self._context.resolve_function_type(function, args, kws)
        # numba's lock on compiling is held
        key = (function, tuple(args))
        if key not in FOUND:
            FOUND[key] = self._context.resolve_function_type(function, args, kws)
        return FOUND[key]

    def resolve_setitem(self, target, index, value):
        """The signature of setting an item, which numba asks for by a name of its own."""
        return self.resolve_function_type(
            self._context.resolve_value_type(operator.setitem), (target, index, value), {}
        )


@register_pass(mutates_CFG=True, analysis_only=False)
class KernelTypeInference(NopythonTypeInference):
    """Inference with a memory for operators."""

    _name = "kernel_type_inference"

    def run_pass(self, state):
        """As numba's."""
        context = state.typingctx
        state.typingctx = _Remembering(context)
        try:
            return super().run_pass(state)
        finally:
            state.typingctx = context
