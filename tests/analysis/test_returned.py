"""Records in which the shaft is back where it levitated: by a high-pass, or taken up again."""

import numpy as np
import pytest
from scipy.signal import lfilter

from tdbmon.analysis.analyse import analyse
from tdbmon.analysis.axes import to_planes
from tdbmon.analysis.returned import returned
from tdbmon.identify.drop import measured_drop
from tdbmon.record.assign import assign
from tdbmon.record.read import read
from tdbmon.shipped import shipped

PROBES = ("NDE_A", "NDE_B", "DE_A", "DE_B")
RELEASE_S = 0.1


@pytest.fixture(scope="module")
def record(machine):
    return assign(read(shipped("short/drop_100.nc")), machine).load()


def high_passed(record, corner_hz):
    """The record as AC-coupled inputs of first order see it."""
    out = record.copy()
    for name in PROBES:
        time = record[record[name].dims[0]].values
        keeps = np.exp(-2 * np.pi * corner_hz * (time[1] - time[0]))
        values = record[name].values - record[name].values[:200].mean()
        out[name] = record[name].copy(data=lfilter([1.0, -1.0], [1.0, -keeps], values))
    return out


def taken_up(record):
    """The record with the magnetic bearings back in force after 0.2 s: a slow lift to where the shaft levitated."""
    out = record.copy()
    for name in PROBES:
        time = record[record[name].dims[0]].values
        lies = np.interp(time, [RELEASE_S + 0.2, RELEASE_S + 0.3], [1.0, 0.0])
        start = record[name].values[time < RELEASE_S].mean()
        out[name] = record[name].copy(data=start + lies * (record[name].values - start))
    return out


def held_for_a_while(record, begin_s, end_s):
    """The record with the shaft held where it levitated from one time to another, as between two drops."""
    out = record.copy()
    for name in PROBES:
        time, values = record[record[name].dims[0]].values, record[name].values
        (held,) = np.nonzero((time > begin_s) & (time < end_s))
        hovers = values.copy()
        hovers[held] = values[held % np.searchsorted(time, RELEASE_S)]
        out[name] = record[name].copy(data=hovers)
    return out


def told(record, machine, end="NDE"):
    return returned(to_planes(record, machine), end, machine, RELEASE_S)


@pytest.mark.parametrize("end", ["NDE", "DE"])
def test_a_shaft_at_the_bottom_has_not_returned(record, machine, end):
    assert told(record, machine, end) == ""


@pytest.mark.parametrize("faulty", [lambda r: high_passed(r, 3.0), lambda r: high_passed(r, 10.0), taken_up])
def test_ac_coupling_and_a_shaft_taken_up_again_are_told(record, machine, faulty):
    said = told(faulty(record), machine)
    assert "AC coupled" in said
    assert "lifted the rotor again" in said


def test_a_shaft_held_between_two_drops_is_told(record, machine):
    """Where it comes to rest is right: the second drop ends at the bottom too."""
    assert told(held_for_a_while(record, 0.3, 0.4), machine).startswith("from 0.3 s to 0.4 s")


def test_a_shaft_held_only_as_a_long_record_ends_is_told(coastdown_record, machine):
    """In the mean of the record's last tenth it still lies near the bottom."""
    long = assign(coastdown_record, machine)
    assert told(long, machine) == ""
    assert told(held_for_a_while(long, 81.0, 90.0), machine).startswith("from 81 s to 85 s")


def test_a_shaft_that_whirls_round_the_ring_has_not_returned(record, machine):
    planes = to_planes(record, machine).copy(deep=True)
    after = planes.time.values >= RELEASE_S
    turned = 2 * np.pi * 60 * planes.time.values[after]
    start = planes.displacement.values[:, :, ~after].mean(axis=2)
    circle = 280e-6 * np.stack([np.cos(turned), np.sin(turned)])
    planes.displacement.values[:, :, after] = start[:, :, None] + circle
    assert returned(planes, "NDE", machine, RELEASE_S) == ""


def test_what_cannot_tell_says_nothing(record, machine):
    faulty = high_passed(record, 3.0)
    planes = to_planes(faulty, machine)
    assert returned(planes, "NDE", machine, None) == ""
    assert returned(planes.sel(time=slice(None, RELEASE_S + 0.2)), "NDE", machine, RELEASE_S) == ""
    assert (
        returned(planes, "NDE", machine.model_copy(update={"gravity": 0.0}), RELEASE_S) == ""
    )  # upright: lies nowhere
    assert returned(planes.where(planes.time < RELEASE_S), "NDE", machine, RELEASE_S) == ""


def test_no_clearance_circle_is_told_and_no_probe_accused(record, machine):
    result = analyse(high_passed(record, 3.0), machine)
    for end in machine.ends:
        assert result.ends[end].gap is None
        assert "does not stay on its bearing" in result.ends[end].air_gap.why
        (row,) = (c for c in result.checks if c.check == "stays down" and c.channel == end)
        assert not row.passed
        assert "inverted" not in row.detail


def test_a_fit_to_such_a_record_says_so(record, machine):
    assert not any("AC coupled" in remark for remark in measured_drop(record, machine).remarks)
    remarks = measured_drop(high_passed(record, 3.0), machine).remarks
    assert sum("AC coupled" in remark for remark in remarks) == len(machine.ends)
