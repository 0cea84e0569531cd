"""Checks of the speed: signal, keyphasor and the line that the levitated shaft draws must tell of one and the same."""

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

STANDSTILL_HZ = 1.0  # below it a shaft stands: what a speed signal then tells is noise
_SPEED_LIMIT = 3000.0  # Hz: 180 000 rpm
_SAME = 0.03  # relative: of speeds that are one
_FEWEST_TURNS = 4  # with a stated speed and pulses, by which the two are compared
_STRONGER = 25.0  # times the power at a speed that no second channel doubts
_LIKELIER = 4.0  # times the power at the one of two speeds that differ: twice the amplitude, as 1X has over 2X
_UNITS = {
    60.0: "rpm written as Hz",
    1 / 60: "Hz written as rpm",
    2 * np.pi: "rad/s written as Hz",
    1 / (2 * np.pi): "Hz written as rad/s",
    2 * np.pi / 60: "rad/s written as rpm",
    60 / (2 * np.pi): "rpm written as rad/s",
}
_COUNTS = {2.0: "two pulses a revolution in the speed signal", 0.5: "two marks a revolution on the shaft"}
_WHEELS = {1 / n: f"{n} pulses a revolution (pulses_per_revolution = {n} in [keyphasor])" for n in range(3, 49)}
_CLOCKS = {1000.0: "time in ms read as s", 1 / 1000: "time in s read as ms", 60.0: "time in s read as min"}
_NEARLY, _EXACTLY = 0.03, 0.01  # relative, to a fault's factor: a wheel's teeth are a whole number
_NEAR = 0.3  # relative, of two speeds: no count of whole marks makes one of the other
_CHECK = "check unit and sensitivity of the speed signal"
_CLOCK = "sampling rate and unit of time"
_AT_REST, _FLOOR = 0.002, 0.9  # of the first speed: below, the signal reads rest; above, it has hardly fallen
_LONGER, _TAIL = 10, 0.02  # times the longest hold before; of the record
_HEAD_S = 0.04  # that shows the levitated shaft
_START_S = 0.02  # at the start, of a speed signal
_NOTHING = 1e-3  # of the keyphasor's speed: a signal that reads less is dead
_SLOWED = 0.005  # of the keyphasor's speed from start to end: more is no controlled speed
_KEYED = ". It is left out: the speed comes from the keyphasor"
_UNUSED = ". It is left out: nothing is said about the speed"
_UNUSED_BOTH = ". Both are left out: nothing is said about the speed"


def first_speed(ds: xr.Dataset, marks: Pulses | None) -> float | None:
    """Return the speed at the start of a record, Hz, of the keyphasor or else of the speed signal."""
    return float(np.median(speed(marks)[1][:4])) if marks is not None and _sound(marks) else _signal_at_start(ds)


def speed_check(ds: xr.Dataset, machine: Machine, marks: Pulses | None) -> Check:
    """Check a speed signal that has values against the keyphasor, and what they say against the line of the levitated shaft."""
    _, values = known_samples(ds["speed"])
    if _backward(ds):
        left_out = _KEYED if _sound(marks) else ""
        detail = (
            f"reads {float(np.median(values)):.4g} Hz: turn the sign of its sensitivity, or of the channel{left_out}"
        )
        return Check("speed", "speed", False, detail)
    floor = _floor_of(ds)
    if floor is not None:
        at, level = float(times_of(ds["speed"])[floor]), float(ds["speed"].values[floor])
        detail = f"stands at {level:.4g} Hz from {at:.5g} s to the end: the lowest speed that its sensor reads?"
        return Check("speed", "speed", False, f"{detail} What follows is taken as missing")
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
    """A speed signal must read what the keyphasor counts, all along, and both must be the levitated shaft's."""
    if not compared.agree and (wanted := _too_short(ds, machine, compared)) is not None:
        detail = f"the keyphasor counts {1 / compared.ratio:.3g} of the speed signal: {shorter_than_a_sample(wanted)}"
        return Check("speed", "keyphasor", False, f"{detail}. The keyphasor is left out")
    if not compared.agree:
        left_out = "".join(refuted(ds, machine))
        return Check("speed", "speed", False, _differ(compared.ratio, left_out, _misscaled(compared, machine)))
    stated, lines = _signal_at_start(ds), levitated_lines(ds, machine)
    wrong = _miscounted(lines, stated, machine)
    if stated is not None and wrong is not None:
        detail = _contradicted(stated, wrong, "by signal and keyphasor alike")
        return Check("speed", "speed", False, detail + (_UNUSED_BOTH if wrong.sure else ""))
    late = lag(ds, marks)
    if late is not None:
        detail = (
            f"keeps up with the keyphasor at first, and reads {percent(late - 1, 2)} more once the rotor slows: it comes"
            f" late, as from a tachometer that averages{_KEYED}"
        )
        return Check("speed", "speed", False, detail)
    return Check("speed", "speed", True, f"agrees with the keyphasor within {percent(abs(compared.ratio - 1), 2)}")


