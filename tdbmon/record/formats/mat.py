"""MATLAB files: version 5 via scipy, version 7.3 (based on HDF5) via h5py."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
from tdbsim.errors import InputError

from tdbmon.record.channel import Channel, Content
from tdbmon.record.formats.hdf5 import HDF5_MAGIC
from tdbmon.record.formats.mat5_structure import check_structure
from tdbmon.record.formats.stored_size import check_size
from tdbmon.record.formats.testlab import with_plain_signals
from tdbmon.record.tree import Branch, Leaf, channels_of, stated_date, stated_title, text_of

_OPAQUE = ("s0", "s1", "s2", "arr")  # fields of an object as returned by scipy: name, object system, class, reference
_UNREAD = ("table", "timetable", "timeseries", "datetime", "duration")


class MAT:
    """MATLAB files with arrays and a time vector or rate, or structs of channels with their data, unit, rate or time."""

    name = "MAT"
    extra: str | None = None

    def recognises(self, head: bytes, path: Path) -> bool:
        return head.startswith(b"MATLAB ") and (head[126:128] in (b"IM", b"MI") or head[512:520] == HDF5_MAGIC)

    def read(self, path: Path) -> Content:
        with path.open("rb") as file:
            head = file.read(520)
        objects: dict[str, str] = {}
        root = with_plain_signals(
            _version_73(path, objects) if head[512:520] == HDF5_MAGIC else _version_5(path, objects)
        )
        untold = tuple(Channel(name, np.empty(0), fault=f"it is {what}") for name, what in objects.items())
        try:
            channels = channels_of(root, path)
        except InputError as error:
            told = "".join(f"; '{name}' is {what}" for name, what in objects.items())
            raise InputError(f"{error}{told}") from None
        return Content(channels + untold, stated_title(root.entries), stated_date(root.entries))


def _object(kind: str) -> str:
    return (
        f"a MATLAB {kind}, which only MATLAB can read: save numbers, as in time = seconds(T.Time); NDE_A = T.NDE_A;"
        " save('record.mat', 'time', 'NDE_A')"
    )


def _version_5(path: Path, objects: dict[str, str]) -> Branch:
    from scipy.io import loadmat

    check_structure(path)
    content = loadmat(path, struct_as_record=True, squeeze_me=False, chars_as_strings=True)
    return _branch("", {key: value for key, value in content.items() if not key.startswith("__")}, objects)


def _branch(name: str, fields: dict[str, Any], objects: dict[str, str]) -> Branch:
    leaves: list[Leaf] = []
    entries: dict[str, Any] = {}
    branches: list[Branch] = []
    for key, value in fields.items():
        array = np.asarray(value)
        if array.dtype.names == _OPAQUE:
            for called, _, kind, _ in array.reshape(-1):
                if (stated := text_of(kind)) in _UNREAD:
                    objects[text_of(called) or key] = _object(stated)
        elif array.dtype.names:  # a struct, or an array of structs
            records = array.reshape(-1)
            for k, record in enumerate(records):
                inner = {field: record[field] for field in array.dtype.names}
                branches.append(_branch(key if records.size == 1 else f"{key}_{k + 1}", inner, objects))
        elif array.dtype.kind in "US":
            texts = [str(text) for text in array.reshape(-1)]
            entries[key] = texts[0] if len(texts) == 1 else texts
        elif array.dtype.kind == "O":  # a cell array of texts or numbers
            entries[key] = [_cell_text(cell) for cell in array.reshape(-1)]
        elif array.dtype.kind in "iufb":
            if array.size == 1:
                entries[key] = array.reshape(-1)[0]
            elif array.size:
                leaves.append(Leaf(key, array))
    return Branch(name, tuple(leaves), entries, tuple(branches))


def _cell_text(cell: Any) -> str:
    array = np.asarray(cell)
    return str(array.reshape(-1)[0]) if array.dtype.kind in "US" and array.size else ""


def _version_73(path: Path, objects: dict[str, str]) -> Branch:
    with h5py.File(path, "r") as file:
        return _group_73(file, file, "", objects)


def _group_73(items: Mapping[str, Any], file: Any, name: str, objects: dict[str, str]) -> Branch:
    """Return a struct or the variables of a file as a branch; in an array of structs every field is an array of references."""
    leaves: list[Leaf] = []
    entries: dict[str, Any] = {}
    branches: list[Branch] = []
    fields: dict[str, list[Any]] = {}
    for key in items:
        if key.startswith("#"):
            continue  # groups in which MATLAB stores the targets of references
        item = items[key]
        if not hasattr(item, "dtype"):
            branches.append(_group_73(item, file, key, objects))
        elif "MATLAB_object_decode" in item.attrs:
            if (stated := text_of(item.attrs.get("MATLAB_class", b""))) in _UNREAD:
                objects[key] = _object(stated)
        elif item.dtype.kind == "O":
            fields[key] = [file[reference] for reference in np.asarray(item[()]).reshape(-1)]
            if all(_is_text(target) for target in fields[key]):
                entries[key] = [_text_73(target) for target in fields[key]]
        elif _is_text(item):
            entries[key] = _text_73(item)
        elif "MATLAB_empty" in item.attrs or item.dtype.kind not in "iufb":
            continue
        elif item.size == 1:
            entries[key] = np.asarray(item[()]).reshape(-1)[0]
        elif item.size:
            check_size(item.nbytes, Path(item.file.filename), compressed=item.chunks is not None)
            leaves.append(Leaf(key, np.asarray(item[()])))
    if name and not leaves and len(fields) > 1 and len({len(targets) for targets in fields.values()}) == 1:
        structs = (dict(zip(fields, targets, strict=True)) for targets in zip(*fields.values(), strict=True))
        inner = [_group_73(struct, file, f"{name}_{k}", objects) for k, struct in enumerate(structs, start=1)]
        return Branch(name, (), {}, (*branches, *inner))
    return Branch(name, tuple(leaves), entries, tuple(branches))


def _is_text(item: Any) -> bool:
    return hasattr(item, "dtype") and item.attrs.get("MATLAB_class", b"") == b"char" and item.dtype.kind in "iu"


def _text_73(item: Any) -> str:
    if "MATLAB_empty" in item.attrs:
        return ""
    try:
        return "".join(chr(code) for code in np.asarray(item[()]).reshape(-1, order="F"))
    except ValueError as error:
        raise InputError(f"text '{item.name}' is damaged: {error}") from None
