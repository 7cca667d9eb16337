# mypy: ignore-errors
"""From typed statements to LLVM's instructions, for what kernels are full of: items of arrays and arithmetic.

numba looks up how to do every access and every sum among all that it could be, and writes an access so that
slices, negative indices and masks would pass, some forty instructions that LLVM reads and takes away again.
Here an access with unsigned indices is its address and a load, and arithmetic of two numbers of one kind is
its instruction. Both are what LLVM is left with otherwise; all else goes numba's way.
"""

import operator

from numba.core import types
from numba.core.cgutils import alloca_once
from numba.core.cgutils import ir as llvm
from numba.core.errors import LoweringError, new_error_context
from numba.core.ir import Assign, Del, SetItem, StaticSetItem
from numba.core.lowering import Lower

__all__ = ["KernelLower"]

WORD = llvm.IntType(64)
# places in numba's array struct
MEMINFO, PARENT, ITEMS, SIZE, DATA, SHAPE, STRIDES = range(7)
SUMS = {
    types.float64: {
        operator.add: "fadd", operator.sub: "fsub", operator.mul: "fmul", operator.truediv: "fdiv",
    },
    types.int64: {operator.add: "add", operator.sub: "sub", operator.mul: "mul"},
}  # fmt: skip
COMPARED = {
    operator.lt: "<", operator.le: "<=", operator.gt: ">", operator.ge: ">=", operator.eq: "==",
    operator.ne: "!=",
}  # fmt: skip


