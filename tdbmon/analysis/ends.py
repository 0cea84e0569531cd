"""Results of each end of the shaft: clearance, contacts, single-mass stiffness, deepest excursion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
import xarray as xr
from tdbsim.machine import Machine, TouchdownBearing
from tdbsim.rotor import RotorModel, static_loads

from tdbmon.analysis.axes import seen_ends
from tdbmon.analysis.bent_line import at_rest, line_beyond, relative_load
from tdbmon.analysis.contacts import Contacts, find_contacts
from tdbmon.analysis.gap import SETTLED_S, Gap, NoCircle, fit_gap, settled_from
from tdbmon.analysis.late_beginning import late_beginning
from tdbmon.analysis.rest import RestTravel, rest_travel
from tdbmon.analysis.result import EndResult
from tdbmon.analysis.stiffness import single_mass_stiffness
from tdbmon.analysis.swing import Swing, carried_shares, find_swing
from tdbmon.analysis.whirl import Whirl
from tdbmon.estimate import Estimate
from tdbmon.quantity import percent, printed
from tdbmon.record.finding import Check, um
from tdbmon.record.held_end import ends_in_fall
from tdbmon.record.misread import FEW
from tdbmon.record.quality import LeftOut

_WHIRLS = "the shaft whirls around its clearance {until} and does not come to rest: record for longer"
_AT_ONCE_S = 0.01  # whirl that stops so shortly before the record ends counts as lasting to its end
_OUTSIDE = "{probes} read displacements that no rotor can reach (see range): check sensitivity and offset"
_NO_SWING = "no swing of at least 150 cycles after the last bounce of both ends"
_NOT_LYING = "the shaft does not stay on its bearing to the end of the record (see stays down)"
_OWN_LOAD = (
    "computed from the motion of this end alone: the other end's motion in its bearing is not known at the same time and may be"
    " opposite. Radius at rest, air gap and height of the centre may be wrong by {}, which their intervals include. Sound probes"
    " at both ends make them more accurate"
)


def analyse_ends(
    planes: xr.Dataset,
    machine: Machine,
    rotor: RotorModel,
    released: float | None,
    back: Mapping[str, str],
    checks: list[Check],
    whirl: Mapping[str, Whirl],
    misread: Mapping[str, str],
    unused: Mapping[str, LeftOut],
    held: Mapping[str, str],
    unscaled: str,
) -> tuple[dict[str, EndResult], Swing | None]:
    """Return the result of each end, and the swing that both share.

    Parameters
    ----------
    planes : Dataset
        Displacement at the bearing planes, and `cut_off` (end, time).
    machine : Machine
    rotor : RotorModel
    released : float or None
        Instant of the release, s; None if it is not in the record, which is then analysed from its first sample on.
    back : mapping
        Result of `tdbmon.analysis.returned.returned` for each end.
    checks : list of Check
        Further checks are appended: radius from arc and swing, load on the ring, machine file against record.
    whirl : mapping
        Whirl of the visible ends: a whirling shaft is pressed deeper than at rest, and settles only afterwards.
    misread : mapping
        Result of `tdbmon.record.misread.misread`.
    unused : mapping
        Result of `tdbmon.record.quality.left_out`.
    held : mapping
        Result of `tdbmon.record.held_end.said_held` for each end that stayed levitated.
    unscaled : str
        Why times after the release are withheld, if their scale may be wrong; "" otherwise.
    """
    loads = static_loads(machine, rotor)
    start = float(planes.time[0]) if released is None else released
    seen = seen_ends(planes)
    stays = {end: NoCircle(why) for end, why in held.items()}
    settled = {end: _lies_from(planes, end, machine, start, whirl[end]) for end in seen} | stays
    swing, no_swing = _swing(planes, machine, rotor, settled)
    settled |= _no_circle(planes, machine, seen, settled, start, back, misread) | stays
    settled |= {end: NoCircle(_unseen(machine, end, unused)) for end in machine.ends if end not in seen}
    travels = {end: rest_travel(machine.bearing(end), loads[end]) for end in machine.ends}
    shares = carried_shares(machine, rotor)
    beyond = line_beyond(planes, machine, rotor, at_rest(machine, loads))
    circles: dict[str, Gap | NoCircle] = {}
    for end in machine.ends:
        since = settled[end]
        if isinstance(since, NoCircle):
            circles[end] = since
        else:
            known = None if swing is None else swing.gap[end]
            circle = fit_gap(planes, end, machine, travels[end], since, known, shares[end], beyond[end])
            circles[end] = _agreed(circle, end, known, checks)
            if isinstance(circle, Gap) and circle.alone:
                checks.append(Check("load on the ring", end, True, _OWN_LOAD.format(um(circle.alone))))
    late = late_beginning(planes, {end: circles[end] for end in seen}) if released is None else ""
    ends = {}
    for end in machine.ends:
        travel, circle, load = travels[end], circles[end], loads[end]
        gap = circle if isinstance(circle, Gap) else None
        air_gap = _air_gap(circle, travel, rotor.total_mass, load)
        impossible = air_gap.why if gap is not None else ""
        if impossible:
            checks.append(Check("machine and record", end, False, impossible))
        contacts = None
        if gap is not None and not impossible:
            play = machine.bearing(end).balls.play
            contacts = find_contacts(planes, end, gap, travel, play, start, machine.gravity, unscaled or late)
        ends[end] = EndResult(
            name=end,
            plane=str(planes.plane.sel(end=end).item()),
            load=load,
            travel=travel,
            gap=gap,
            air_gap=air_gap,
            gap_from_swing=Estimate.missing("um", no_swing) if swing is None else swing.gap[end],
            contacts=contacts,
            stiffness=_stiffness(contacts, air_gap.why, load / machine.gravity if machine.gravity else 0.0),
            deepest=_bent(
                _deepest(planes, end, circle, start, contacts), gap, machine.bearing(end), travel, load, beyond[end]
            ),
            held=held.get(end, ""),
        )
    return ends, swing


def _lies_from(planes: xr.Dataset, end: str, machine: Machine, start: float, whirl: Whirl) -> float | NoCircle:
    """Return the time from which the shaft stays on the ring of an end without whirl, s, or why there is none."""
    if falling := ends_in_fall(planes, end, machine, start):
        return NoCircle(falling)
    settled = settled_from(planes, end, machine.bearing(end).radial_gap.nominal, start=start)
    whirled = whirl.last_s
    left = float(planes.time[-1]) - whirled
    if isinstance(settled, NoCircle):
        if left >= SETTLED_S:
            return settled
    elif whirled <= settled:
        return settled
    elif left >= SETTLED_S:
        return whirled
    until = "to the end of the record" if left < _AT_ONCE_S else f"until {left:.2g} s before the record ends"
    return NoCircle(_WHIRLS.format(until=until))


def _swing(
    planes: xr.Dataset, machine: Machine, rotor: RotorModel, settled: Mapping[str, float | NoCircle]
) -> tuple[Swing | None, str]:
    """Return the swing after both ends have settled, or why there is none.

    Only with both ends evaluated at the bearing planes, as an end taken at its probe plane would distort the mode shape.
    """
    times = []
    for end in machine.ends:
        if end not in settled:
            return None, f"the swing needs both ends, but {end} is not seen"
        since = settled[end]
        if isinstance(since, NoCircle):
            return None, f"the swing needs both ends at rest, but {end} is not (see its radius at rest)"
        times.append(since)
    if aside := [end for end in machine.ends if planes.plane.sel(end=end) != "bearing"]:
        return (
            None,
            f"the swing needs the shaft in both bearing planes, but {' and '.join(aside)} is seen in its probe plane only",
        )
    swing = find_swing(planes, machine, rotor, max(times))
    return swing, "" if swing else _NO_SWING


def _no_circle(
    planes: xr.Dataset,
    machine: Machine,
    seen: Sequence[str],
    settled: Mapping[str, float | NoCircle],
    start: float,
    back: Mapping[str, str],
    misread: Mapping[str, str],
) -> dict[str, NoCircle]:
    """Return the visible ends whose readings allow no circle wherever the shaft settles, and why.

    Readings out of range explain why the shaft seems not to stay down or not to settle, and so take precedence.
    """
    found = {}
    for end in seen:
        if cut := _cut_off(planes, end, start):
            found[end] = NoCircle(cut)
        if back[end]:
            found[end] = NoCircle(_NOT_LYING)
        outside = [probe.name for probe in machine.probes_at(end) if misread.get(probe.name) == "range"]
        if outside and (end in found or isinstance(settled[end], NoCircle)):
            found[end] = NoCircle(_OUTSIDE.format(probes=" and ".join(outside)))
    return found


def _unseen(machine: Machine, end: str, unused: Mapping[str, LeftOut]) -> str:
    """Return the reason why an end has no orbit."""
    why = "; ".join(f"{p.name} {unused[p.name]}" for p in machine.probes_at(end) if p.name in unused)
    return f"this end has no two usable probes in different directions{': ' if why else ''}{why}"


def _agreed(circle: Gap | NoCircle, end: str, swing: Estimate | None, checks: list[Check]) -> Gap | NoCircle:
    """Check the circle of an end against the swing, and return it; if the radii disagree neither is trusted: no circle."""
    if isinstance(circle, NoCircle) or circle.agrees is None or swing is None:
        return circle
    detail = f"radius {printed(circle.from_arc)} from the arc, {printed(swing)} from the swing"
    if not circle.agrees:
        detail += (
            ": the bore is not round (the arc gives only its curvature at the bottom), or a probe's sensitivity is wrong"
        )
    checks.append(Check("gap from arc and swing agree", end, circle.agrees, detail))
    return circle if circle.agrees else NoCircle(f"{detail}; no circle is reported")


def _cut_off(planes: xr.Dataset, end: str, start: float) -> str:
    """Return why clipping leaves no circle to fit (it removes the deepest part of the arc); "" if few samples are clipped."""
    share = float(planes.cut_off.sel(end=end, time=slice(start, None)).mean())
    if share <= FEW:
        return ""
    return f"{percent(share, 1)} of the samples after {start:.4g} s are clipped (see clipping): the arc lacks its deepest part"


def _air_gap(gap: Gap | NoCircle, travel: RestTravel, mass: float, load: float) -> Estimate:
    """Return the radial air gap: radius at rest less ball clearance and deflection; missing if that is not positive."""
    if isinstance(gap, NoCircle):
        return Estimate.missing("um", gap.why)
    sigma = float(np.hypot(gap.radius.apart.sigma or 0.0, travel.sigma))
    if gap.size <= travel.total:
        weight = f"rotor of {mass:.4g} kg, {load:.0f} N on this end"
        why = (
            f"the radius at rest is {um(gap.size)}, but ball clearance and deflection alone are {um(travel.total)} by the machine"
            f" file ({weight}): machine file and record do not agree. Check diameters, lengths and masses of the rotor, support"
            " stiffness and ball clearance, and the sensitivity of the probes"
        )
        return Estimate.missing("um", why)
    rule = "radius at rest minus ball clearance and deflection by the machine file"
    return Estimate.from_sigma(gap.size - travel.total, sigma, "um", rule).widened(gap.radius.shared)


def _stiffness(contacts: Contacts | None, no_air_gap: str, mass: float) -> Estimate:
    """Return the single-mass stiffness of the first contact of an end that carries a mass, kg; missing without contacts."""
    if contacts is None:
        return Estimate.missing("N/m", no_air_gap)
    return Estimate.missing("N/m", contacts.why) if contacts.why else single_mass_stiffness(contacts.first, mass)


def _deepest(planes: xr.Dataset, end: str, gap: Gap | NoCircle, start: float, contacts: Contacts | None) -> Estimate:
    """Return the largest excursion from the clearance centre after the release."""
    if isinstance(gap, NoCircle):
        return Estimate.missing("um", gap.why)
    if planes.cut_off.sel(end=end, time=slice(start, None)).any():
        return Estimate.missing("um", "peaks are clipped (see clipping), and the deepest excursion may be among them")
    if contacts is not None and contacts.hidden:
        return Estimate.missing("um", f"{contacts.hidden}: the deepest excursion may be hidden there")
    if contacts is not None and contacts.why:
        return Estimate.missing("um", contacts.why)
    xy = planes.displacement.sel(end=end).to_numpy()[:, planes.time.to_numpy() >= start]
    reach = np.hypot(*(xy - gap.place[:, None]))
    rule = "largest distance from the clearance centre"
    sigma = gap.centre[1].apart.sigma or 0.0
    return Estimate.from_sigma(float(np.nanmax(reach)), sigma, "um", rule, "0-pk").widened(gap.centre[1].shared)


def _bent(
    deepest: Estimate, gap: Gap | None, bearing: TouchdownBearing, travel: RestTravel, load: float, beyond: float
) -> Estimate:
    """Widen the interval of the largest excursion by the error of the rigid line for a shaft bent by the impact.

    `beyond` : how far the line lies below the shaft at rest, m.
    """
    if deepest.value is None or deepest.low is None or deepest.high is None or gap is None:
        return deepest
    deflected = deepest.value - gap.size + travel.total
    if beyond == 0.0 or deflected <= 0.0:
        return deepest
    passes = beyond * relative_load(bearing, load, deflected)
    down, up = deepest.value - deepest.low, deepest.high - deepest.value
    return replace(
        deepest,
        low=max(deepest.value - float(np.hypot(down, max(passes, 0.0))), 0.0),
        high=deepest.value + float(np.hypot(up, max(-passes, 0.0))),
        scatter=deepest.apart,
        method=f"{deepest.method}; interval: also shaft bending between probe and bearing in the impact",
    )
