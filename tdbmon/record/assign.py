"""Assign a record's channels to the probes, speed and keyphasor of a machine."""

from __future__ import annotations

import numpy as np
import xarray as xr
from tdbsim.errors import InputError, did_you_mean
from tdbsim.machine import Machine, Probe
from tdbsim.units import is_unit, scale

from tdbmon.record.dataset import as_record
from tdbmon.record.held_speed import speed_at_updates
from tdbmon.record.held_values import at_own_rates
from tdbmon.record.one_time import on_one_time
from tdbmon.record.timebase import split_unit

_PAUSE = 0.5  # s
_SENSITIVITY = 'sensitivity = "7.87 mV/um"'
_NO_UNIT, _IN_VOLTS = "without a unit", "in V without a sensitivity"

_QUANTITIES = {
    "m": "a displacement", "Hz": "a speed or frequency", "V": "a voltage", "s": "a time", "rad": "an angle",
    "m/s": "a velocity", "m/s^2": "an acceleration", "N": "a force", "A": "a current", "1": "a plain number",
}  # fmt: skip


def assign(ds: xr.Dataset, machine: Machine) -> xr.Dataset:
    """Rename a record's channels to the machine's names and convert volts to displacement and speed.

    Parameters
    ----------
    ds : xarray.Dataset
        A record as `tdbmon.record.read.read` returns it, or any Dataset of channels along time with ``units``.
    machine : tdbsim.machine.Machine
        Its probes, ``speed``, ``keyphasor`` and ``[channels]`` define the meaning of each channel.

    Returns
    -------
    xarray.Dataset
        Probes in m, positive along the probe's axis; ``speed`` in Hz; ``keyphasor`` as recorded.  The attribute
        ``missing`` lists machine names not found in the file, ``unused`` the file's channels that were dropped.

    Raises
    ------
    InputError
        If the file contains none of the machine's channels, a channel is of the wrong quantity or without a usable unit,
        one channel of the file is assigned twice, or a time base has a gap of half a second or more.
    """
    source = str(ds.attrs.get("source_file", "record"))
    wanted = {name: machine.channel_in_file(name) for name in machine.channel_names()}
    located = {name: _variable_of(channel, ds) for name, channel in wanted.items()}
    found = {name: variable for name, variable in located.items() if variable is not None}
    if not found:
        raise InputError(_nothing_found(source, ds, wanted))
    _once(source, found)
    whole, ds = ds, as_record(ds[list(found.values())])
    for dimension in dict.fromkeys(ds[channel].dims[0] for channel in found.values()):
        _without_pause(ds[dimension].values, source)
    probes = {probe.name: probe for probe in machine.probes}
    data: dict[str, xr.DataArray] = {}
    lacking: list[_Lacks] = []
    for name, channel in found.items():
        array = ds[channel]
        place = f"{source}: channel '{channel}'" + (f" ({name})" if name != channel else "")
        try:
            if name in probes:
                data[name] = _displacement(array, probes[name], place)
            elif name == "speed":
                data[name] = _speed(array, machine, place)
            else:
                data[name] = array
        except _Lacks as lack:
            lacking.append(lack)
    if lacking:
        raise InputError(str(lacking[0]) if len(lacking) == 1 else _all_lacking(source, lacking))
    laid = xr.Dataset(
        {name: array.variable for name, array in data.items()}, {dimension: ds[dimension] for dimension in ds.sizes}
    )
    laid, remarks = at_own_rates(laid, [name for name in data if name in probes])
    laid, slow = speed_at_updates(laid)
    laid, moved = on_one_time(laid, machine)
    remarks += slow + moved
    out = _with_times_in_order(laid)
    out.attrs = dict(ds.attrs)
    out.attrs["missing"] = [name for name in wanted if name not in data]
    used = {found[name] for name in data}
    out.attrs["unused"] = [str(name) for name in whole.data_vars if name not in used]
    if remarks:
        out.attrs["time_remarks"] = remarks
    return out


