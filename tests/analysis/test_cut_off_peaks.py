"""A converter whose range is too small: what depends on the peaks it cut off is withheld, what does not is still told."""

from __future__ import annotations

import numpy as np
import pytest

from tdbmon.analysis.analyse import analyse
from tdbmon.identify.drop import measured_drop
from tests.shipped_drops import analysed, recorded

SOUND = "short/drop_100"


def cut(machine, share, *probes):
    """A shipped record with this share of the deepest samples of some probes at one limit."""
    record = recorded(SOUND)
    for probe in probes:
        channel = machine.channel_in_file(probe)
        values = record[channel]
        record[channel] = np.maximum(values, float(values.quantile(share))).assign_attrs(values.attrs)
    return record


def test_a_cut_arc_tells_no_circle(machine):
    record = cut(machine, 0.1, "NDE_A", "NDE_B")
    whole, found = analysed(SOUND), analyse(record, machine)
    end = found.ends["NDE"]
    assert end.gap is None
    assert end.contacts is None
    for estimate in (end.air_gap, end.stiffness, end.deepest):
        assert estimate.value is None
        assert "are clipped" in estimate.why
    assert found.release.time.value == pytest.approx(whole.release.time.value, abs=1e-6)
    assert found.release.states["NDE"].x.value == pytest.approx(whole.release.states["NDE"].x.value, abs=1e-9)
    assert {c.check for c in found.checks if not c.passed} == {"clipping"}


def test_a_cut_probe_leaves_the_other_end(machine):
    """Along the rigid line its missing peaks would take both ends."""
    record = cut(machine, 0.5, "NDE_B")
    whole, found = analysed(SOUND).ends["DE"], analyse(record, machine)
    assert found.ends["NDE"].gap is None
    assert "are clipped" in found.ends["NDE"].air_gap.why
    assert_same_end(found.ends["DE"], whole)
    assert any(c.check == "orbit" and c.channel == "DE" and "NDE_B (see clipping)" in c.detail for c in found.checks)


def test_samples_missing_over_the_first_contact_leave_the_other_end(machine):
    """Along the rigid line the other end's first contact was told 7 ms late."""
    record = cut(machine, 0.0)
    values = record["NDE_A"].copy()
    values[2100:2300] = np.nan  # 5 to 15 ms after the release
    record["NDE_A"] = values
    whole, found = analysed(SOUND).ends["DE"].contacts, analyse(record, machine)
    first = found.ends["DE"].contacts.first
    assert first.touch.value == pytest.approx(whole.first.touch.value, abs=1e-4)
    assert first.touch.low <= whole.first.touch.value <= first.touch.high
    assert "no sample has a value" in found.ends["NDE"].contacts.why
    assert any(c.check == "orbit" and c.channel == "DE" and "NDE_A (see nan)" in c.detail for c in found.checks)


def test_probes_without_their_offset_leave_the_other_end(machine):
    """As where the machine file lacks the set-point voltage of one end's probes."""
    record = recorded(SOUND)
    for probe in ("NDE_A", "NDE_B"):
        channel = machine.channel_in_file(probe)
        record[channel] = (record[channel] + 1.5e-3).assign_attrs(record[channel].attrs)
    whole, found = analysed(SOUND).ends["DE"], analyse(record, machine)
    assert {c.channel for c in found.checks if c.check == "range" and not c.passed} == {"NDE_A", "NDE_B"}
    assert "NDE_A and NDE_B read displacements that no rotor can reach" in found.ends["NDE"].air_gap.why
    assert_same_end(found.ends["DE"], whole)


def assert_same_end(found, whole):
    """The same contacts, seen at the end's own probes."""
    assert found.plane == "probe"
    assert whole.plane == "bearing"
    assert found.gap.radius.value == pytest.approx(whole.gap.radius.value, rel=0.1)
    assert found.contacts.events[0].start == pytest.approx(whole.contacts.events[0].start, abs=5e-4)


def test_of_one_peak_cut_off_only_the_greatest_excursion_is_withheld(machine):
    record = cut(machine, 0.001, "NDE_B")
    whole, found = analysed(SOUND).ends["NDE"], analyse(record, machine).ends["NDE"]
    assert found.deepest.value is None
    assert found.gap.radius.value == pytest.approx(whole.gap.radius.value, abs=0.5e-6)
    assert found.contacts.first.rebound.value == pytest.approx(whole.contacts.first.rebound.value, abs=0.5e-6)


def test_samples_cut_off_take_no_part_in_the_calibration(machine):
    drop = measured_drop(cut(machine, 0.02, "NDE_A", "NDE_B"), machine)
    assert [probe.name for probe in drop.probes] == ["NDE_A", "NDE_B", "DE_A", "DE_B"]
    gone = np.isnan(drop.reading).mean(axis=1)
    np.testing.assert_allclose(gone[:2], 0.02, atol=0.005)
    assert not gone[2:].any()
    assert any("missing or cut off are not used in the fit" in remark for remark in drop.remarks)
