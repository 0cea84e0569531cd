"""Checks of the speed: speed signal, keyphasor and the 1X line of the levitated shaft must agree."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import xarray as xr
from tdbsim.errors import InputError
from tdbsim.machine import Machine

from tdbmon.quantity import percent
from tdbmon.record import faults
from tdbmon.record.finding import Check
from tdbmon.record.keyphasor import Pulses, pulses_if_any, sampling_for_pulses, speed, stated_over_counted
from tdbmon.record.lagging_speed import lag
from tdbmon.record.levitated_lines import STRONG, WIDTH, LevitatedLines, levitated_lines
from tdbmon.record.miscounted import Miscounted, miscounted
from tdbmon.record.misscaled_speed import true_speed
from tdbmon.record.samples import known_samples, times_of
from tdbmon.record.speed_spikes import without_speed_spikes

STANDSTILL_HZ = 1.0  # below it the shaft is at standstill, and a speed signal is noise
_SPEED_LIMIT = 3000.0  # Hz: 180 000 rpm
_SAME = 0.03  # relative: largest difference between two equal speeds
_FEWEST_TURNS = 4  # revolutions with both signal and pulses needed for a comparison
_STRONGER = 25.0  # times the power at the stated speed if no second channel contradicts that speed
_LIKELIER = 4.0  # times the power at the other of two differing speeds: twice the amplitude, as 1X relative to 2X
_UNITS = {
    60.0: "rpm written as Hz",
    1 / 60: "Hz written as rpm",
    2 * np.pi: "rad/s written as Hz",
    1 / (2 * np.pi): "Hz written as rad/s",
    2 * np.pi / 60: "rad/s written as rpm",
    60 / (2 * np.pi): "rpm written as rad/s",
}
_COUNTS = {2.0: "two pulses per revolution in the speed signal", 0.5: "two marks per revolution on the shaft"}
_WHEELS = {1 / n: f"{n} pulses per revolution (pulses_per_revolution = {n} in [keyphasor])" for n in range(3, 49)}
_CLOCKS = {1000.0: "time in ms read as s", 1 / 1000: "time in s read as ms", 60.0: "time in s read as min"}
_NEARLY, _EXACTLY = 0.03, 0.01  # relative tolerance of a fault's factor; narrower for toothed wheels, whose counts are integers
_NEAR = 0.3  # relative difference between two speeds too small to be explained by miscounted marks
_CHECK = "check unit and sensitivity of the speed signal"
_CLOCK = "sampling rate and unit of time"
_AT_REST, _FLOOR = 0.002, 0.9  # of the initial speed: below, the signal reads standstill; above, it has hardly decreased
_LONGER, _TAIL = 10, 0.02  # least length of the floor: times the longest hold before it, and of the record
_HEAD_S = 0.04  # initial stretch with the shaft levitated
_START_S = 0.02  # initial stretch of a speed signal
_NOTHING = 1e-3  # of the keyphasor speed: a signal that reads less is dead
_SLOWED = 0.005  # of the keyphasor speed: a larger change from start to end is not a controlled constant speed
_KEYED = ". It is left out: the speed comes from the keyphasor"
_UNUSED = ". It is left out: the speed is not evaluated"
_UNUSED_BOTH = ". Both are left out: the speed is not evaluated"


def first_speed(ds: xr.Dataset, marks: Pulses | None) -> float | None:
    """Return the speed at the start of a record, Hz, from the keyphasor or else from the speed signal; None without both."""
    return float(np.median(speed(marks)[1][:4])) if marks is not None and _sound(marks) else _signal_at_start(ds)


def speed_check(ds: xr.Dataset, machine: Machine, marks: Pulses | None) -> Check:
    """Check a speed signal that has values against the keyphasor, and both against the lines of the levitated shaft."""
    _, values = known_samples(ds["speed"])
    if _backward(ds):
        left_out = _KEYED if _sound(marks) else ""
        detail = (
            f"reads {float(np.median(values)):.4g} Hz: reverse the sign of its sensitivity, or of the channel{left_out}"
        )
        return Check("speed", "speed", False, detail)
    floor = _floor_of(ds)
    if floor is not None:
        at, level = float(times_of(ds["speed"])[floor]), float(ds["speed"].values[floor])
        detail = f"stays at {level:.4g} Hz from {at:.5g} s to the end: the lowest speed that its sensor reads?"
        return Check("speed", "speed", False, f"{detail} These values are taken as missing")
    compared = _over_pulses(ds, marks)
    if compared is not None:
        return _against_the_pulses(ds, machine, marks, compared)
    of_shaft = _against_the_shaft(ds, machine)
    if of_shaft is not None:
        return of_shaft
    largest = float(np.max(np.abs(values)))
    if largest > _SPEED_LIMIT:
        detail = f"up to {largest:.4g} Hz ({largest * 60:.4g} rpm): rpm written as Hz? Check its unit"
        return Check("speed", "speed", False, detail)
    return Check("speed", "speed", True, f"up to {largest:.4g} Hz")


def _against_the_pulses(ds: xr.Dataset, machine: Machine, marks: Pulses | None, compared: _Ratio) -> Check:
    """Check that the speed signal agrees with the keyphasor throughout, and both with the levitated shaft."""
    if not compared.agree and (wanted := _too_short(ds, machine, compared)) is not None:
        detail = f"it counts {1 / compared.ratio:.3g} times the speed of the speed signal: {shorter_than_a_sample(wanted)}"
        return Check("speed", "keyphasor", False, f"{detail}. The keyphasor is left out")
    if not compared.agree:
        left_out = "".join(refuted(ds, machine))
        return Check("speed", "speed", False, _differ(compared.ratio, left_out, _misscaled(compared, machine)))
    stated, lines = _signal_at_start(ds), levitated_lines(ds, machine)
    wrong = _miscounted(lines, stated, machine)
    if stated is not None and wrong is not None:
        detail = _contradicted(stated, wrong, " from both speed signal and keyphasor")
        return Check("speed", "speed", False, detail + (_UNUSED_BOTH if wrong.sure else ""))
    late = lag(ds, marks)
    if late is not None:
        detail = (
            f"agrees with the keyphasor at first, but reads {percent(late - 1, 2)} more once the rotor slows down: it lags,"
            f" as from a tachometer that averages{_KEYED}"
        )
        return Check("speed", "speed", False, detail)
    return Check("speed", "speed", True, f"agrees with the keyphasor within {percent(abs(compared.ratio - 1), 2)}")


def keyphasor_speed_check(ds: xr.Dataset, machine: Machine, marks: Pulses | None) -> Check | None:
    """Check a keyphasor that is the only source of the speed against the levitated shaft; None if inconclusive."""
    kept = _without_unfit(ds, machine)
    if not _sound(marks) or ("speed" in kept and refuted(kept, machine) != ("speed",)):
        return None
    stated, lines = _counted_at_start(marks), levitated_lines(ds, machine)
    wrong = _miscounted(lines, stated, machine)
    if lines is None or stated is None:
        return None
    if wrong is not None:
        detail = _contradicted(stated, wrong, " from the keyphasor") + (_UNUSED if wrong.sure else "")
        return Check("speed", "keyphasor", False, detail)
    if not lines.bears_out(stated) or lines.is_hum(stated, machine.mains):
        return None
    return Check("speed", "keyphasor", True, f"{stated:.4g} Hz: the spectrum of the levitated shaft has a line there")


def dead_speed(ds: xr.Dataset, marks: Pulses | None) -> str:
    """Return why a speed signal is dead; "" if it may be valid, as a rotor at a set-point also has a constant speed."""
    _, values = known_samples(ds["speed"])
    if not values.size:
        return f"has no values: check its cable and the logger's channel{_KEYED if _sound(marks) else ''}"
    if marks is None or not _sound(marks):
        still = not values.any()
        return "is always zero: check its cable and the logger's channel" if still else ""
    _, hz, sigma = speed(marks)
    few = max(min(hz.size // 4, 10), 1)
    first, last = float(np.median(hz[:few])), float(np.median(hz[-few:]))
    read = _while_counted(ds["speed"], marks)
    if abs(read) < _NOTHING * max(first, last):
        kept = f"reads {read:.3g} Hz while the keyphasor counts {first:.4g} Hz"
    elif np.ptp(values) == 0 and abs(first - last) > max(_SLOWED * first, 5 * float(np.median(sigma))):
        kept = (
            f"stays at {values[0]:.4g} Hz while the keyphasor counts {first:.4g} Hz at the start and {last:.4g} Hz at the end"
        )
    else:
        return ""
    return f"{kept}: check its cable and the logger's channel{_KEYED}"


def _while_counted(channel: xr.DataArray, marks: Pulses) -> float:
    """Return the median of a speed signal between the first and the last pulse, excluding standstill, Hz; NaN if empty."""
    time, values = known_samples(channel)
    there = (time >= marks.times[0]) & (time <= marks.times[-1])
    return float(np.median(values[there])) if there.any() else float("nan")


def stands(ds: xr.Dataset) -> bool:
    """Tell whether a working speed signal shows standstill at the start and for most of the record."""
    start = _signal_at_start(ds)
    if start is None:
        return False
    _, values = known_samples(ds["speed"])
    return max(abs(start), abs(float(np.median(values)))) < STANDSTILL_HZ and bool(np.ptp(values) > 0)


def _counted_at_start(marks: Pulses | None) -> float | None:
    """Return the mean speed over the first pulses, Hz; over several, as each is resolved to one sample only."""
    if marks is None or marks.times.size <= 4:
        return None
    last = min(max(int(np.searchsorted(marks.times, marks.times[0] + _HEAD_S)), 4), marks.times.size - 1)
    return float((marks.turns[last] - marks.turns[0]) / (marks.times[last] - marks.times[0]))


def _sound(marks: Pulses | None) -> bool:
    return marks is not None and marks.times.size > 4


def _backward(ds: xr.Dataset) -> bool:
    _, values = known_samples(ds["speed"])
    return values.size > 0 and float(np.median(values)) <= -STANDSTILL_HZ


def _floor_of(ds: xr.Dataset) -> int | None:
    """Return the index from which the speed signal stays at the lower limit of its sensor; None if it does not.

    It then holds one value, a considerable fraction of the initial one, to the record's end, much longer than any before.
    """
    if "speed" not in ds:
        return None
    values = ds["speed"].values
    signal = faults.prepare(values)
    flat = signal.flat
    if not len(flat) or flat.first[-1] + flat.length[-1] < values.size:
        return None
    first, length = int(flat.first[-1]), int(flat.length[-1])
    held = max(flat.length[:-1].tolist(), default=1)
    level, start = float(values[first]), _signal_at_start(ds)
    falls = start is not None and _AT_REST * start < level < _FLOOR * start
    return first if falls and length > max(_LONGER * held, _TAIL * values.size) else None


def _differ(ratio: float, wrong: str, misscaled: bool) -> str:
    """Return why the speed signal may read `ratio` times the keyphasor speed, and which of the two (`wrong`) is left out.

    `misscaled` is true if a wrong scale of the signal is more likely than a miscounted mark.

    Keyphasor and levitated shaft are both timed by the record's clock, so that they still agree with each other if it is wrong.
    """
    times = f"{ratio:.4g} times the keyphasor's speed"
    # teeth counted as one revolution each are ruled out if the shaft confirms the keyphasor
    signal = _named(ratio, _UNITS | _COUNTS | ({} if wrong == "speed" else _WHEELS))
    if wrong == "keyphasor" or ratio <= 0:
        judged = ". The levitated shaft confirms the speed signal: the keyphasor is left out" if wrong else ""
        return f"{times}{signal and ', '}{signal}: {_CHECK}, and the mark{judged}"
    wrong_by = float(f"{max(ratio, 1 / ratio):.3g}")  # written in full: 1000, not 1e+03
    off = f"{wrong_by:g} times too {'low' if ratio > 1 else 'high'}"
    clock = _named(ratio, _CLOCKS)
    causes = f"{signal or 'a wrong unit'}, or a stated sampling rate {off}{clock and f' ({clock})'}"
    judged = (
        ". A once-per-revolution mark cannot be miscounted by so little: the speed signal is left out"
        if misscaled
        else ". The levitated shaft, timed by the same clock, confirms the keyphasor: the speed signal is left out"
        if wrong
        else ""
    )
    return f"{times}: {causes}? {_CHECK.capitalize()}, the mark, and {_CLOCK}{judged}"


def _against_the_shaft(ds: xr.Dataset, machine: Machine) -> Check | None:
    """Check a speed signal without keyphasor against the lines of the levitated shaft; None if inconclusive."""
    lines, stated = levitated_lines(ds, machine), _signal_at_start(ds)
    if lines is None or stated is None or stated <= -STANDSTILL_HZ:
        return None
    factor = _unit_factor(lines, stated, machine.mains)
    if factor is not None:
        detail = f"{stated:.4g} Hz at the start, but the levitated shaft turns at {stated / factor:.4g} Hz"
        return Check("speed", "speed", False, f"{detail}: {_UNITS[factor]}? {_CHECK.capitalize()}{_UNUSED}")
    other = _elsewhere(ds, lines, stated, machine.mains)
    wrong = _miscounted(lines, stated, machine)
    if wrong is not None:
        left_out = _UNUSED if wrong.sure or other is not None else ""
        return Check("speed", "speed", False, _contradicted(stated, wrong, "") + left_out)
    if other is None and not lines.bears_out(stated):
        return None
    if other is None:
        return Check("speed", "speed", True, f"{stated:.4g} Hz: the spectrum of the levitated shaft has a line there")
    detail = (
        f"{stated:.4g} Hz at the start, but the spectrum of the levitated shaft has no line there, and a strong one at"
        f" {other:.4g} Hz"
    )
    return Check("speed", "speed", False, f"{detail} (ratio {stated / other:.4g}): {_CHECK}, and {_CLOCK}{_UNUSED}")


def _elsewhere(ds: xr.Dataset, lines: LevitatedLines, stated: float, mains_hz: float) -> float | None:
    """Return the frequency of a strong line of the levitated shaft if there is none at the stated speed; else None.

    A shaft at standstill has no lines: a signal that reads standstill is dead if there is one, unless a keyphasor is present.
    """
    if stands(ds) and "keyphasor" not in ds:
        other = lines.strongest(mains_hz)
        return other if lines.contrast(other) > STRONG else None
    if not lines.resolves(stated):
        return None
    near = true_speed(ds, lines, stated)
    if near is not None and not lines.is_hum(near, mains_hz):
        return near
    other = lines.strongest(mains_hz)
    apart = abs(other - stated) >= WIDTH * lines.cell
    return other if apart and not lines.bears_out(stated) and lines.outdoes(other, stated, _STRONGER) else None


def _miscounted(lines: LevitatedLines | None, stated: float | None, machine: Machine) -> Miscounted | None:
    return None if lines is None or stated is None or stated <= 0 else miscounted(lines, stated, machine.mains)


def _contradicted(stated: float, wrong: Miscounted, by: str) -> str:
    return f"the speed{by} at the start, {stated:.4g} Hz, is {wrong}: {wrong.cause}? Check the mark and the counter"


def _unit_factor(lines: LevitatedLines, stated: float, mains_hz: float) -> float | None:
    """Return the unit error (a factor) for which the shaft has a strong line at the corrected speed; None if there is none."""

    def possible(factor: float) -> bool:
        true = stated / factor
        hum = bool(lines.hum(np.array([true]), mains_hz)[0])
        return lines.outdoes(true, stated, _STRONGER) and not (hum and lines.bears_out(stated))

    return max(filter(possible, _UNITS), key=lambda factor: lines.at(stated / factor), default=None)


def refuted(ds: xr.Dataset, machine: Machine) -> tuple[str, ...]:
    """Return which of the channels "speed" and "keyphasor" are wrong; empty if this cannot be decided.

    A keyphasor that misses pulses because they are shorter than a sample is rejected.  Otherwise, if signal and keyphasor
    differ, the lines of the levitated shaft at the two speeds decide; if these are inconclusive and the speeds are close, the
    keyphasor is trusted.  If both agree, or only one exists, they are rejected if the shaft turns at a half or a third of their
    speed; a signal alone is also rejected if the shaft's line is at the speed corrected for a unit error, or elsewhere with
    none at the stated speed.
    """
    marks = pulses_if_any(ds, machine)
    lines, signal = levitated_lines(ds, machine), _signal_at_start(ds)
    stated = _counted_at_start(marks) if signal is None else signal
    if stated is None or stated <= -STANDSTILL_HZ:
        return ()
    compared = _over_pulses(ds, marks)
    if compared is not None and not compared.agree:
        if _too_short(ds, machine, compared) is not None:
            return ("keyphasor",)
        counted = stated / compared.ratio
        if lines is not None and lines.outdoes(counted, stated, _LIKELIER):
            return ("speed",)
        if lines is not None and lines.outdoes(stated, counted, _LIKELIER):
            return ("keyphasor",)
        return ("speed",) if _misscaled(compared, machine) else ()
    if lines is None:
        return ()
    wrong = _miscounted(lines, stated, machine)
    if wrong is not None and wrong.sure:
        return tuple(name for name in ("speed", "keyphasor") if name in ds)
    if signal is None or compared is not None:
        return ()
    elsewhere = _elsewhere(ds, lines, stated, machine.mains) is not None
    return ("speed",) if elsewhere or _unit_factor(lines, stated, machine.mains) is not None else ()


def _too_short(ds: xr.Dataset, machine: Machine, compared: _Ratio) -> float | None:
    """Return the sampling rate, Hz, needed by a keyphasor that misses pulses shorter than a sample; None if it does not."""
    return sampling_for_pulses(ds, machine) if compared.ratio > 1 else None


def shorter_than_a_sample(wanted: float) -> str:
    """Return the message that pulses are missed at a low sampling rate, with the rate needed for two samples each, Hz."""
    return (
        "its pulses are shorter than a sampling interval, so many fall between two samples: record the keyphasor at"
        f" {wanted / 1e3:.2g} kHz or more, or make the mark wider"
    )


def _misscaled(compared: _Ratio, machine: Machine) -> bool:
    """Tell whether the ratio is too close to 1 for a miscounted once-per-revolution mark, so that the signal is misscaled."""
    once = machine.keyphasor is not None and machine.keyphasor.pulses_per_revolution == 1
    return once and abs(compared.ratio - 1) < _NEAR


def without_refuted(ds: xr.Dataset, machine: Machine) -> xr.Dataset:
    """Return a record without the speed channels rejected by `refuted`, and with the speed's lower limit set to NaN.

    A speed signal that is dead, negative or lagging is dropped if a keyphasor gives the speed.
    """
    ds = _without_unfit(ds, machine)
    while wrong := refuted(ds, machine):  # the remaining channel is then judged on its own
        ds = ds.drop_vars(wrong)
    return ds


def _without_unfit(ds: xr.Dataset, machine: Machine) -> xr.Dataset:
    return _without_floor(_without_dead(without_speed_spikes(ds), machine), machine)


def _without_dead(ds: xr.Dataset, machine: Machine) -> xr.Dataset:
    if "speed" not in ds:
        return ds
    marks = pulses_if_any(ds, machine)
    empty = not np.isfinite(ds["speed"].values).any()
    compared = _over_pulses(ds, marks)
    late = compared is not None and compared.agree and lag(ds, marks) is not None
    unfit = _sound(marks) and (_backward(ds) or dead_speed(ds, marks) != "" or late)
    return ds.drop_vars("speed") if empty or unfit else ds


def _without_floor(ds: xr.Dataset, machine: Machine) -> xr.Dataset:
    """Set the speed signal to NaN where it stays at its lower limit, or drop it if the keyphasor continues."""
    floor = _floor_of(ds)
    if floor is None:
        return ds
    speed, marks = ds["speed"], pulses_if_any(ds, machine)
    if marks is not None and np.sum(marks.times > times_of(speed)[floor]) > 4:
        return ds.drop_vars("speed")
    held = np.arange(speed.size) >= floor
    return ds.assign(speed=(speed.dims, np.where(held, np.nan, speed.values), speed.attrs))


def require_one_speed(ds: xr.Dataset, machine: Machine, name: str) -> None:
    """Raise InputError if the speed is ambiguous, since a model fitted with a wrong speed would be wrong throughout.

    Parameters
    ----------
    ds : xarray.Dataset
        Record from `without_refuted`.
    machine : Machine
    name : str
        Name of the record for the message.
    """
    compared = _over_pulses(ds, pulses_if_any(ds, machine))
    if compared is not None and not compared.agree:
        raise InputError(
            f"{name}: the speed signal reads {compared.ratio:.4g} times the keyphasor's speed, and the levitated shaft does"
            " not show which is right: correct unit or sensitivity of the speed signal, or the sampling rate, or remove the"
            " wrong one of the two from the machine file"
        )


def signal_over_pulses(ds: xr.Dataset, machine: Machine) -> float:
    """Return the ratio of the speed signal to the keyphasor speed; 1 if they agree or one is missing."""
    compared = _over_pulses(ds, pulses_if_any(ds, machine))
    return 1.0 if compared is None or compared.agree else compared.ratio


@dataclass(frozen=True)
class _Ratio:
    """Ratio of the speed signal to the keyphasor speed, and whether the two agree."""

    ratio: float
    agree: bool


def _over_pulses(ds: xr.Dataset, marks: Pulses | None) -> _Ratio | None:
    if "speed" not in ds or marks is None:
        return None
    ratios, sigma = stated_over_counted(ds, marks)
    if len(ratios) < _FEWEST_TURNS:
        return None
    ratio = float(np.median(ratios))
    return _Ratio(ratio, abs(ratio - 1) <= max(_SAME, 3 * float(np.median(sigma))))


def _signal_at_start(ds: xr.Dataset) -> float | None:
    if "speed" not in ds:
        return None
    speed = ds["speed"]
    return starting_speed(times_of(speed), speed.values, _START_S)


def starting_speed(time: np.ndarray, values: np.ndarray, seconds: float) -> float | None:
    """Return the median of the speed values (n,), Hz, in the first `seconds`, at least of the first one; None if all missing."""
    there = np.isfinite(values)
    if not there.any():
        return None
    time, values = time[there], values[there]
    return float(np.median(values[: max(int(np.searchsorted(time, time[0] + seconds)), 1)]))


def _named(ratio: float, kinds: dict[float, str]) -> str:
    """Return the fault among `kinds` whose factor is closest to `ratio`, within tolerance; "" if there is none."""

    def apart(factor: float) -> float:
        return abs(float(np.log(max(abs(ratio), 1e-9) / factor)))

    possible = [each for each in kinds if apart(each) < (_EXACTLY if each in _WHEELS else _NEARLY)]
    return kinds[min(possible, key=apart)] if possible else ""
