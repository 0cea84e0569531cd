"""Usual 1X and 2X runout of the surface at each end, as its probes see it: per-drop parameters."""

from __future__ import annotations

import cmath
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from tdbsim.machine import Machine, Probe
from tdbsim.sensors import Runout, SensorChain

Array = NDArray[np.float64]

ORDERS = (1, 2)


def with_runout(chain: SensorChain, machine: Machine, own: Mapping[str, float]) -> SensorChain:
    """Return a chain whose probes also see the usual runout at their end."""
    probes = dict(chain.probes)
    for end in machine.ends:
        parts = [complex(own[f"{end}.runout_cosine_{k}"], own[f"{end}.runout_sine_{k}"]) for k in ORDERS]
        surface = tuple(Runout(k, abs(part), cmath.phase(part) / k) for k, part in zip(ORDERS, parts, strict=True))
        for probe in machine.probes_at(end):
            link = chain.of(probe.name)
            probes[probe.name] = replace(link, runout=(*link.runout, *surface))
    return replace(chain, probes=probes)


def runout_phasors(
    probes: Sequence[Probe], machine: Machine, chain: SensorChain, own: Mapping[str, float | Array]
) -> NDArray[np.complex128]:
    """Return phasors c (..., probes, orders) of the runout Re(c exp(i k angle)) under the probes, before the channels' gain, m.

    Parameters
    ----------
    probes : sequence of Probe
    machine : Machine
    chain : SensorChain
        For the probes' true angles.
    own : mapping
        A drop's values (SI); for several paths, (paths,) arrays.
    """
    axes = np.array([probe.angle + chain.of(probe.name).angle_error for probe in probes])
    parts = [
        [np.asarray(own[f"{end}.runout_cosine_{k}"]) + 1j * np.asarray(own[f"{end}.runout_sine_{k}"]) for k in ORDERS]
        for end in machine.ends
    ]
    rows = [machine.ends.index(probe.end) for probe in probes]
    under = np.moveaxis(np.array(parts)[rows], (0, 1), (-2, -1))
    return np.asarray(under * np.exp(-1j * np.multiply.outer(axes, ORDERS)))


def runout_at(phasors: NDArray[np.complex128], angle: Array) -> Array:
    """Return the runout (..., probes, n), m, of phasors (..., probes, 2) at shaft angles (..., n), rad."""
    cosine, sine = np.cos(angle), np.sin(angle)
    real = np.stack([cosine, cosine * cosine - sine * sine], axis=-2)
    imaginary = np.stack([sine, 2 * sine * cosine], axis=-2)
    return np.asarray(phasors.real @ real - phasors.imag @ imaginary)