class KernelLower(Lower):
    """Lowers kernels: nothing is counted by references, so deleting a variable does nothing."""

    def lower_block(self, block):
        """All statements of a block."""
        self.pre_block(block)
        with new_error_context(
            "lowering a kernel", errcls_=lambda message: LoweringError(message, loc=self.loc)
        ):
            for statement in block.body:
                if type(statement) is not Del:
                    self.loc = statement.loc
                    self.lower_inst(statement)
        self.post_block(block)

    def lower_inst(self, inst):
        """One statement."""
        kind = type(inst)
        if self.flags.debuginfo:
            super().lower_inst(inst)
        elif kind is Assign:
            name = inst.target.name
            value = self.lower_assign(self.typeof(name), inst)
            if name in self._singly_assigned_vars:
                self._blk_local_varmap[name] = value
            else:
                self.builder.store(value, self.getvar(name))
        elif kind is SetItem:
            self.lower_setitem(inst.target, inst.index, inst.value, self.fndesc.calltypes[inst])
        elif kind is StaticSetItem and self.is_array(inst.target):
            self.lower_setitem(
                inst.target, inst.index_var, inst.value, self.fndesc.calltypes[inst], inst.index
            )
        else:
            super().lower_inst(inst)

    def alloca_lltype(self, name, lltype, datamodel=None):
        """Room for a variable; numba asks LLVM for its size, which debuggers want to know."""
        if self.flags.debuginfo:
            return super().alloca_lltype(name, lltype, datamodel)
        return alloca_once(self.builder, lltype, name=name, zfill=False)

    def lower_expr(self, resty, expr):
        """One expression."""
        if expr.op == "static_getitem" and expr.index_var is not None and self.is_array(expr.value):
            return self.lower_getitem(
                resty, expr, expr.value, expr.index_var, self.fndesc.calltypes[expr], expr.index
            )
        return super().lower_expr(resty, expr)

    def is_array(self, variable):
        """Whether a variable is an array."""
        return type(self.typeof(variable.name)) is types.Array

    def lower_binop(self, resty, expr, op):
        """Arithmetic and comparisons of two numbers of one kind."""
        signature = self.fndesc.calltypes[expr]
        kind, builder = signature.args[0], self.builder
        if kind not in SUMS or signature.args[1] != kind:
            return super().lower_binop(resty, expr, op)
        if op in SUMS[kind] and signature.return_type == kind:
            a, b = self.operands(expr, kind)
            value = getattr(builder, SUMS[kind][op])(a, b)
        elif op in COMPARED and signature.return_type == types.boolean:
            a, b = self.operands(expr, kind)
            if kind == types.int64:
                value = builder.icmp_signed(COMPARED[op], a, b)
            elif op is operator.ne:  # what is no number differs from all
                value = builder.fcmp_unordered("!=", a, b)
            else:
                value = builder.fcmp_ordered(COMPARED[op], a, b)
        else:
            return super().lower_binop(resty, expr, op)
        return self.context.cast(builder, value, signature.return_type, resty)

    def operands(self, expr, kind):
        """Both sides as numbers of a kind."""
        return (self._cast_var(expr.lhs, kind), self._cast_var(expr.rhs, kind))

    def lower_getitem(self, resty, expr, value, index, signature, constant=None):
        """An item of an array, or a view of one axis less or more."""
        array = signature.args[0]
        at = self.places(array, index, signature.args[1], constant)
        if at is None:
            return super().lower_getitem(resty, expr, value, index, signature)
        builder, header = self.builder, self.loadvar(value.name)
        address = self.address(array, header, at)
        if isinstance(signature.return_type, types.Array):
            found = self.view(signature.return_type, header, address, len(at))
        else:
            found = self.context.unpack_value(builder, array.dtype, address, align=self.alignment(array))
        return self.context.cast(builder, found, signature.return_type, resty)

    def lower_setitem(self, target_var, index_var, value_var, signature, constant=None):
        """An item of an array is set."""
        array = signature.args[0]
        at = self.places(array, index_var, signature.args[1], constant)
        if at is None or len(at) != array.ndim:
            super().lower_setitem(target_var, index_var, value_var, signature)
            return
        builder, header = self.builder, self.loadvar(target_var.name)
        address = self.address(array, header, at)
        value = self.context.cast(
            builder, self._cast_var(value_var, signature.args[2]), signature.args[2], array.dtype
        )
        self.context.pack_value(builder, array.dtype, value, address, align=self.alignment(array))

    @staticmethod
    def alignment(array):
        """Known alignment of items, as numba tells it."""
        return None if array.aligned else 1

    def places(self, array, index, kind, constant):
        """The indices of an access, or None where numba's way is taken."""
        if type(array) is not types.Array or array.layout == "F" or self.context.enable_boundscheck:
            return None
        together = isinstance(kind, types.BaseTuple)
        if any(one != types.uintp for one in (kind.types if together else (kind,))):
            return None
        if constant is not None:
            return [WORD(one) for one in (constant if together else (constant,))]
        value = self._cast_var(index, kind)
        return [self.builder.extract_value(value, i) for i in range(len(kind))] if together else [value]

    def address(self, array, header, at):
        """Where an item or the first one of a view is."""
        builder, data = self.builder, self.builder.extract_value(header, DATA)
        if array.layout != "C":
            parts = [builder.mul(builder.extract_value(header, (STRIDES, i)), x) for i, x in enumerate(at)]
            start = builder.ptrtoint(data, WORD)
            return builder.inttoptr(builder.add(start, self.total(parts)), data.type)
        parts = []
        for axis, place in enumerate(at):
            step = None
            for later in range(axis + 1, array.ndim):
                extent = builder.extract_value(header, (SHAPE, later))
                step = extent if step is None else builder.mul(step, extent)
            parts.append(place if step is None else builder.mul(place, step))
        return builder.gep(data, [self.total(parts)])

    def total(self, parts):
        """Their sum."""
        out = parts[0]
        for part in parts[1:]:
            out = self.builder.add(out, part)
        return out

    def view(self, kind, header, address, gone):
        """The header of what is left behind the first axes."""
        builder = self.builder
        out = llvm.Constant(self.context.get_value_type(kind), llvm.Undefined)
        items = None
        for axis in range(kind.ndim):
            extent = builder.extract_value(header, (SHAPE, gone + axis))
            items = extent if items is None else builder.mul(items, extent, flags=["nsw"])
            out = builder.insert_value(out, extent, (SHAPE, axis))
            stride = builder.extract_value(header, (STRIDES, gone + axis))
            out = builder.insert_value(out, stride, (STRIDES, axis))
        for place in (MEMINFO, PARENT, SIZE):
            out = builder.insert_value(out, builder.extract_value(header, place), place)
        return builder.insert_value(builder.insert_value(out, items, ITEMS), address, DATA)
