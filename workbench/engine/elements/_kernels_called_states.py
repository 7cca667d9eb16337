# mypy: ignore-errors
"""Laws of users with states of their own as machine code, called by address as in `_kernels_called`.

Struts are evaluated by complex steps alone, so a law has two entries: for real and for complex constants.
"""

from functools import cache

from numba import carray, cfunc, types
from numba.core.cgutils import ir as llvm
from numba.extending import intrinsic

from ._kernels_called import OPTIONS, compiled, place_of

__all__ = ["CONSTANTS", "MOST_CONSTANTS", "POINTS", "WIDTH", "strut_at", "strut_entries"]

# places in the row of a strut: addresses, point on a, point on b and natural length, constants
ADDRESSES, POINTS, CONSTANTS, WIDTH = 0, 2, 9, 31
MOST_CONSTANTS = WIDTH - CONSTANTS


def strut_entries(force, growth, states, count):
    """Entries of a law for real and for complex constants. Raises what numba raises where one does not
    compile.

    entry(values, t, row, out): delta, rate and states; out: force, rates of the states.
    """
    number = types.complex128
    taken = (number, number, types.float64, *(number,) * (states + count))
    scope = {"carray": carray, "force": compiled(force, taken), "growth": compiled(growth, taken)}
    return tuple(_entry(scope, states, count, real) for real in (True, False))


def _entry(scope, states, count, real):
    given = ", ".join((
        "s[0], s[1], t", *(f"s[{2 + k}]" for k in range(states)),
        *(f"complex(p[{CONSTANTS + j}], 0.0)" if real else f"p[{CONSTANTS + j}]" for j in range(count)),
    ))  # fmt: skip
    rates = ", ".join(f"o[{1 + k}]" for k in range(states))
    lines = (
        "def law(values, t, row, out):",
        f"s, p, o = carray(values, {2 + states}), carray(row, {WIDTH}), carray(out, {1 + states})",
        f"o[0] = force({given})",
        f"{rates} = growth({given})",
    )
    own = dict(scope)
    exec("\n    ".join(lines), own)
    return cfunc(_signature(real), **OPTIONS)(own["law"])


@cache
def _signature(real):
    row = types.float64 if real else types.complex128
    values = types.CPointer(types.complex128)
    return types.void(values, types.float64, types.CPointer(row), values)


@intrinsic
def strut_at(typingctx, row, values, t, out):
    """Fill out with force and rates of the states of the strut in `row`, by its law's entry for the type of
    the row; values: delta, rate, states, complex."""
    signature = types.void(row, values, t, out)

    def lines(context, builder, signature, given):
        table, first = signature.args[0], context.get_constant(types.intp, 0)
        complex_row = isinstance(table.dtype, types.Complex)
        which = context.get_constant(types.intp, ADDRESSES + int(complex_row))
        address = builder.load(place_of(context, builder, table, given[0], which))
        if complex_row:
            address = builder.extract_value(address, 0)
        arguments = [
            place_of(context, builder, signature.args[1], given[1], first), given[2],
            place_of(context, builder, table, given[0], first),
            place_of(context, builder, signature.args[3], given[3], first),
        ]  # fmt: skip
        function = llvm.FunctionType(llvm.VoidType(), [argument.type for argument in arguments])
        entry = builder.inttoptr(builder.fptosi(address, llvm.IntType(64)), function.as_pointer())
        builder.call(entry, arguments)
        return context.get_dummy_value()

    return signature, lines
