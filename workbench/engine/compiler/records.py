# mypy: ignore-errors
"""Named tuples of arrays as arguments of compiled kernels: one pointer, whatever the number of fields.

numba passes named tuples field by field: with some fifty arrays every function that hands them on has
several hundred arguments, and every kernel that Python calls takes them apart one by one. A `Record` is the
address of a table of array headers, filled in one loop when Python calls; `T.mass` reads a header.
"""

from hashlib import sha256
from typing import TypeVar

from numba.core import cgutils, types
from numba.core.cgutils import ir
from numba.core.datamodel import models, register_default
from numba.core.imputils import lower_getattr_generic
from numba.core.typing.templates import AttributeTemplate, infer_getattr
from numba.extending import NativeValue, typeof_impl, unbox

__all__ = ["Record", "passed_as_record"]

Class = TypeVar("Class", bound=type)

WORD = ir.IntType(64)
# words of numba's array header: owner, parent, items, item size, data, then the shape and the strides
ITEMS, DATA, SHAPE = 2, 4, 5
SIZES = {}  # of items, bytes; numba's lock on compiling is held


class Record(types.Type):
    """The numba type of a named tuple of arrays; two are alike when class, names and array types are."""

    def __init__(self, instance_class, arrays):
        self.instance_class = instance_class
        self.fields = dict(zip(instance_class._fields, arrays, strict=True))
        self.words = SHAPE + 2 * max(array.ndim for array in arrays)  # from header to header
        # short, as part of every symbol; it tells kernels on disk from those of other fields
        told = sha256(repr(self.fields).encode()).hexdigest()[:16]
        super().__init__(f"{instance_class.__module__}.{instance_class.__qualname__}:{told}")


def passed_as_record(cls: Class) -> Class:
    """Class decorator: kernels take this named tuple as a `Record`; fields that are no arrays are refused."""

    @typeof_impl.register(cls)
    def record(value, context):
        arrays = tuple(typeof_impl(field, context) for field in value)
        return Record(cls, arrays) if all(isinstance(kind, types.Array) for kind in arrays) else None

    return cls


register_default(Record)(models.OpaqueModel)


@infer_getattr
class _Fields(AttributeTemplate):
    key = Record

    def generic_resolve(self, record, name):
        return record.fields.get(name)


@unbox(Record)
def _headers(record, value, c):
    """Fill the table; its headers borrow the arrays, which the caller's tuple keeps alive."""
    builder, count, pointer = c.builder, len(record.fields), c.pyapi.voidptr
    table = cgutils.alloca_once(builder, ir.ArrayType(ir.ArrayType(WORD, record.words), count))
    take = ir.FunctionType(c.pyapi.pyobj, [c.pyapi.pyobj, WORD])
    fill = ir.FunctionType(ir.IntType(32), [c.pyapi.pyobj, pointer])
    take = cgutils.get_or_insert_function(builder.module, take, "PyTuple_GetItem")
    fill = cgutils.get_or_insert_function(builder.module, fill, "numba_adapt_ndarray")
    with cgutils.for_range(builder, WORD(count), intp=WORD) as loop:
        header = builder.bitcast(builder.gep(table, [WORD(0), loop.index]), pointer)
        builder.call(fill, (builder.call(take, (value, loop.index)), header))
    return NativeValue(builder.bitcast(table, pointer))


@lower_getattr_generic(Record)
def _field(context, builder, record, value, name):
    array, at = record.fields[name], list(record.fields).index(name) * record.words * 8
    return builder.call(_reader(context, builder.module, array), [builder.gep(value, [WORD(at)])])


def _size_of(context, kind):
    """Bytes of an item; LLVM is asked once for a kind."""
    if kind not in SIZES:
        SIZES[kind] = context.get_abi_sizeof(context.get_data_type(kind))
    return SIZES[kind]


def _reader(context, module, array):
    """The function of a module that turns a header into an array of a type; LLVM inlines it."""
    name = f"header_of_{array.dtype}_{array.ndim}{array.layout}"
    if name in module.globals:
        return module.globals[name]
    struct, pointer = context.get_value_type(array), context.get_value_type(types.voidptr)
    function = ir.Function(module, ir.FunctionType(struct, [pointer]), name)
    function.linkage = "internal"
    function.attributes.add("alwaysinline")
    builder = ir.IRBuilder(function.append_basic_block())
    words = builder.bitcast(function.args[0], WORD.as_pointer())
    constant = module.add_metadata([])

    def word(index):
        # headers do not change while a kernel runs, whatever it writes into the arrays: LLVM may keep them
        load = builder.load(builder.gep(words, [WORD(index)]))
        load.set_metadata("invariant.load", constant)
        return load

    axes = range(array.ndim)
    size = WORD(_size_of(context, array.dtype))
    shape = [word(SHAPE + axis) for axis in axes]
    strides = [word(SHAPE + array.ndim + axis) for axis in axes]
    if array.layout == "C":  # known strides make shorter code
        strides = [size]
        for extent in shape[:0:-1]:
            strides.insert(0, builder.mul(strides[0], extent))
    none, data = ir.Constant(pointer, None), builder.inttoptr(word(DATA), struct.elements[DATA])
    out = ir.Constant(struct, ir.Undefined)
    for place, part in enumerate((none, none, word(ITEMS), size, data)):
        out = builder.insert_value(out, part, place)
    for axis in axes:
        out = builder.insert_value(out, shape[axis], (SHAPE, axis))
        out = builder.insert_value(out, strides[axis], (SHAPE + 1, axis))
    builder.ret(out)
    return function
