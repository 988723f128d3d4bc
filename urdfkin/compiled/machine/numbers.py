"""Number types for compiled code: one double, a vector of doubles, or a constant known at compile time.

| Type or function | Value |
|---|---|
| `Lanes(1)` | one double |
| `Lanes(8)` | eight doubles in one vector register |
| `Product` | two factors, multiplied only when the product is needed |
| `zero()`, `one()` | 0 and 1, known at compile time |
| `unused()` | placeholder for a number that is not needed |

In the sum x y + z, the product and the sum are one fused multiply-add, which is rounded only once. This
module, and not the compiler, decides which operations are fused. Results with `Lanes(1)` and `Lanes(8)` are
therefore exactly the same doubles, on every machine.

Each operation with `unused()` gives `unused()`. Operations with constants are simplified at compile time.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.imputils import lower_cast
from numba.core.typeconv.castgraph import Conversion
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, lower_builtin, models, register_model

_DOUBLE = ir.DoubleType()


class Lanes(types.Type):
    def __init__(self, width: int) -> None:
        self.width = width
        super().__init__(name=f"Lanes({width})")

    def can_convert_from(self, context: Any, other: Any) -> Any:
        return Conversion.safe if isinstance(other, Product) and other.width == self.width else None

    def unify(self, context: Any, other: Any) -> Any:
        return self if isinstance(other, Product) and other.width == self.width else None


class Product(types.Type):
    def __init__(self, width: int) -> None:
        self.width = width
        super().__init__(name=f"Product({width})")

    def unify(self, context: Any, other: Any) -> Any:
        return other if isinstance(other, Lanes) and other.width == self.width else None


class ConstantNumber(types.Type):
    """Type of `zero()`, `one()` and `unused()`.

    The value at compile time is 0, 1 or None.
    """

    def __init__(self, value: int | None) -> None:
        self.value = value
        super().__init__(name=f"ConstantNumber({value})")


ZERO, ONE, UNUSED = ConstantNumber(0), ConstantNumber(1), ConstantNumber(None)


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, dmm: Any, fe_type: Any) -> None:
        super().__init__(dmm, fe_type, ir.VectorType(_DOUBLE, fe_type.width))


@register_model(Product)
class _ProductModel(models.StructModel):
    def __init__(self, dmm: Any, fe_type: Any) -> None:
        number = Lanes(fe_type.width)
        super().__init__(dmm, fe_type, [("x", number), ("y", number)])


@register_model(ConstantNumber)
class _ConstantNumberModel(models.OpaqueModel):
    pass


# -- arithmetic: result types and code generation ---------------------------------------------------


class _Value:
    def __init__(self, context: Any, builder: Any, type_: Any, value: Any) -> None:
        self.context, self.builder, self.type = context, builder, type_
        self.value = value

    @property
    def is_product(self) -> bool:
        return isinstance(self.type, Product)

    def factors(self) -> tuple[Any, Any]:
        pair = cgutils.create_struct_proxy(self.type)(self.context, self.builder, value=self.value)
        return pair.x, pair.y

    def number(self, width: int) -> Any:
        if self.is_product:
            return self.builder.fmul(*self.factors())
        if isinstance(self.type, ConstantNumber):
            return ir.Constant(ir.VectorType(_DOUBLE, width), [float(self.type.value or 0)] * width)
        if isinstance(self.type, types.Integer):
            return build_broadcast(self.builder, self.builder.sitofp(self.value, _DOUBLE), width)
        return self.value


def build_broadcast(builder: Any, double: Any, width: int) -> Any:
    empty = ir.Constant(ir.VectorType(_DOUBLE, width), ir.Undefined)
    first = builder.insert_element(empty, double, ir.Constant(ir.IntType(32), 0))
    mask = ir.Constant(ir.VectorType(ir.IntType(32), width), [0] * width)
    return builder.shuffle_vector(first, empty, mask)


def build_fma(builder: Any, x: Any, y: Any, z: Any) -> Any:
    function = builder.module.globals.get(name := f"llvm.fma.v{x.type.count}f64")
    if function is None:
        function = ir.Function(builder.module, ir.FunctionType(x.type, [x.type] * 3), name)
    return builder.call(function, (x, y, z))


def _width(*kinds: Any) -> int | None:
    return next((kind.width for kind in kinds if isinstance(kind, Lanes | Product)), None)


def _is_constant(kind: Any, value: int | None) -> bool:
    return isinstance(kind, ConstantNumber) and kind.value == value


def _are_supported(*kinds: Any) -> bool:
    ours = [isinstance(kind, Lanes | Product | ConstantNumber) for kind in kinds]
    return any(ours) and all(
        mine or isinstance(kind, types.Integer) for mine, kind in zip(ours, kinds, strict=True)
    )


def _product_type(x: Any, y: Any) -> Any:
    if _is_constant(x, None) or _is_constant(y, None):
        return UNUSED
    if _is_constant(x, 0) or _is_constant(y, 0):
        return ZERO
    if _is_constant(x, 1):
        return y
    if _is_constant(y, 1):
        return x
    return Product(_width(x, y) or 1)


def _sum_type(x: Any, y: Any) -> Any:
    if _is_constant(x, None) or _is_constant(y, None):
        return UNUSED
    if _is_constant(y, 0):
        return x
    if _is_constant(x, 0):
        return y
    width = _width(x, y)
    return None if width is None else Lanes(width)


def _difference_type(x: Any, y: Any) -> Any:
    return _negative_type(y) if _is_constant(x, 0) and not _is_constant(y, None) else _sum_type(x, y)


def _negative_type(x: Any) -> Any:
    return None if _is_constant(x, 1) else x


_RESULT_TYPES: dict[Any, Callable[..., Any]] = {
    operator.mul: _product_type,
    operator.add: _sum_type,
    operator.sub: _difference_type,
    operator.neg: _negative_type,
}


def _register_types(operation: Any, result: Callable[..., Any]) -> None:
    @infer_global(operation)
    class _Template(AbstractTemplate):
        def generic(self, args: Any, kws: Any) -> Any:
            if not args or not _are_supported(*args):
                return None
            kind = result(*args)
            return None if kind is None else signature(kind, *args)


for _operation, _result in _RESULT_TYPES.items():
    _register_types(_operation, _result)


def _wrap_values(context: Any, builder: Any, signature: Any, arguments: Any) -> list[_Value]:
    return [_Value(context, builder, *pair) for pair in zip(signature.args, arguments, strict=True)]


def _build_product(context: Any, builder: Any, kind: Product, x: Any, y: Any) -> Any:
    pair = cgutils.create_struct_proxy(kind)(context, builder)
    pair.x, pair.y = x, y
    return pair._getvalue()


def _lower_mul(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    x, y = _wrap_values(context, builder, signature, arguments)
    kind = signature.return_type
    if isinstance(kind, ConstantNumber):
        return context.get_dummy_value()
    if isinstance(x.type, ConstantNumber):
        return y.value
    if isinstance(y.type, ConstantNumber):
        return x.value
    return _build_product(context, builder, kind, x.number(kind.width), y.number(kind.width))


def as_number(context: Any, builder: Any, kind: Any, value: Any, width: int) -> Any:
    """Return a number as an LLVM vector; `unused()` is not allowed."""
    return _Value(context, builder, kind, value).number(width)


def _negate(context: Any, builder: Any, x: _Value) -> Any:
    if isinstance(x.type, ConstantNumber):
        return context.get_dummy_value()
    if x.is_product:
        first, second = x.factors()
        return _build_product(context, builder, x.type, builder.fneg(first), second)
    return builder.fneg(x.value)


def _lower_sum(*, negative: bool) -> Callable[..., Any]:
    """Return the function that generates code for x + y, or for x - y if `negative`."""

    def lower(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        def apply_sign(value: Any) -> Any:
            return builder.fneg(value) if negative else value

        x, y = _wrap_values(context, builder, signature, arguments)
        if _is_constant(signature.return_type, None):
            return context.get_dummy_value()
        if _is_constant(y.type, 0):
            return x.value
        if _is_constant(x.type, 0):
            return _negate(context, builder, y) if negative else y.value
        width = signature.return_type.width
        if y.is_product:
            first, second = y.factors()
            return build_fma(builder, apply_sign(first), second, x.number(width))
        if x.is_product:
            return build_fma(builder, *x.factors(), apply_sign(y.number(width)))
        return builder.fadd(x.number(width), apply_sign(y.number(width)))

    return lower


def _lower_neg(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    (x,) = _wrap_values(context, builder, signature, arguments)
    return _negate(context, builder, x)


_OPERAND_TYPES = (Lanes, Product, ConstantNumber, types.Integer)
for _x in _OPERAND_TYPES:
    for _y in _OPERAND_TYPES:
        if _x is _y is types.Integer:
            continue
        lower_builtin(operator.mul, _x, _y)(_lower_mul)
        lower_builtin(operator.add, _x, _y)(_lower_sum(negative=False))
        lower_builtin(operator.sub, _x, _y)(_lower_sum(negative=True))
for _x in (Lanes, Product, ConstantNumber):
    lower_builtin(operator.neg, _x)(_lower_neg)


def _multiply(context: Any, builder: Any, fromty: Any, toty: Any, value: Any) -> Any:
    return as_number(context, builder, fromty, value, toty.width)


lower_cast(Product, Lanes)(_multiply)


def _make_constant(kind: ConstantNumber) -> Any:
    @intrinsic
    def make_number(context: Any) -> Any:
        return kind(), lambda context, builder, signature, arguments: context.get_dummy_value()

    return make_number


zero, one, unused = map(_make_constant, (ZERO, ONE, UNUSED))


@intrinsic
def round_product(context: Any, x: Any) -> Any:
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        if not isinstance(x, Product):
            return arguments[0]
        return as_number(context, builder, x, arguments[0], x.width)

    return (Lanes(x.width) if isinstance(x, Product) else x)(x), generate
