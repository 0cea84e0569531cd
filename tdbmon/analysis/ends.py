"""What each end of a record shows: clearance, contacts, single-mass stiffness, deepest excursion."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import xarray as xr
from tdbsim.machine import Machine
from tdbsim.rotor import RotorModel, static_loads

from tdbmon.analysis.axes import seen_ends
from tdbmon.analysis.contacts import Contacts, find_contacts
from tdbmon.analysis.gap import SETTLED_S, Gap, NoCircle, fit_gap, settled_from
from tdbmon.analysis.late_beginning import late_beginning
from tdbmon.analysis.rest import RestTravel, rest_travel
from tdbmon.analysis.result import EndResult
from tdbmon.analysis.stiffness import single_mass_stiffness
from tdbmon.analysis.swing import Swing, carried_shares, find_swing
from tdbmon.analysis.whirl import Whirl
from tdbmon.estimate import Estimate
from tdbmon.quantity import percent
from tdbmon.record.finding import um
from tdbmon.record.misread import FEW
from tdbmon.record.quality import Check

_WHIRLS = "the shaft whirls round its clearance to {last:.4g} s, {left:.2g} s before the record ends, and does not rest"
_OUTSIDE = "{probes} read where no rotor gets to (see range): check sensitivity and offset"
_NOT_LYING = "the shaft does not lie on its bearing when the record ends (see rest at the bottom)"


def analyse_ends(
    planes: xr.Dataset,
    machine: Machine,
    rotor: RotorModel,
    released: float | None,
    back: Mapping[str, str],
    checks: list[Check],
    whirl: Mapping[str, Whirl],
    misread: Mapping[str, str],
    unused: Mapping[str, str],
    unscaled: str = "",
) -> tuple[dict[str, EndResult], Swing | None]:
    """Return what each end shows, and the swing that both share.

    Parameters
    ----------
    planes : Dataset
        Displacement at the bearing planes, and `cut_off` (end, time).
    machine : Machine
    rotor : RotorModel
    released : float or None
        s; None where the record does not hold the release: then from its first sample on.
    back : mapping
        What `tdbmon.analysis.returned.returned` says of each end.
    checks : list of Check
        Gets whether the radius from the arc is that from the swing.
    whirl : mapping
        Whirl of the ends that are seen: pressed by its own swing, the shaft lies deeper than at rest, and settles after it only.
    misread : mapping
        What `tdbmon.record.misread.misread` says of the probes.
    unused : mapping
        What `tdbmon.record.quality.left_out` says of the probes.
    unscaled : str, optional
        Why times after the release are not told, where they are on a wrong scale.
    """
    loads = static_loads(machine, rotor)
    start = float(planes.time[0]) if released is None else released
    seen = seen_ends(planes)
    outside = {
        end: [probe.name for probe in machine.probes_at(end) if misread.get(probe.name) == "range"] for end in seen
    }
    settled = {
        end: _after_whirl(
            settled_from(planes, end, machine.bearing(end).radial_gap.nominal, start=start),
            whirl[end].last_s,
            float(planes.time[-1]),
        )
        for end in seen
    }
    swing = None
    times = [s for s in settled.values() if not isinstance(s, NoCircle)]
    # along the rigid line only: one end at its probes would give the swing another shape
    if len(times) == len(machine.ends) and (planes.plane == "bearing").all():
        swing = find_swing(planes, machine, rotor, max(times))
    unseen = {end: NoCircle(_unseen(machine, end, unused)) for end in machine.ends}
    settled |= {end: NoCircle(cut) for end in seen if (cut := _cut_off(planes, end, start))}
    settled |= {end: NoCircle(_NOT_LYING) for end in seen if back[end]}
    settled |= {
        end: NoCircle(_OUTSIDE.format(probes=" and ".join(probes)))
        for end, probes in outside.items()
        if probes and isinstance(settled[end], NoCircle)
    }
    travels = {end: rest_travel(machine.bearing(end), loads[end]) for end in machine.ends}
    shares = carried_shares(machine, rotor)
    circles: dict[str, Gap | NoCircle] = {}
    for end in machine.ends:
        since = settled.get(end, unseen[end])
        if isinstance(since, NoCircle):
            circles[end] = since
        else:
            known = None if swing is None else swing.gap[end]
            circles[end] = _agreed(
                fit_gap(planes, end, machine, travels[end], since, known, shares[end]), end, known, checks
            )
    late = late_beginning(planes, {end: circles[end] for end in seen}) if released is None else ""
    late = unscaled or late
    ends = {}
    for end in machine.ends:
        travel, circle = travels[end], circles[end]
        air_gap = _air_gap(circle, travel, rotor.total_mass, loads[end])
        impossible = air_gap.why if isinstance(circle, Gap) else ""
        if impossible:
            checks.append(Check("machine and record", end, False, impossible))
        if swing is not None:
            from_swing = swing.gap[end]
        else:
            from_swing = Estimate.missing("um", "no swing of at least 150 cycles after the last bounce of both ends")
        contacts = None
        gap = circle if isinstance(circle, Gap) else None
        if gap is not None and not impossible:
            clearance = machine.bearing(end).balls.diametral_clearance.nominal
            contacts = find_contacts(planes, end, gap, travel, clearance, start, machine.gravity, late)
        first = contacts.first if contacts is not None else None
        stiffness = single_mass_stiffness(first, loads[end] / machine.gravity if machine.gravity else 0.0)
        if isinstance(circle, NoCircle) or impossible:
            stiffness = Estimate.missing("N/m", air_gap.why)
        elif contacts is not None and contacts.why:
            stiffness = Estimate.missing("N/m", contacts.why)
        ends[end] = EndResult(
            end,
            str(planes.plane.sel(end=end).item()),
            loads[end],
            travel,
            gap,
            air_gap,
            from_swing,
            contacts,
            stiffness,
            _deepest(planes, end, circle, start, contacts),
        )
    return ends, swing


def _unseen(machine: Machine, end: str, unused: Mapping[str, str]) -> str:
    """Say why an end has no orbit."""
    why = "; ".join(f"{p.name} {unused[p.name]}" for p in machine.probes_at(end) if p.name in unused)
    return f"no two usable probes in different directions see this end{': ' if why else ''}{why}"


def _after_whirl(settled: float | NoCircle, whirled: float, last: float) -> float | NoCircle:
    """Return from when the shaft lies on the ring and whirls no more, s."""
    if isinstance(settled, NoCircle) or whirled <= settled:
        return settled
    return whirled if last - whirled >= SETTLED_S else NoCircle(_WHIRLS.format(last=whirled, left=last - whirled))


def _agreed(circle: Gap | NoCircle, end: str, swing: Estimate | None, checks: list[Check]) -> Gap | NoCircle:
    """Return the circle of an end, and check its radius by the swing: where they disagree, neither is known to be right."""
    if isinstance(circle, NoCircle) or circle.agrees is None:
        return circle
    detail = f"radius {circle.from_arc} from the arc, {swing} from the swing"
    if not circle.agrees:
        detail += (
            ": the bore is not round (the arc tells its curvature at the bottom), or a probe's sensitivity is wrong"
        )
    checks.append(Check("gap from arc and swing agree", end, circle.agrees, detail))
    return circle if circle.agrees else NoCircle(f"{detail}; no circle is told")


def _cut_off(planes: xr.Dataset, end: str, start: float) -> str:
    """Say that the peaks cut off leave no circle to fit: what is left of the arc lies too near; "" where they are few."""
    share = float(planes.cut_off.sel(end=end, time=slice(start, None)).mean())
    if share <= FEW:
        return ""
    return f"{percent(share, 1)} of the samples after {start:.4g} s are cut off (see clipping): the shaft lies deepest there"


def _air_gap(gap: Gap | NoCircle, travel: RestTravel, mass: float, load: float) -> Estimate:
    """Radial air gap: the radius at rest less ball clearance and deflection; missing where nothing would be left of it."""
    if isinstance(gap, NoCircle):
        return Estimate.missing("um", gap.why)
    if gap.radius.value is None or gap.radius.sigma is None:
        return Estimate.missing("um", gap.radius.why)
    sigma = float(np.hypot(gap.radius.sigma, travel.sigma))
    if gap.radius.value <= travel.total:
        weight = f"rotor of {mass:.4g} kg, {load:.0f} N on this end"
        why = (
            f"the shaft rests at {um(gap.radius.value)}, but by the machine file ({weight}) clearance and deflection alone are"
            f" {um(travel.total)}: machine file and record do not fit. Check diameters, lengths and masses of the rotor, support"
            " stiffness and ball clearance, and the sensitivity of the probes"
        )
        return Estimate.missing("um", why)
    rule = "radius at rest less ball clearance and deflection of the machine file"
    return Estimate.from_sigma(gap.radius.value - travel.total, sigma, "um", rule)


def _deepest(planes: xr.Dataset, end: str, gap: Gap | NoCircle, start: float, contacts: Contacts | None) -> Estimate:
    """Largest excursion from the clearance centre after the release."""
    if isinstance(gap, NoCircle):
        return Estimate.missing("um", gap.why)
    if planes.cut_off.sel(end=end, time=slice(start, None)).any():
        return Estimate.missing("um", "peaks are cut off (see clipping), and there the shaft may have gone deepest")
    if contacts is not None and contacts.hidden:
        return Estimate.missing("um", f"{contacts.hidden}, and there the shaft may have gone deepest")
    if contacts is not None and contacts.why:
        return Estimate.missing("um", contacts.why)
    if gap.centre[0].value is None or gap.centre[1].value is None:
        return Estimate.missing("um", "the clearance centre is not known")
    xy = planes.displacement.sel(end=end).to_numpy()[:, planes.time.to_numpy() >= start]
    reach = np.hypot(xy[0] - gap.centre[0].value, xy[1] - gap.centre[1].value)
    rule = "largest distance from the clearance centre"
    return Estimate.from_sigma(float(np.nanmax(reach)), gap.centre[1].sigma or 0.0, "um", rule, "0-pk")