class _Lacks(InputError):
    """Raised for a channel without unit or sensitivity, which an entry in the machine file can supply."""

    def __init__(self, message: str, place: str, what: str, entry: str) -> None:
        super().__init__(message)
        self.channel, self.what, self.entry = place.partition(": channel ")[2], what, entry


def _all_lacking(source: str, lacking: list[_Lacks]) -> str:
    """Return one message for all channels that lack a unit or sensitivity, so that one edit of the machine file suffices."""
    said = []
    for what in dict.fromkeys(each.what for each in lacking):
        of_kind = [each for each in lacking if each.what == what]
        entries = " and ".join(dict.fromkeys(each.entry for each in of_kind))
        said.append(
            f"{', '.join(each.channel for each in of_kind)} {what}: give it in the machine file, e.g. {entries}"
        )
    return f"{source}: channels {'; '.join(said)}"


def _variable_of(channel: str, ds: xr.Dataset) -> str | None:
    """Return the record's variable for a channel name; None if there is none.

    The name may include the group (``Ai0/Vib_X``) even if the variable does not.  A channel named by its label is also found
    by the name under which the file stores it, with or without the group, if only one channel matches.  A channel whose name in
    the file ends with its unit (``NDE_A_um``) is found by that name too.
    """
    if channel in ds.data_vars:
        return channel
    group, _, bare = channel.rpartition("/")
    if group and bare in ds.data_vars and ds[bare].attrs.get("group") == group:
        return bare
    stored = [
        str(name) for name, array in ds.data_vars.items() if f"/{array.attrs.get('stored', '')}".endswith(f"/{channel}")
    ]
    if len(stored) == 1:
        return stored[0]
    without_unit = split_unit(channel)[0]
    return _variable_of(without_unit, ds) if without_unit != channel else None


def _nothing_found(source: str, ds: xr.Dataset, wanted: dict[str, str]) -> str:
    held = [str(name) for name in ds.data_vars]
    shown = ", ".join(f"'{name}'" for name in held[:20]) + (f" and {len(held) - 20} more" if len(held) > 20 else "")
    hints = {name: did_you_mean(name, held) for name in wanted.values()}
    near = next((f" ('{name}' expected{hint})" for name, hint in hints.items() if "did you mean" in hint), "")
    example = next(iter(wanted), "NDE_A")
    return (
        f"{source}: none of the machine's channels is in the file; it has {shown or 'no channel'}{near}; assign the channels in"
        f' the machine file: [channels] {example} = "{held[0] if held else "name in the file"}"'
    )


def _once(source: str, found: dict[str, str]) -> None:
    taken: dict[str, str] = {}
    for name, channel in found.items():
        if channel in taken:
            raise InputError(
                f"{source}: '{taken[channel]}' and '{name}' are both assigned channel '{channel}';"
                " correct [channels] in the machine file"
            )
        taken[channel] = name


def _displacement(array: xr.DataArray, probe: Probe, place: str) -> xr.DataArray:
    units = array.attrs.get("units", "")
    if units == "m":
        return array
    if _unstated(units) and probe.unit is not None:
        if not _is_voltage(probe.unit):
            return _rescaled(array, scale(probe.unit, "m"), 0.0, "m")
        array, units = _rescaled(array, scale(probe.unit, "V"), 0.0, "V"), "V"
    if units == "V" or (units in ("", "1") and probe.sensitivity is not None):
        if probe.sensitivity is None:
            said = (
                f"{place} is in V; give probe '{probe.name}' its sensitivity in the machine file, e.g. {_SENSITIVITY}"
            )
            raise _Lacks(said, place, _IN_VOLTS, f"{_SENSITIVITY} for each probe")
        return _rescaled(array, 1.0 / probe.sensitivity, -probe.offset / probe.sensitivity, "m")
    if units in ("", "1"):
        said = (
            f"{place} has no unit; write one into the file, or give it for probe '{probe.name}' in the machine file,"
            f' e.g. unit = "um", or {_SENSITIVITY} for volts'
        )
        raise _Lacks(said, place, _NO_UNIT, f'unit = "um" (or {_SENSITIVITY} for volts) for each probe')
    cure = _wrong(units, "m", f"unit = \"um\" for probe '{probe.name}'")
    raise InputError(f"{place} is {_quantity(array)}, but a displacement in m, um, mil or V is needed; {cure}")


