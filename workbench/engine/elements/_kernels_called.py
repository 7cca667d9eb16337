# mypy: ignore-errors
"""Laws of users as machine code: made from a function of Python, called by its address from the kernels.

An address is a number in the parameter table, so kernels stay on disk whatever laws they call, and a new law
compiles itself alone. A law has four entries. Three give its force, told apart by the types at the place of
the call: all numbers real, with slopes; states complex; states and parameters complex (complex steps through
the equations). The fourth gives slopes by its parameters.
"""

import operator
from functools import cache
from types import CellType, FunctionType

from numba import carray, cfunc, njit, types
from numba.core import cgutils
from numba.core.cgutils import ir as llvm
from numba.core.compiler import CompilerBase, DefaultPassBuilder
from numba.core.compiler_machinery import FunctionPass, register_pass
from numba.core.ir import Assign, Expr, Global
from numba.core.ir_utils import build_definitions
from numba.core.untyped_passes import IRProcessing
from numba.extending import intrinsic, overload

from .user_function import is_helper

__all__ = ["FIRST", "OPTIONS", "compiled", "entries", "force_at", "place_of", "slopes_at"]

REAL, STATES, ALL, SLOPES = range(4)  # rows of the table with an address
FIRST = 4  # first row with a parameter
STEP = 1e-30


def entries(force, slopes, count):
    """The compiled entries of a law with `count` parameters, in the order of their rows. Raises what numba
    raises where a function does not compile.
    """
    number = types.complex128 if slopes is None else types.float64
    scope = {"carray": carray, "STEP": STEP}
    for name, function in (("force", force), ("slopes", slopes)):
        if function is not None:
            scope[name] = compiled(function, (number, number, types.float64, *(number,) * count))
    bodies = _stepped(count) if slopes is None else _given(count)
    return tuple(_entry(number, lines, count, scope) for number, lines in enumerate(bodies))


OPTIONS = {"error_model": "numpy", "nogil": True}
WHOLE = 64  # powers up to this one are products


def power(x, n):
    """x**n. numba goes by way of the angle of x, which loses the tiny part of a negative x in x**3."""


@overload(power)
def _power(x, n):
    if not isinstance(x, types.Complex):
        return lambda x, n: x**n

    def products(x, n):
        whole = int(n.real)
        if n.real != whole or n.imag != 0.0 or abs(whole) > WHOLE:
            return x**n
        out, square, left = complex(1.0, 0.0), x, abs(whole)
        while left:
            if left % 2:
                out *= square
            square *= square
            left //= 2
        return 1.0 / out if whole < 0 else out

    return products


@register_pass(mutates_CFG=False, analysis_only=False)
class PowersOfOurs(FunctionPass):
    """x**n of a user's function becomes power(x, n)."""

    _name = "powers_of_ours"

    def __init__(self):
        FunctionPass.__init__(self)

    def run_pass(self, state):
        """Whether the function had a power."""
        changed = False
        for block in state.func_ir.blocks.values():
            body = []
            for line in block.body:
                value = getattr(line, "value", None)
                if getattr(value, "op", "") in ("binop", "inplace_binop") and value.fn in _POWERS:
                    ours = block.scope.redefine("power", line.loc)
                    body.append(Assign(Global("power", power, line.loc), ours, line.loc))
                    line.value = Expr.call(ours, (value.lhs, value.rhs), (), line.loc)
                    changed = True
                body.append(line)
            block.body = body
        if changed:
            state.func_ir._definitions = build_definitions(state.func_ir.blocks)
        return changed


_POWERS = (operator.pow, operator.ipow)


class UsersCompiler(CompilerBase):
    """numba's own pipeline, with powers of ours."""

    def define_pipelines(self):
        """One pipeline."""
        manager = DefaultPassBuilder.define_nopython_pipeline(self.state)
        manager.add_pass_after(PowersOfOurs, IRProcessing)
        manager.finalize()
        return [manager]


def compiled(function, taken):
    """A user's function, or the one behind a function that is compiled already, for the types it will get."""
    own = _with_helpers(getattr(function, "py_func", function), {})
    own.compile(taken)
    return own


def _with_helpers(function, done):
    """The function and plain functions that it calls by name, theirs among them, each as numba needs it."""
    names = dict(function.__globals__)
    cells = tuple(CellType(_helper(cell.cell_contents, done)) for cell in function.__closure__ or ())
    code = function.__code__
    same = FunctionType(code, names, function.__name__, function.__defaults__, cells or None)
    done[function] = njit(pipeline_class=UsersCompiler, **OPTIONS)(same)
    for name in code.co_names:
        if name in names:
            names[name] = _helper(names[name], done)
    return done[function]


def _helper(value, done):
    if not is_helper(value):
        return value
    return done[value] if value in done else _with_helpers(value, done)


