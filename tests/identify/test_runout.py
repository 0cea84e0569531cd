"""A usual surface as probes see it, beside the same surface in the sensors' chain."""

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from tdbsim.sensors import ProbeChain, SensorChain, surface

from tdbmon.identify.runout import ORDERS, runout_at, runout_phasors, with_runout
from tests.identify import drops

MACHINE = drops.machine()
NAMES = [f"{end}.runout_{part}_{k}" for end in MACHINE.ends for part in ("cosine", "sine") for k in ORDERS]
PARTS = st.lists(st.floats(-3e-6, 3e-6), min_size=len(NAMES), max_size=len(NAMES))


@given(parts=PARTS, error=st.floats(-0.3, 0.3))
def test_it_is_what_the_chain_with_it_sees(parts, error):
    """Two ways to write one law: harmonics of the chain, from which records are made, and phasors, by which fits judge."""
    own = dict(zip(NAMES, parts, strict=True))
    chain = SensorChain(probes={"NDE_A": ProbeChain(angle_error=error)})
    angle = np.linspace(-7.0, 40.0, 300)
    found = runout_at(runout_phasors(MACHINE.probes, MACHINE, chain, own), angle)
    links = [with_runout(chain, MACHINE, own).of(probe.name) for probe in MACHINE.probes]
    axes = [probe.angle + link.angle_error for probe, link in zip(MACHINE.probes, links, strict=True)]
    np.testing.assert_allclose(found, surface([link.runout for link in links], angle, axes), atol=1e-19)


def test_several_paths_are_seen_as_each_alone():
    rng = np.random.default_rng(3)
    each = [dict(zip(NAMES, rng.normal(scale=1e-6, size=len(NAMES)), strict=True)) for _ in range(5)]
    angles = rng.uniform(0, 2 * math.pi, (5, 20))
    together = {name: np.array([own[name] for own in each]) for name in NAMES}
    found = runout_at(runout_phasors(MACHINE.probes, MACHINE, SensorChain(), together), angles)
    assert found.shape == (5, len(MACHINE.probes), 20)
    for row, own, angle in zip(found, each, angles, strict=True):
        alone = runout_at(runout_phasors(MACHINE.probes, MACHINE, SensorChain(), own), angle)
        assert np.ptp(alone) > 1e-7
        np.testing.assert_allclose(row, alone, rtol=1e-12, atol=1e-20)
