"""Signals exported by Simcenter Testlab (LMS Test.Lab) to MATLAB files, each a struct with three fields.

``x_values`` has ``start_value`` and ``increment``, or ``values``, and ``quantity.label``: "s", or "Hz" for a spectrum.
``y_values`` has ``values``, one column per channel, and ``quantity.label``: their unit.
``function_record`` has ``name`` and ``creation_time``, one text per channel.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from tdbmon.record.timebase import time_factor
from tdbmon.record.tree import Branch, Leaf, first_text

_NOTHING = Branch("", ())
_AXIS = {"start_value": "t0", "increment": "dt"}


def with_plain_signals(root: Branch) -> Branch:
    """Return the content of a file with Testlab signals, if any, converted to arrays with their time or sampling interval."""
    created = [_first(branch, "creation_time") for branch in root.branches if _is_signal(branch)]
    return replace(
        root,
        entries={"date": created[0], **root.entries} if created else root.entries,
        branches=tuple(_plain(branch) if _is_signal(branch) else branch for branch in root.branches),
    )


def _is_signal(branch: Branch) -> bool:
    return {"x_values", "y_values"} <= {inner.name for inner in branch.branches}


def _plain(signal: Branch) -> Branch:
    x, y = _inner(signal, "x_values"), _inner(signal, "y_values")
    axis = _label(x) or "s"
    along_time = time_factor(axis) is not None  # a spectrum has no time and is reported but not read
    times = [Leaf("time", leaf.values, {"units": axis}) for leaf in x.leaves if leaf.name == "values" and along_time]
    entries = {f"{name} [{axis}]": x.entries[key] for key, name in _AXIS.items() if key in x.entries and along_time}
    names = _inner(signal, "function_record").entries.get("name")
    named: dict[str, Any] = (
        {"names": names} if isinstance(names, list) and len(names) > 1 else {"name": _first(signal, "name")}
    )
    values = [replace(leaf, attributes={**named, "units": _label(y)}) for leaf in y.leaves if leaf.name == "values"]
    return Branch(signal.name, (*times, *values), entries)


def _inner(branch: Branch, name: str) -> Branch:
    return next((inner for inner in branch.branches if inner.name == name), _NOTHING)


def _label(values: Branch) -> str:
    return first_text(_inner(values, "quantity").entries, ("label",)) or ""


def _first(signal: Branch, key: str) -> str:
    """Return an entry of ``function_record``, for several channels that of the first; "" if there is none."""
    told = _inner(signal, "function_record").entries.get(key, "")
    return str(told[0] if isinstance(told, list) and told else told)
