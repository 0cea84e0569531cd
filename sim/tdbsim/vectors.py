"""Explicit vectors of eight numbers, for kernels that integrate eight drops side by side.

numba leaves vectorisation of loops to the compiler.  Here a value *is* a vector, also on processors with shorter registers, of
which the compiler then uses several; and branch-free scalar code works on vectors too.  In place of branches, `where` selects
by masks.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from typing import Any, ClassVar

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.imputils import lower_builtin
from numba.core.typing.templates import ConcreteTemplate, infer_global, signature
from numba.extending import intrinsic, models, register_model

LANES = 8
_NUMBERS, _WHOLES, _TRUTHS = (ir.VectorType(kind, LANES) for kind in (ir.DoubleType(), ir.IntType(64), ir.IntType(1)))


class _Vector(types.Type):
    """Type of a vector of eight floats, integers or booleans."""

    def __init__(self, name: str, kind: Any) -> None:
        super().__init__(name)
        self.kind = kind


vector, whole, mask = _Vector("vector", _NUMBERS), _Vector("whole", _WHOLES), _Vector("mask", _TRUTHS)


@register_model(_Vector)
class _VectorModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, kind.kind)


def _spread(builder: Any, value: Any) -> Any:
    """Return a scalar in all lanes; a vector unchanged."""
    if isinstance(value.type, ir.VectorType):
        return value
    kind, place = ir.VectorType(value.type, LANES), ir.IntType(32)
    empty = ir.Constant(kind, ir.Undefined)
    first = builder.insert_element(empty, value, ir.Constant(place, 0))
    return builder.shuffle_vector(
        first, empty, ir.Constant(ir.VectorType(place, LANES), [ir.Constant(place, 0)] * LANES)
    )


def _define(function: Any, emit: Callable[..., Any], result: Any, *arguments: Any) -> None:
    """Overload a Python function for vectors; of two arguments one may be a scalar."""
    kinds = [arguments]
    single = {vector: types.float64, whole: types.int64}.get(arguments[0])
    if single is not None and len(arguments) == 2:
        kinds += [(arguments[0], single), (single, arguments[1])]

    class Template(ConcreteTemplate):
        key = function
        cases: ClassVar[list[Any]] = [signature(result, *kind) for kind in kinds]

    def lowered(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return emit(builder, *(_spread(builder, each) for each in args))

    infer_global(function)(Template)
    for kind in kinds:
        lower_builtin(function, *kind)(lowered)


def _named(name: str) -> Callable[..., Any]:
    def emit(builder: Any, *args: Any) -> Any:
        declared = ir.FunctionType(_NUMBERS, [_NUMBERS] * len(args))
        return builder.call(cgutils.get_or_insert_function(builder.module, declared, f"llvm.{name}.v{LANES}f64"), args)

    return emit


_ARITHMETIC: dict[Any, Callable[..., Any]] = {
    operator.add: lambda b, x, y: b.fadd(x, y),
    operator.sub: lambda b, x, y: b.fsub(x, y),
    operator.mul: lambda b, x, y: b.fmul(x, y),
    operator.truediv: lambda b, x, y: b.fdiv(x, y),
    operator.iadd: lambda b, x, y: b.fadd(x, y),
    operator.isub: lambda b, x, y: b.fsub(x, y),
    operator.imul: lambda b, x, y: b.fmul(x, y),
    math.copysign: _named("copysign"),
}
_OF_ONE: dict[Any, Callable[..., Any]] = {
    operator.neg: lambda b, x: b.fsub(_spread(b, ir.Constant(ir.DoubleType(), -0.0)), x),
    math.sqrt: _named("sqrt"),
    abs: _named("fabs"),
}
_OF_BITS: dict[Any, Callable[..., Any]] = {
    operator.and_: lambda b, x, y: b.and_(x, y),
    operator.or_: lambda b, x, y: b.or_(x, y),
}
_OF_WHOLES: dict[Any, Callable[..., Any]] = _OF_BITS | {
    operator.add: lambda b, x, y: b.add(x, y),
    operator.mul: lambda b, x, y: b.mul(x, y),
    operator.rshift: lambda b, x, y: b.lshr(x, y),
}
_COMPARISONS: dict[Any, str] = {operator.lt: "<", operator.gt: ">", operator.le: "<=", operator.ge: ">="}

for _function, _emit in _ARITHMETIC.items():
    _define(_function, _emit, vector, vector, vector)
for _function, _emit in _OF_ONE.items():
    _define(_function, _emit, vector, vector)
for _function, _emit in _OF_WHOLES.items():
    _define(_function, _emit, whole, whole, whole)
for _function, _emit in _OF_BITS.items():
    _define(_function, _emit, mask, mask, mask)
for _function, _sign in _COMPARISONS.items():
    _define(_function, lambda b, x, y, sign=_sign: b.fcmp_ordered(sign, x, y), mask, vector, vector)
    _define(_function, lambda b, x, y, sign=_sign: b.icmp_signed(sign, x, y), mask, whole, whole)


@intrinsic
def address(typing, array):  # type: ignore[no-untyped-def]
    """Return the address of an array's data; passing it on avoids reference counting, which costs more than the work.

    The array itself must be used after the last use of the address.
    """

    def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
        return context.make_array(sig.args[0])(context, builder, args[0]).data

    return types.CPointer(array.dtype)(array), emit


@intrinsic
def beyond(typing, place, count):  # type: ignore[no-untyped-def]
    """Return the address `count` numbers further."""

    def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
        return builder.gep(args[0], [args[1]])

    return place(place, types.intp), emit


def _eight(builder: Any, place: Any, at: Any) -> Any:
    return builder.bitcast(builder.gep(place, [at]), _NUMBERS.as_pointer())


@intrinsic
def load(typing, place, at):  # type: ignore[no-untyped-def]
    """Return the eight numbers at an address plus `at`."""

    def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
        return builder.load(_eight(builder, *args), align=8)

    return vector(types.CPointer(types.float64), types.intp), emit


@intrinsic
def store(typing, place, at, value):  # type: ignore[no-untyped-def]
    """Write eight numbers to an address plus `at`."""

    def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
        builder.store(_spread(builder, args[2]), _eight(builder, *args[:2]), align=8)
        return context.get_dummy_value()

    kind = vector if value is vector else types.float64
    return types.none(types.CPointer(types.float64), types.intp, kind), emit


@intrinsic
def gather(typing, place, where_to):  # type: ignore[no-untyped-def]
    """Return numbers at an address plus a different offset in each lane."""

    def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
        found = ir.Constant(_NUMBERS, ir.Undefined)
        for k in range(LANES):
            lane = ir.Constant(ir.IntType(32), k)
            found = builder.insert_element(
                found, builder.load(builder.gep(args[0], [builder.extract_element(args[1], lane)])), lane
            )
        return found

    return vector(types.CPointer(types.float64), whole), emit


@intrinsic
def lane_numbers(typing):  # type: ignore[no-untyped-def]
    """Return the lane numbers 0, 1, 2 ..."""

    def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
        return ir.Constant(_WHOLES, [ir.Constant(ir.IntType(64), k) for k in range(LANES)])

    return whole(), emit


@intrinsic
def as_bits(typing, value):  # type: ignore[no-untyped-def]
    """Return the bit patterns of floats as integers."""

    def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
        return builder.bitcast(args[0], _WHOLES)

    return whole(vector), emit


@intrinsic
def of_bits(typing, value):  # type: ignore[no-untyped-def]
    """Return the floats of bit patterns."""

    def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
        return builder.bitcast(args[0], _NUMBERS)

    return vector(whole), emit


@intrinsic
def where(typing, which, there, elsewhere):  # type: ignore[no-untyped-def]
    """Return `there` in the lanes of a mask, `elsewhere` in the others; vectors, or scalars for all lanes."""

    def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
        return builder.select(args[0], _spread(builder, args[1]), _spread(builder, args[2]))

    result, number = (whole, types.int64) if whole in (there, elsewhere) else (vector, types.float64)
    return result(mask, *(result if each is result else number for each in (there, elsewhere))), emit


@intrinsic
def spread(typing, value):  # type: ignore[no-untyped-def]
    """Return a scalar in all lanes."""

    def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
        return _spread(builder, args[0])

    return vector(types.float64), emit


@intrinsic
def bits(typing, which):  # type: ignore[no-untyped-def]
    """Return a mask as an integer: bit k is lane k's."""

    def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
        return builder.zext(builder.bitcast(args[0], ir.IntType(LANES)), ir.IntType(64))

    return types.int64(mask), emit


@intrinsic
def masked(typing, which):  # type: ignore[no-untyped-def]
    """Return the mask of an integer's bits."""

    def emit(context, builder, sig, args):  # type: ignore[no-untyped-def]
        return builder.bitcast(builder.trunc(args[0], ir.IntType(LANES)), _TRUTHS)

    return mask(types.int64), emit
