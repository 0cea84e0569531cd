"""JSON form of an analysis.  Its names are a contract: new ones may be added, but none is ever renamed."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from tdbsim.rotor import static_loads

from tdbmon.analysis.levitation import unknown
from tdbmon.analysis.release import Release
from tdbmon.analysis.rest import rest_travel
from tdbmon.analysis.result import NO_SPEED, Analysis, EndResult
from tdbmon.analysis.rundown import RunDown
from tdbmon.analysis.vibration_zone import zone
from tdbmon.estimate import Estimate
from tdbmon.record.timebase import usual_rate

_NO_MODEL = "a simulation fitted to the record is needed (tdbmon analyse --forces); displacements alone are not enough"


def analysis_json(analysis: Analysis) -> dict[str, Any]:
    """Return an analysis as plain dictionaries, lists, numbers and strings; quantities include unit and interval."""
    release = analysis.release
    no_release = "no release was found in the record"
    ends = {name: analysis.ends.get(name) or _unseen(name, analysis) for name in analysis.machine.ends}
    return {
        "record": _record(analysis),
        "machine": analysis.machine.name,
        "release_time_s": (release.time if release else Estimate.missing("s", no_release)).to_json(),
        "force_decay_ms": (release.force_decay if release else Estimate.missing("ms", no_release)).to_json(),
        "release": {end: _state(release, end, ends[end].held) for end in analysis.machine.ends},
        "levitation": {end: _levitated(analysis, end) for end in analysis.machine.ends},
        "phases": [{"name": p.name, "start_s": p.start, "end_s": p.end} for p in analysis.phases],
        "speed": _speed(analysis.rundown or _no_speed()) | _coast_down(analysis),
        "ends": {name: _end(end, analysis) for name, end in ends.items()},
        "lines": [
            {
                "kind": line.kind,
                "order": line.order,
                "frequency_hz": line.frequency.to_json(),
                "direction": line.direction,
                "end": line.end,
                "name": line.name,
                "amplitude_um": line.amplitude.to_json(),
                "first_s": line.first_s,
                "last_s": line.last_s,
            }
            for line in analysis.lines
        ],
        "drifting_swings": [
            {
                "name": swing.name,
                "end": swing.end,
                "lowest_hz": swing.lowest.to_json(),
                "highest_hz": swing.highest.to_json(),
                "amplitude_um": swing.amplitude.to_json(),
                "first_s": swing.first_s,
                "last_s": swing.last_s,
            }
            for swing in analysis.drifting
        ],
        "whirl": _whirl(analysis),
        "indicators": {
            "settled_s": analysis.settled.to_json(),
            **{f"deepest_um_{name}": end.deepest.to_json() for name, end in ends.items()},
        },
        "quality": [
            {"check": c.check, "channel": c.channel, "passed": bool(c.passed), "detail": c.detail}
            for c in analysis.checks
        ],
    }


def _record(analysis: Analysis) -> dict[str, Any]:
    attributes = analysis.record.attrs
    time = analysis.planes.time.to_numpy() if analysis.planes is not None else analysis.speed_time
    return {
        "file": str(attributes.get("source_file", "")),
        "sha256": str(attributes.get("sha256", "")),
        "sampling_hz": usual_rate(time) if len(time) > 1 else None,
        "duration_s": float(time[-1] - time[0]) if len(time) else None,
        "drop_time": attributes.get("drop_time"),
        "missing": [str(name) for name in np.atleast_1d(attributes.get("missing", []))],
    }


def _state(release: Release | None, end: str, held: str) -> dict[str, Any]:
    """Return position and velocity of an end at the release; missing if the end was `held` in levitation."""
    state = release.states.get(end) if release else None
    why = held or f"no orbit is seen at {end} around the release" if release else "no release was found in the record"
    return {
        "x_um": (state.x if state else Estimate.missing("um", why)).to_json(),
        "y_um": (state.y if state else Estimate.missing("um", why)).to_json(),
        "vx_mm_s": (state.vx if state else Estimate.missing("mm/s", why)).to_json(),
        "vy_mm_s": (state.vy if state else Estimate.missing("mm/s", why)).to_json(),
    }


def _levitated(analysis: Analysis, end: str) -> dict[str, Any]:
    """Return position and orbit of the shaft at an end before the release, and the zone of ISO 14839-2."""
    found = analysis.levitation.get(end) or unknown("no orbit is seen at this end before a release")
    return {
        "x_um": found.x.to_json(),
        "y_um": found.y.to_json(),
        "once_per_revolution_um": found.once.to_json(),
        "noise_um": found.noise.to_json(),
        "from_centre_um": found.reach.to_json(),
        "share_of_clearance": found.share.to_json(),
        "zone": zone(found.share) or None,
    }


def _unseen(end: str, analysis: Analysis) -> EndResult:
    """Return the result of an end without an orbit in the record."""
    found = next(
        (c.detail for c in analysis.checks if c.check == "orbit" and not (c.passed and c.channel)),
        f"no orbit is seen at {end}",
    )
    bearing, load = analysis.machine.bearing(end), static_loads(analysis.machine, analysis.rotor)[end]
    return EndResult.without_contact(end, "none", load, rest_travel(bearing, load), found)


def _no_speed() -> RunDown:
    initial, ratio = Estimate.missing("Hz", NO_SPEED), Estimate.missing("1", NO_SPEED)
    return RunDown.missing(NO_SPEED, initial=initial, source="", pulse_ratio=ratio)


def _speed(rundown: RunDown) -> dict[str, Any]:
    return {
        "initial_hz": rundown.initial.to_json(),
        "decay_time_s": rundown.decay_time.to_json(),
        "models": [
            {
                "name": model.name,
                "parameters": {name: value.to_json() for name, value in model.parameters.items()},
                "rms_hz": model.rms,
                "bic": model.bic,
                "held_out_rms_hz": model.held_out_rms,
                "chosen": model.chosen,
                "refused": model.refused,
            }
            for model in rundown.models
        ],
        "standstill_time_s": rundown.standstill_time.to_json(),
        "drag_torque_n_m": rundown.drag_torque.to_json(),
        "lost_speed_hz": rundown.lost_speed.to_json(),
    }


def _coast_down(analysis: Analysis) -> dict[str, Any]:
    """Return the times from the release until the speed has fallen to a half and to a tenth."""
    found = analysis.coast_down
    return {"half_speed_after_s": found.half.to_json(), "tenth_speed_after_s": found.tenth.to_json()}


def _end(end: EndResult, analysis: Analysis) -> dict[str, Any]:
    circle, first = end.circle, end.first
    return {
        "plane": end.plane,
        "static_load_n": end.load,
        "fell": analysis.falls and not end.held if end.seen else None,
        "gap_lower_um": circle.lower.to_json(),
        "gap_upper_um": circle.upper.to_json(),
        "gap_centre_um": [each.to_json() for each in circle.centre],
        "gap_radius_um": circle.radius.to_json(),
        "gap_from_arc_um": circle.from_arc.to_json(),
        "gap_from_swing_um": end.gap_from_swing.to_json(),
        "air_gap_um": end.air_gap.to_json(),
        "gap_oval_um": circle.oval.to_json(),
        "swing_hz": analysis.swings[0].to_json(),
        "first_contact_s": first.touch.to_json(),
        "first_contact_duration_s": first.duration.to_json(),
        "rebound_um": first.rebound.to_json(),
        **_contacts(end.contact_count),
        "restitution": first.restitution.to_json(),
        "stiffness_n_per_m": end.stiffness.to_json(),
        "support": {
            "mass_kg": Estimate.missing("kg", _NO_MODEL).to_json(),
            "stiffness_n_per_m": Estimate.missing("N/m", _NO_MODEL).to_json(),
            "damping_n_s_per_m": Estimate.missing("N s/m", _NO_MODEL).to_json(),
        },
        "peak_force_n": Estimate.missing("N", _NO_MODEL).to_json(),
        "stress_mpa": {
            "max": Estimate.missing("MPa", _NO_MODEL).to_json(),
            **dict.fromkeys(("mean", "median", "q1", "q3", "outliers")),
            "why": _NO_MODEL,
        },
        "ring_at_speed_s": Estimate.missing("s", "no channel measures the inner ring's speed; " + _NO_MODEL).to_json(),
    }


def _contacts(count: Estimate) -> dict[str, Any]:
    """Return the number of contacts, as plain numbers for compatibility."""
    bounds = {"contacts": count.value, "contacts_low": count.low, "contacts_high": count.high}
    return {name: None if n is None else int(n) for name, n in bounds.items()} | {"contacts_why": count.why or None}


def _any(found: Iterable[bool | None]) -> bool | None:
    """Return whether any is true; None if none is, but one is unknown."""
    known = list(found)
    return True if any(known) else None if None in known else False


def _whirl(analysis: Analysis) -> dict[str, Any]:
    """Return whether and where the shaft whirled; null if the record shows no orbit."""
    whirls, unseen = analysis.whirl, analysis.planes is None
    return {
        "backward": None if unseen else _any(w.backward for w in whirls.values()),
        "full": None if unseen else _any(w.full for w in whirls.values()),
        "ends": {
            end: {
                "backward": w.backward,
                "full": w.full,
                "backward_onset_s": w.backward_onset.to_json(),
                "full_onset_s": w.full_onset.to_json(),
            }
            for end, w in whirls.items()
        },
    }