def _speed(array: xr.DataArray, machine: Machine, place: str) -> xr.DataArray:
    units = array.attrs.get("units", "")
    signal = machine.speed
    if units == "Hz":
        return array
    if _unstated(units) and signal is not None and signal.unit is not None:
        units = signal.unit
        if not _is_voltage(units):
            return _rescaled(array, scale(units, "Hz"), 0.0, "Hz")
    if _is_voltage(units):
        if signal is None or signal.sensitivity is None:
            entry = '[speed] sensitivity = "1 mV/rpm"'
            said = f"{place} is in V; give its sensitivity in the machine file, e.g. {entry}"
            raise _Lacks(said, place, _IN_VOLTS, entry)
        return _rescaled(array, scale(units, "V") / signal.sensitivity, 0.0, "Hz")
    if units in ("", "1"):
        entry = '[speed] unit = "rpm"'
        said = f"{place} has no unit; write one into the file or into the machine file, e.g. {entry}"
        raise _Lacks(said, place, _NO_UNIT, entry)
    cure = _wrong(units, "Hz", '[speed] unit = "rpm"')
    raise InputError(f"{place} is {_quantity(array)}, but a speed in Hz, rpm, rad/s or V is needed; {cure}")


def _is_voltage(unit: str) -> bool:
    try:
        scale(unit, "V")
    except InputError:
        return False
    return True


def _quantity(array: xr.DataArray) -> str:
    units = array.attrs.get("units", "")
    name = _QUANTITIES.get(units)
    return f"{name} ({array.attrs.get('source_units') or units})" if name else f"in '{units}'"


def _unstated(units: str) -> bool:
    """Tell whether a file leaves a channel's unit undefined: none stated, or a text that is not a unit."""
    return units in ("", "1") or not is_unit(units)


def _wrong(units: str, si: str, stated: str) -> str:
    if units in _QUANTITIES:
        return "is it the right channel? correct [channels] in the machine file, or the unit in the file"
    try:
        scale(units, si)
    except InputError as error:
        said = f"; or state the unit in the machine file, e.g. {stated}" if _unstated(units) else ""
        return f"{error}{said}"
    return "correct the unit in the file"


def _rescaled(array: xr.DataArray, factor: float, offset: float, units: str) -> xr.DataArray:
    """Return ``array * factor + offset`` in another unit, with the full scale converted likewise."""
    out = xr.DataArray(array.values * factor + offset, dims=array.dims, attrs=dict(array.attrs))
    out.attrs["units"] = units
    if "full_scale" in out.attrs:
        out.attrs["full_scale"] = sorted(float(limit * factor + offset) for limit in out.attrs["full_scale"])
    return out


def _without_pause(time: np.ndarray, source: str) -> None:
    """Reject a time base with a long gap, across which speeds and frequencies would be computed wrongly."""
    steps = np.diff(time)
    if steps.size == 0:
        return
    at = int(np.argmax(steps))
    if steps[at] > max(_PAUSE, 3 * float(np.median(steps))):
        raise InputError(
            f"{source}: no samples for {steps[at]:.6g} s after {time[at]:.6g} s; cut the record there and give the part"
            " with the drop"
        )


def _with_times_in_order(ds: xr.Dataset) -> xr.Dataset:
    """Return a record with time bases renumbered from ``time``, unused ones dropped and infinite samples set to NaN."""
    dimensions = dict.fromkeys(array.dims[0] for array in ds.data_vars.values())
    names = {old: "time" if i == 0 else f"time_{i + 1}" for i, old in enumerate(dimensions)}
    out = xr.Dataset(coords={new: (new, ds[old].values, ds[old].attrs) for old, new in names.items()})
    for name, array in ds.data_vars.items():
        values = np.asarray(array.values)
        if np.isinf(values).any():
            values = np.where(np.isinf(values), np.nan, values)
        out[name] = (names[array.dims[0]], values, dict(array.attrs))
        out[name].encoding = dict(array.encoding)
    return out