def keyphasor_speed_check(ds: xr.Dataset, machine: Machine, marks: Pulses | None) -> Check | None:
    """Check a keyphasor that alone tells the speed against the levitated shaft; None where that cannot be told."""
    kept = _without_unfit(ds, machine)
    if not _sound(marks) or ("speed" in kept and refuted(kept, machine) != ("speed",)):
        return None
    stated, lines = _counted_at_start(marks), levitated_lines(ds, machine)
    wrong = _miscounted(lines, stated, machine)
    if lines is None or stated is None:
        return None
    if wrong is not None:
        detail = _contradicted(stated, wrong, "by the keyphasor") + (_UNUSED if wrong.sure else "")
        return Check("speed", "keyphasor", False, detail)
    if not lines.bears_out(stated) or lines.is_hum(stated, machine.mains):
        return None
    return Check("speed", "keyphasor", True, f"{stated:.4g} Hz: the levitated shaft draws a line there")


def dead_speed(ds: xr.Dataset, marks: Pulses | None) -> str:
    """Say why a speed signal measures nothing; "" where it may measure: a rotor at a set-point has a constant speed too."""
    _, values = known_samples(ds["speed"])
    if not values.size:
        return f"holds no value: check its cable and the logger's channel{_KEYED if _sound(marks) else ''}"
    if marks is None or not _sound(marks):
        still = not values.any()
        return "holds one value only, nought: check its cable and the logger's channel" if still else ""
    _, hz, sigma = speed(marks)
    few = max(min(hz.size // 4, 10), 1)
    first, last = float(np.median(hz[:few])), float(np.median(hz[-few:]))
    read = _while_counted(ds["speed"], marks)
    if abs(read) < _NOTHING * max(first, last):
        kept = f"reads {read:.3g} Hz while the keyphasor counts {first:.4g} Hz"
    elif np.ptp(values) == 0 and abs(first - last) > max(_SLOWED * first, 5 * float(np.median(sigma))):
        kept = (
            f"stands at {values[0]:.4g} Hz while the keyphasor counts {first:.4g} Hz at first and {last:.4g} Hz at last"
        )
    else:
        return ""
    return f"{kept}: check its cable and the logger's channel{_KEYED}"


def _while_counted(channel: xr.DataArray, marks: Pulses) -> float:
    """Median of a speed signal from the first pulse to the last, Hz: without what follows at rest; NaN without any."""
    time, values = known_samples(channel)
    there = (time >= marks.times[0]) & (time <= marks.times[-1])
    return float(np.median(values[there])) if there.any() else float("nan")


def stands(ds: xr.Dataset) -> bool:
    """Whether a speed signal that measures shows that the shaft stands: at the start and for most of the record."""
    start = _signal_at_start(ds)
    if start is None:
        return False
    _, values = known_samples(ds["speed"])
    return max(abs(start), abs(float(np.median(values)))) < STANDSTILL_HZ and bool(np.ptp(values) > 0)


def _counted_at_start(marks: Pulses | None) -> float | None:
    """Mean speed over the first pulses, Hz: over several, as each is timed to a sample only."""
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
    """Return the sample from which the speed signal stands at the lowest value that its sensor reads; None where it does not.

    It holds one value, no small part of its first, to the record's end, for far longer than it holds any before.
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
    """Say what may make the speed signal read `ratio` times the keyphasor's speed, and which of the two is left out.

    `misscaled` is true where it is likelier to be scaled wrongly than the mark to be miscounted.

    Keyphasor and levitated shaft are both timed by the record's clock, so that they agree with each other where it is wrong.
    """
    times = f"{ratio:.4g} times the keyphasor's speed"
    # teeth that are counted one by one are no fault where the shaft turns as the keyphasor counts
    signal = _named(ratio, _UNITS | _COUNTS | ({} if wrong == "speed" else _WHEELS))
    if wrong == "keyphasor" or ratio <= 0:
        judged = ". The levitated shaft bears out the speed signal: the keyphasor is left out" if wrong else ""
        return f"{times}{signal and ', '}{signal}: {_CHECK}, and the mark{judged}"
    wrong_by = float(f"{max(ratio, 1 / ratio):.3g}")  # in full: 1000, not 1e+03
    off = f"{wrong_by:g} times too {'low' if ratio > 1 else 'high'}"
    clock = _named(ratio, _CLOCKS)
    causes = f"{signal or 'a wrong unit'}, or a sampling rate stated {off}{clock and f' ({clock})'}"
    judged = (
        ". A mark once a revolution is not miscounted by so little: the speed signal is left out"
        if misscaled
        else ". The levitated shaft bears out the keyphasor, by the same clock: the speed signal is left out"
        if wrong
        else ""
    )
    return f"{times}: {causes}? {_CHECK.capitalize()}, the mark, and {_CLOCK}{judged}"


def _against_the_shaft(ds: xr.Dataset, machine: Machine) -> Check | None:
    """A speed signal alone must stand among the levitated shaft's lines; None where that cannot be told."""
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
        return Check("speed", "speed", True, f"{stated:.4g} Hz: the levitated shaft draws a line there")
    detail = (
        f"{stated:.4g} Hz at the start, but the levitated shaft draws no line there, and a strong one at {other:.4g} Hz"
    )
    return Check("speed", "speed", False, f"{detail} ({stated / other:.4g} times): {_CHECK}, and {_CLOCK}{_UNUSED}")


def _elsewhere(ds: xr.Dataset, lines: LevitatedLines, stated: float, mains_hz: float) -> float | None:
    """Return the frequency of the levitated shaft's strong line where none stands at the stated speed; else None.

    A shaft that stands draws none: a signal that reads nothing is dead where one does, unless a keyphasor is silent too.
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
    return f"{stated:.4g} Hz at the start{by and ' '}{by} is {wrong}: {wrong.cause}? Check the mark, and what counts it"


def _unit_factor(lines: LevitatedLines, stated: float, mains_hz: float) -> float | None:
    """Return the unit's factor by which a speed reads too much, by a line where the shaft would then turn."""

    def possible(factor: float) -> bool:
        true = stated / factor
        hum = bool(lines.hum(np.array([true]), mains_hz)[0])
        return lines.outdoes(true, stated, _STRONGER) and not (hum and lines.bears_out(stated))

    return max(filter(possible, _UNITS), key=lambda factor: lines.at(stated / factor), default=None)


def refuted(ds: xr.Dataset, machine: Machine) -> tuple[str, ...]:
    """Return which channels of the speed are wrong, "speed" and "keyphasor"; none where that is not decided.

    A keyphasor that counts too few since its pulses are shorter than a sample goes.  Else signal and keyphasor that differ are
    judged by the lines of the levitated shaft at the one and at the other; where these do not decide and the two are near each
    other, the keyphasor counts.  Those that agree, and either alone, are refuted where the shaft turns at a half or a third of
    what they count; a signal alone also where the shaft's line is a unit's factor away, or elsewhere while none stands at the
    stated speed.
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
    """Return the sampling rate, Hz, that a keyphasor asks for which counts too few as its pulses are shorter than a sample."""
    return sampling_for_pulses(ds, machine) if compared.ratio > 1 else None


def shorter_than_a_sample(wanted: float) -> str:
    """Say why pulses are missed at a low sampling rate, and the rate that gives each two samples, Hz."""
    return (
        "its pulses are shorter than a sample, so that many fall between two: record the keyphasor at"
        f" {wanted / 1e3:.2g} kHz or more, or make the mark wider"
    )


def _misscaled(compared: _Ratio, machine: Machine) -> bool:
    """True where a signal is a little off a mark that passes once a revolution, which is missed or doubled by whole turns."""
    once = machine.keyphasor is not None and machine.keyphasor.pulses_per_revolution == 1
    return once and abs(compared.ratio - 1) < _NEAR


def without_refuted(ds: xr.Dataset, machine: Machine) -> xr.Dataset:
    """Return a record without the channels of the speed that the others refute (see `refuted`), and without its floor.

    A signal that is dead, counts backwards or comes late goes where a keyphasor tells the speed.
    """
    ds = _without_unfit(ds, machine)
    while wrong := refuted(ds, machine):  # what is left when one goes is judged anew, by itself
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
    """Take what the speed signal reads at its floor as missing; all of it where the keyphasor goes on."""
    floor = _floor_of(ds)
    if floor is None:
        return ds
    speed, marks = ds["speed"], pulses_if_any(ds, machine)
    if marks is not None and np.sum(marks.times > times_of(speed)[floor]) > 4:
        return ds.drop_vars("speed")
    held = np.arange(speed.size) >= floor
    return ds.assign(speed=(speed.dims, np.where(held, np.nan, speed.values), speed.attrs))


def require_one_speed(ds: xr.Dataset, machine: Machine, name: str) -> None:
    """Raise InputError where the speed cannot be told: a model fitted to a wrong one would be wrong throughout.

    Parameters
    ----------
    ds : xarray.Dataset
        From `without_refuted`.
    machine : Machine
    name : str
        Of the record, for the message.
    """
    compared = _over_pulses(ds, pulses_if_any(ds, machine))
    if compared is not None and not compared.agree:
        raise InputError(
            f"{name}: the speed signal reads {compared.ratio:.4g} times the keyphasor's speed, and the levitated shaft does"
            " not tell which is right: correct unit or sensitivity of the speed signal, or the sampling rate, or take the"
            " wrong one of the two out of the machine file"
        )


def signal_over_pulses(ds: xr.Dataset, machine: Machine) -> float:
    """Return how many times the keyphasor's speed the speed signal reads: 1 where they agree, or where one is missing."""
    compared = _over_pulses(ds, pulses_if_any(ds, machine))
    return 1.0 if compared is None or compared.agree else compared.ratio


@dataclass(frozen=True)
class _Ratio:
    """Speed of the signal over that of the pulses, and whether they are one."""

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
    """Return the median of a speed's values (n,), Hz, in its first seconds, or the first where it is slow; None without any."""
    there = np.isfinite(values)
    if not there.any():
        return None
    time, values = time[there], values[there]
    return float(np.median(values[: max(int(np.searchsorted(time, time[0] + seconds)), 1)]))


def _named(ratio: float, kinds: dict[float, str]) -> str:
    """Return the fault of a kind that makes a speed read about `ratio` times too much, or nothing."""

    def apart(factor: float) -> float:
        return abs(float(np.log(max(abs(ratio), 1e-9) / factor)))

    possible = [each for each in kinds if apart(each) < (_EXACTLY if each in _WHEELS else _NEARLY)]
    return kinds[min(possible, key=apart)] if possible else ""
