# SPDX-License-Identifier: MIT
"""Arrays as the library takes them: handed over as they are where they fit, copied once where not."""
import ctypes
from ctypes import c_float

import numpy


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
