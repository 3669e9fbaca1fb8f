"""exp(x) and x^(-1/3) without branches and calls, so that loops over them are vectorised."""

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.extending import intrinsic

FAST = {"reassoc", "contract", "arcp", "nsz"}  # infinite values are respected
_LARGEST = 700.0  # largest absolute exponent; larger ones are cut off
_LOG2_E = 1.4426950408889634
_LN2_HIGH, _LN2_LOW = 0.693145751953125, 1.4286068203094172e-06  # their sum is ln 2
# 1.5 * 2^52: if it is added to an integer, the last bits are that integer
_ROUND = 6755399441055744.0
_THIRD = 0x55555556  # 2^32 / 3
_GUESS = 0x553EF0FF  # the high word of x^(-1/3) is about this minus a third of that of x


@intrinsic
def _bits(_context, _x):
    """The bits of a double."""

    def build(_, builder, __, values):
        return builder.bitcast(values[0], ir.IntType(64))

    return types.int64(types.float64), build


@intrinsic
def _double(_context, _bits):
    """The double with these bits."""

    def build(_, builder, __, values):
        return builder.bitcast(values[0], ir.DoubleType())

    return types.float64(types.int64), build


@njit(cache=True, fastmath=FAST, error_model="numpy", inline="always")
def exponential(x: float) -> float:
    """e^x to 4 units in the last place for |x| <= 700; cut off at 700 for larger |x|."""
    x = min(max(x, -_LARGEST), _LARGEST)
    k = np.floor(x * _LOG2_E + 0.5)
    r = (x - k * _LN2_HIGH) - k * _LN2_LOW  # |r| <= ln 2 / 2
    p = 1 + r / 12
    p = 1 + r / 11 * p
    p = 1 + r / 10 * p
    p = 1 + r / 9 * p
    p = 1 + r / 8 * p
    p = 1 + r / 7 * p
    p = 1 + r / 6 * p
    p = 1 + r / 5 * p
    p = 1 + r / 4 * p
    p = 1 + r / 3 * p
    p = 1 + r / 2 * p
    p = 1 + r * p
    return p * _double((_bits(k + _ROUND) + 1023) << 52)


@njit(cache=True, fastmath=FAST, error_model="numpy", inline="always")
def inverse_cube_root(x: float) -> float:
    """x^(-1/3) to 4 units in the last place for normal positive x."""
    y = _double((_GUESS - (((_bits(x) >> 32) * _THIRD) >> 32)) << 32)
    for _ in range(3):  # third-order iteration, starting from an error of 4 %
        off = 1 - x * y * y * y
        y += y * off * (1 / 3 + off * (2 / 9))
    return y
