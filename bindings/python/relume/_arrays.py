# SPDX-License-Identifier: MIT
"""Arrays as the library takes them: handed over as they are where they fit, copied once where not."""
import ctypes
import operator
from ctypes import c_float, c_uint

import numpy
from numpy.typing import NDArray

Floats = NDArray[numpy.float32]


class ByValue:
    """Equal where the fields are, arrays of them included."""

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return all(map(numpy.array_equal, vars(self).values(), vars(other).values()))


def floats(name, values, width):
    """C-contiguous float32 of shape (n, width), or (n,) for width 1; the array itself where it is that already."""
    array = numpy.ascontiguousarray(values, dtype=numpy.float32)
    if width == 1:
        if array.ndim != 1:
            raise ValueError(f'{name}: shape (n,) expected, {array.shape} found')
    elif array.ndim != 2 or array.shape[1] != width:
        raise ValueError(f'{name}: shape (n, {width}) expected, {array.shape} found')
    return array


def three(name, value):
    """Three floats, from a sequence of three or from one number for all."""
    array = numpy.broadcast_to(numpy.asarray(value, dtype=numpy.float32), (3,)) if numpy.ndim(value) == 0 else numpy.asarray(
        value, dtype=numpy.float32)
    if array.shape != (3,):
        raise ValueError(f'{name}: three numbers expected, shape {array.shape} found')
    return (c_float * 3)(*array.tolist())


def pointer(array):
    return None if array is None else array.ctypes.data_as(ctypes.POINTER(c_float))


def output(name, out, shape, dtype=numpy.float32):
    """The array that a call writes: `out`, which must fit, or a new one."""
    if out is None:
        return numpy.empty(shape, dtype=dtype)
    fits = isinstance(out, numpy.ndarray) and out.shape == shape and out.dtype == dtype and out.flags.c_contiguous
    if not fits or not out.flags.writeable:
        raise ValueError(f'{name}: a writeable C-contiguous array of {numpy.dtype(dtype)}, shape {shape}, expected')
    return out


def aligned(data):
    """Bytes at an address that eight divides: `data`, or a copy."""
    if data.ctypes.data % 8 == 0:
        return data
    copy = numpy.empty(len(data) + 8, dtype=numpy.uint8)
    copy = copy[-copy.ctypes.data % 8:][:len(data)]
    copy[:] = data
    return copy


def same_length(**arrays):
    lengths = {name: len(array) for name, array in arrays.items() if array is not None}
    if len(set(lengths.values())) > 1:
        raise ValueError('arrays of one length expected: ' + ', '.join(f'{n} has {k}' for n, k in lengths.items()))


def indices(name, values, shape, limit):
    """C-contiguous uint32 of a shape, of which 0 stands for any length."""
    array = numpy.asarray(values)
    if array.ndim != len(shape) or any(want not in (0, have) for want, have in zip(shape, array.shape)):
        raise ValueError(f'{name}: shape {tuple(n or "n" for n in shape)} expected, {array.shape} found')
    if array.size and (array.dtype.kind not in 'iu' or array.min() < 0 or array.max() >= limit):
        raise ValueError(f'{name}: whole numbers from 0 to {limit - 1} expected')
    return numpy.ascontiguousarray(array, dtype=numpy.uint32)


def axes(name, matrix):
    """Twelve floats of a matrix for columns: its x, y and z axes, then the place."""
    array = numpy.eye(4) if matrix is None else numpy.asarray(matrix, dtype=numpy.float32)
    if array.shape not in ((3, 4), (4, 4)):
        raise ValueError(f'{name}: a matrix of shape (3, 4) or (4, 4) expected, {array.shape} found')
    for row in array[3:].tolist():
        if not all(abs(number - expected) <= 1e-5 for number, expected in zip(row, (0, 0, 0, 1))):
            raise ValueError(f'{name}: a matrix whose last row is (0, 0, 0, 1) expected, {tuple(row)} found; '
                             'transpose it, if its columns are rows')
    return (c_float * 12)(*array[:3].T.ravel().tolist())


def whole(name, value, limit=2 ** 32):
    """A whole number from 0; ctypes would cut off what does not fit."""
    number = operator.index(value) if hasattr(value, '__index__') else -1
    if not 0 <= number < limit:
        raise ValueError(f'{name}: a whole number from 0 to {limit - 1} expected, {value!r} found')
    return number


def uints(array):
    return array.ctypes.data_as(ctypes.POINTER(c_uint))
