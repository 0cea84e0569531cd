"""The features of a record, held against what its samples say."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tdbsim.machine import load_machine

from tdbmon.analysis.analyse import analyse
from tdbmon.history.extract import features_of
from tdbmon.history.feature import KINDS
from tdbmon.record.read import read
from tests.history.conftest import YEARS


@pytest.fixture(scope="module")
def analysis():
    return analyse(read(YEARS / "drop_01.nc"), load_machine(YEARS / "machine.toml"))


def test_the_share_of_the_clearance_that_levitation_takes_is_that_of_its_farthest_sample(analysis):
    found = {f.key: f.estimate for f in features_of(analysis)}
    assert not KINDS["levitated_share"].judged
    for end in analysis.ends:
        before = analysis.planes.displacement.sel(end=end, time=slice(None, analysis.release_time.value - 2e-3)).values
        centre = [found[f"gap_centre_{axis}_um", end].value for axis in "xy"]
        far = np.hypot(*(before - np.asarray(centre)[:, None])).max()
        share = found["levitated_share", end]
        assert share.unit == "1"
        assert share.value == pytest.approx(far / analysis.machine.bearing(end).radial_gap.nominal, rel=0.05)
        assert share.low < share.value < share.high


def test_what_all_drops_share_is_in_no_interval(analysis):
    """Of the stiffness the share of its model; of V, which is over the radius, that of the radius."""
    apart = features_of(analysis)
    wide = {
        name: replace(end, gap=replace(end.gap, radius=end.gap.radius.widened(100e-6)))
        for name, end in analysis.ends.items()
    }
    assert features_of(replace(analysis, ends=wide)) == apart
    for feature in (f for f in apart if f.name == "stiffness_n_per_m"):
        assert feature.estimate.sigma < 0.12 * feature.estimate.value


def test_every_kind_of_feature_is_told_of_each_drop(analysis):
    assert {f.name for f in features_of(analysis)} == set(KINDS)
