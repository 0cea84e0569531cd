"""Records whose times are wrong, that tell of their speed for a while only, or whose readings are those of a filter."""

from __future__ import annotations

import re

import pytest
import xarray as xr
from scipy.signal import butter, lfilter
from tdbsim.errors import InputError
from tdbsim.machine import Machine, load_machine

from tdbmon.analysis.analyse import analyse
from tdbmon.analysis.result import Analysis
from tdbmon.identify.drop import measured_drop
from tdbmon.record.read import read
from tdbmon.shipped import shipped

PROBES = ("NDE_A", "NDE_B", "DE_A", "DE_B")


@pytest.fixture(scope="module")
def machine() -> Machine:
    return load_machine(shipped("short/machine.toml"))


@pytest.fixture
def record() -> xr.Dataset:
    return read(shipped("short/drop_100.nc"))


def failed(analysis: Analysis) -> str:
    return "\n".join(f"{each.check} {each.channel}: {each.detail}" for each in analysis.checks if not each.passed)


def test_a_sampling_interval_that_is_no_drops_leaves_the_speed_only(record: xr.Dataset, machine: Machine) -> None:
    """An untimed task of a logger writes 1 s."""
    interval = float(record.time[1] - record.time[0])
    slow = record.assign_coords(time=("time", record.time.values / interval, record.time.attrs))
    analysis = analyse(slow, machine)
    assert analysis.planes is None
    assert "the probes are sampled at 1 Hz" in failed(analysis)
    assert "correct the sampling interval" in failed(analysis)


def test_a_keyphasor_that_ends_before_the_release_costs_the_run_down_only(record: xr.Dataset, machine: Machine) -> None:
    """As where a logger was cut off while it wrote: its channels end one after the other."""
    key = record["keyphasor"][record.time.values < 0.09]
    short = record.drop_vars(["speed", "keyphasor"]).assign(keyphasor=key.rename(time="time_key"))
    analysis = analyse(short, machine)
    assert analysis.rundown is None
    assert re.search(r"not at the release \(0\.(0999|1000)\d s\): no run-down is evaluated", failed(analysis))
    whole = analyse(record, machine)
    for end, found in analysis.ends.items():
        assert found.gap.radius.value == pytest.approx(whole.ends[end].gap.radius.value, rel=0.02)


@pytest.mark.filterwarnings("error")
def test_probes_behind_a_filter_that_starts_with_the_record_have_no_levitated_stretch(
    record: xr.Dataset, machine: Machine
) -> None:
    """The filter's own decay from the first sample on looks like a release before it."""
    b, a = butter(1, 0.5 * 2 / 20000, "high")
    filtered = record.assign({name: record[name].copy(data=lfilter(b, a, record[name].values)) for name in PROBES})
    analysis = analyse(filtered, machine)
    assert analysis.release is None
    assert "without a levitated stretch" in failed(analysis)


def test_a_clock_that_jumps_leaves_the_run_down() -> None:
    """Law, release and loss were those of a rotor that kept its speed for as long as the clock jumped."""
    compressor, record = load_machine(shipped("years/machine.toml")), read(shipped("years/drop_03.nc"))
    time = record.time.values
    jumped = record.assign_coords(time=("time", time + 0.4 * (time >= 2.0), record.time.attrs))
    whole, found = analyse(record, compressor), analyse(jumped, compressor)
    assert whole.rundown is not None and found.rundown is not None
    for name in ("initial", "lost_speed", "decay_time"):
        assert getattr(found.rundown, name).value == pytest.approx(getattr(whole.rundown, name).value, rel=1e-6)
    assert "the clock jumps by 0.4 s at 2 s" in failed(found) and "clock" not in failed(whole)


def test_a_probe_that_fails_for_good_says_where_to_cut_the_record(record: xr.Dataset, machine: Machine) -> None:
    failing = record.copy()
    failing["NDE_B"] = record["NDE_B"].where(record.time < 0.2)
    why = analyse(failing, machine).ends["NDE"].air_gap.why
    cure = "NDE_B has no value in 60 % of the samples (limit 50 %) and none from 0.2 s on: cut the record at 0.2 s"
    assert cure in why
    remarks = measured_drop(failing, machine).remarks
    assert any(cure.removeprefix("NDE_B ") in remark and "without probe 'NDE_B'" in remark for remark in remarks)
    cut = analyse(failing.sel(time=slice(0, 0.1999)), machine)
    assert cut.ends["NDE"].plane == "bearing"


def test_an_end_without_an_orbit_names_the_probe_that_it_lacks(record: xr.Dataset, machine: Machine) -> None:
    why = analyse(record.drop_vars("DE_A"), machine).ends["DE"].air_gap.why
    assert "DE_A is not in the record" in why


@pytest.mark.parametrize("samples", [1, 10, 100])
def test_a_record_of_a_few_samples_is_refused_by_name(samples: int, record: xr.Dataset, machine: Machine) -> None:
    name = record.attrs["source_file"]
    with pytest.raises(InputError, match=f"{name}: the record is too short: the probes have {samples} sample"):
        analyse(record.isel(time=slice(0, samples)), machine)
