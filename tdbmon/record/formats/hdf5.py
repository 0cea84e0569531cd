"""HDF5 files of any layout: channels as datasets with a sampling rate or time array, flat or in groups."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import h5py
import numpy as np

from tdbmon.record.channel import Content
from tdbmon.record.formats.stored_size import check_size
from tdbmon.record.tree import Branch, Leaf, channels_of, first_text, stated_date, stated_title

HDF5_MAGIC = b"\x89HDF\r\n\x1a\n"


class HDF5:
    """HDF5 files, in which numeric datasets are channels described by scalars, texts and attributes."""

    name = "HDF5"
    extra: str | None = None

    def recognises(self, head: bytes, path: Path) -> bool:
        return any(head[at : at + 8] == HDF5_MAGIC for at in (0, 512, 1024, 2048))

    def read(self, path: Path) -> Content:
        with h5py.File(path, "r") as file:
            root = branch_of(file, "")
        return Content(channels_of(root, path), stated_title(root.entries), stated_date(root.entries))


def branch_of(group: Any, name: str) -> Branch:
    """Return a group loaded into memory: numeric arrays become leaves, single values and texts entries."""
    entries: dict[str, Any] = _attributes(group)
    leaves: list[Leaf] = []
    branches: list[Branch] = []
    for key in group:
        if group.get(key, getlink=True).__class__ is not h5py.HardLink:
            continue  # soft and external links may leave the file or form cycles
        item = group[key]
        if isinstance(item, h5py.Group):
            branches.append(branch_of(item, key))
        elif isinstance(item, h5py.Dataset):
            check_size(item.nbytes, Path(item.file.filename), compressed=item.chunks is not None)
            text = h5py.check_string_dtype(item.dtype) is not None
            if item.dtype.names and item.ndim == 1:  # a compound table, stored row by row
                rows = np.asarray(item[()])
                columns = (Leaf(name, np.ascontiguousarray(rows[name])) for name in item.dtype.names)
                branches.append(Branch(key, tuple(columns), _attributes(item)))
            elif item.dtype.kind in "iufb" and item.size and item.size > 1:
                leaves.append(Leaf(key, np.asarray(item[()]), _attributes(item)))
            elif item.size == 1 and (text or item.dtype.kind in "iufb"):
                entries[key] = np.asarray(item[()]).reshape(-1)[0]
                if unit := first_text(_attributes(item), ("units", "unit")):
                    entries[f"{key} [{unit}]"] = entries.pop(key)
            elif text and item.ndim == 1 and item.size <= 10_000:
                entries[key] = list(item[()])
    return Branch(name, tuple(leaves), entries, tuple(branches))


def _attributes(item: Any) -> dict[str, Any]:
    out: dict[str, Any] = {}
    for key in item.attrs:
        try:
            out[key] = item.attrs[key]
        except Exception:  # attributes of types that h5py cannot convert are irrelevant here
            continue
    return out
