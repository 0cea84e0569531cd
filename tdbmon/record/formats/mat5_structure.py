"""Structural validation of version 5 MAT files before their values are read.

scipy's reader uses type codes from the file as table indices without bounds checks: a damaged code crashes the interpreter
instead of raising.  The layout follows "MAT-File Format", The MathWorks, 2023, chapter 1.
"""

from __future__ import annotations

import math
import zlib
from pathlib import Path
from typing import Literal

_TYPES = {1, 2, 3, 4, 5, 6, 7, 9, 12, 13, 14, 15, 16, 17, 18}
_MATRIX, _COMPRESSED, _UINT32, _INT32, _INT8, _UTF8 = 14, 15, 6, 5, 1, 16
_HOLDING_ARRAYS = (1, 2, 3, 16)  # cell, struct, object, function handle
_SPARSE, _OPAQUE = 5, 17
_CLASSES = range(1, 19)
_NUMBERS = _TYPES - {_MATRIX, _COMPRESSED}
_COMPLEX = 0x08
_FLAGS_BYTE = {"little": 1, "big": 2}
_DEEPEST = 32

_Order = Literal["little", "big"]


def check_structure(path: Path) -> None:
    """Check the type, class and size of all elements of a file.

    Raises
    ------
    ValueError
        If a type code, class code or size is invalid, or an element is truncated.
    """
    raw = memoryview(path.read_bytes())
    order: _Order = "little" if raw[126:128] == b"IM" else "big"
    at = 128
    while at < len(raw):
        kind, body, at = _element(raw, at, order)
        if kind == _COMPRESSED:
            kind, body, _ = _element(memoryview(zlib.decompress(body)), 0, order)
        if kind == _MATRIX:
            _check_matrix(body, order, 0)


def _element(raw: memoryview, at: int, order: _Order) -> tuple[int, memoryview, int]:
    """Return type, content and end (including padding) of the element at offset `at`."""
    if at + 8 > len(raw):
        raise ValueError("an element is cut off")
    word, length = (int.from_bytes(raw[i : i + 4], order) for i in (at, at + 4))
    if word >> 16:  # a small element: size and type share one word
        kind, size, start, end = word & 0xFFFF, word >> 16, at + 4, at + 8
        if size > 4:
            raise ValueError(f"a small element of {size} bytes")
    else:
        kind, size, start = word, length, at + 8
        end = start + size if kind == _COMPRESSED else start + (size + 7) // 8 * 8
    if kind not in _TYPES:
        raise ValueError(f"unknown data type {kind}")
    if start + size > len(raw):
        raise ValueError("an element is cut off")
    return kind, raw[start : start + size], end


def _check_matrix(body: memoryview, order: _Order, depth: int) -> None:
    if not body:
        return  # an empty matrix
    if depth > _DEEPEST:
        raise ValueError("arrays are nested too deeply")
    kind, flags, at = _element(body, 0, order)
    matrix_class = int.from_bytes(flags[:4], order) & 0xFF
    if kind != _UINT32 or len(flags) != 8 or matrix_class not in _CLASSES:
        raise ValueError(f"unknown class of array {matrix_class}")
    if matrix_class != _OPAQUE:  # opaque arrays have neither dimensions nor a name
        kind, dimensions, at = _element(body, at, order)
        if kind not in (_INT32, _UINT32) or len(dimensions) % 4:
            raise ValueError("an array without dimensions")
        lengths = [int.from_bytes(dimensions[i : i + 4], order) for i in range(0, len(dimensions), 4)]
        if matrix_class != _SPARSE and math.prod(lengths) > len(
            body
        ):  # every number and every cell takes at least one byte
            raise ValueError(f"an array of {math.prod(lengths)} elements in {len(body)} bytes")
        kind, _, at = _element(body, at, order)
        if kind not in (_INT8, _UTF8):
            raise ValueError("an array without a name")
    parts = []
    while at < len(body):
        kind, inner, at = _element(body, at, order)
        parts.append(kind)
        if kind == _MATRIX:
            _check_matrix(inner, order, depth + 1)
    if matrix_class == _OPAQUE:
        return
    if matrix_class in _HOLDING_ARRAYS:
        names = parts[: next((i for i, part in enumerate(parts) if part == _MATRIX), len(parts))]
        if len(names) > 3 or set(parts[len(names) :]) - {_MATRIX}:
            raise ValueError("a struct or cell array with something else than arrays in it")
        return
    expected = (3 if matrix_class == _SPARSE else 1) + (1 if flags[_FLAGS_BYTE[order]] & _COMPLEX else 0)
    if len(parts) != expected or set(parts) - _NUMBERS:
        raise ValueError(f"an array of class {matrix_class} with parts {parts}")