def _entry(number, lines, count, scope):
    """One entry: void law(delta, rate, t, column, stride, f, fd, fv), numbers of one member by their places;
    for slopes f is the column of slopes."""
    begin = (
        "def law(delta, rate, t, column, stride, f, fd, fv):",
        f"d, v, p = carray(delta, 1)[0], carray(rate, 1)[0], carray(column, ({FIRST + count}, stride))",
    )
    own = dict(scope)
    exec("\n    ".join((*begin, *lines)), own)
    return cfunc(_signature(number), **OPTIONS)(own["law"])


def _stepped(count):
    """Lines of the four entries of a law whose slopes are taken by complex step."""

    def force(states, moved=None):
        own = (f"complex(p[{FIRST + j}, 0], {'STEP' if j == moved else 0.0})" for j in range(count))
        return f"force({', '.join((states, 't', *own))})"

    real = (
        f"a, b = {force('complex(d, STEP), complex(v, 0.0)')}, {force('complex(d, 0.0), complex(v, STEP)')}",
        "carray(f, 1)[0], carray(fd, 1)[0], carray(fv, 1)[0] = a.real, a.imag / STEP, b.imag / STEP",
    )
    by_states = (f"carray(f, 1)[0] = {force('d, v')}",)
    by_all = (
        f"carray(f, 1)[0] = force({', '.join(('d, v, t', *(f'p[{FIRST + j}, 0]' for j in range(count))))})",
    )
    by_own = (
        f"dp = carray(f, {FIRST + count})",
        *(
            f"dp[{FIRST + j}] = {force('complex(d, 0.0), complex(v, 0.0)', j)}.imag / STEP"
            for j in range(count)
        ),
    )
    return real, by_states, by_all, by_own


def _given(count):
    """Those of a law with slopes of its own, which is never called with complex numbers."""
    own = "".join(f", p[{FIRST + j}, 0].real" for j in range(count))
    at = f"d.real, v.real, t{own}"
    real = (
        f"carray(fd, 1)[0], carray(fv, 1)[0] = slopes({at})",
        f"carray(f, 1)[0] = force({at})",
    )
    along = (
        f"a, b = slopes({at})",
        f"carray(f, 1)[0] = complex(force({at}), a * d.imag + b * v.imag)",
    )
    return real, along, along, ("pass",)


@cache
def _signature(number):
    state = types.complex128 if number in (STATES, ALL) else types.float64
    column = types.complex128 if number == ALL else types.float64
    numbers = [types.CPointer(state)] * 2 + [types.float64, types.CPointer(column), types.intp]
    return types.void(*numbers, *[types.CPointer(state)] * 3)


@intrinsic
def force_at(typingctx, p, i, delta, rate, t, f, fd, fv):
    """Fill f, df/ddelta, df/drate of member i, by its law's entry for the types of the numbers; slopes only
    where all are real.
    """
    if isinstance(p.dtype, types.Complex):
        number = ALL
    else:
        number = STATES if isinstance(delta, types.Complex) else REAL
    signature = types.void(p, i, delta, rate, t, f, fd, fv)

    def lines(context, builder, signature, given):
        arrays = zip(signature.args[5:], given[5:], strict=True)
        out = [place_of(context, builder, *array, given[1]) for array in arrays]
        return _jump(context, builder, signature, given, number, out)

    return signature, lines


@intrinsic
def slopes_at(typingctx, p, i, delta, rate, t, dp):
    """Fill the rows of dp with slopes of the force of member i by the parameters of its law."""
    signature = types.void(p, i, delta, rate, t, dp)

    def lines(context, builder, signature, given):
        zero = context.get_constant(types.intp, 0)
        out = [place_of(context, builder, signature.args[5], given[5], zero)] * 3
        return _jump(context, builder, signature, given, SLOPES, out)

    return signature, lines


def place_of(context, builder, kind, array, *at):
    """Where an item of an array is kept."""
    own = context.make_array(kind)(context, builder, array)
    return cgutils.get_item_pointer(context, builder, kind, own, at)


def _jump(context, builder, signature, given, number, out):
    """Call an entry of the law of a member with the places of its numbers."""
    p, i, *states, t = given[:5]
    table, _, *kinds, _ = signature.args[:5]

    def row(number):
        return place_of(context, builder, table, p, context.get_constant(types.intp, number), i)

    address = builder.load(row(number))
    if isinstance(table.dtype, types.Complex):
        address = builder.extract_value(address, 0)
    own = context.make_array(table)(context, builder, p)
    stride = builder.extract_value(own.strides, 0)
    stride = builder.sdiv(stride, context.get_constant(types.intp, table.dtype.bitwidth // 8))
    wanted = _signature(number).args
    places = [
        cgutils.alloca_once_value(builder, context.cast(builder, value, kind, pointer.dtype))
        for value, kind, pointer in zip(states, kinds, wanted, strict=False)
    ]
    arguments = [*places, t, row(0), stride, *out]
    function = llvm.FunctionType(llvm.VoidType(), [argument.type for argument in arguments])
    entry = builder.inttoptr(builder.fptosi(address, llvm.IntType(64)), function.as_pointer())
    builder.call(entry, arguments)
    return context.get_dummy_value()
