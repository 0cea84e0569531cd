"""Synthetic drops of known values, by the same simulator as the model that is fitted (said so where figures are given)."""

from dataclasses import replace

import numpy as np
from tdbsim.machine import Tolerant, load_machine
from tdbsim.sensors import ProbeChain, SensorChain
from tdbsim.simulate import DropPlan, simulate

from tdbmon.identify.parameters import calibrated_machine
from tdbmon.shipped import shipped

NOISE = 0.25e-6
TRUTH = {
    "NDE.radial_gap": 268e-6,
    "DE.radial_gap": 241e-6,
    "NDE.support_stiffness": 1.19e8,
    "DE.support_stiffness": 4.4e8,
    "NDE.friction": 0.135,
    "DE.friction": 0.108,
}


def exact(value):
    return Tolerant(nominal=value.nominal, low=value.nominal, high=value.nominal)


def machine():
    """The shipped machine, of which gap, support stiffness and friction are unknown and the rest exact: quick to fit."""
    full = load_machine(shipped("short/machine.toml"))
    bearings = []
    for bearing in full.touchdown_bearings:
        known = {f: exact(getattr(bearing, f)) for f in ("support_damping", "inner_ring_drag", "contact_damping")}
        balls = bearing.balls.model_copy(update={"diametral_clearance": exact(bearing.balls.diametral_clearance)})
        bearings.append(bearing.model_copy(update={**known, "balls": balls}))
    magnets = [
        m.model_copy(update={f: exact(getattr(m, f)) for f in ("stiffness", "damping")}) for m in full.magnetic_bearings
    ]
    planes = [u.model_copy(update={f: exact(getattr(u, f)) for f in ("amount", "phase")}) for u in full.rotor.unbalance]
    rotor = full.rotor.model_copy(
        update={"unbalance": tuple(planes), "speed_decay_time": exact(full.rotor.speed_decay_time)}
    )
    return full.model_copy(
        update={"rotor": rotor, "touchdown_bearings": tuple(bearings), "magnetic_bearings": tuple(magnets)}
    )


def drop(values=TRUTH, speed=97.0, seed=1, seconds=0.07, levitated=0.08, bending=12, sampling=20e3):
    """A record from a machine with the given values, and the simulation that it is."""
    rng = np.random.default_rng(seed)
    plan = DropPlan(
        speed=speed,
        seconds=seconds,
        sampling=sampling,
        levitated=levitated + 0.3e-4 * rng.random(),
        set_point=tuple(map(tuple, rng.uniform(-25e-6, 25e-6, (2, 2)))),
        shaft_angle=float(rng.uniform(0, 2 * np.pi)),
        cage_angle=tuple(rng.uniform(0, 2 * np.pi / 11, 2)),
        sensors=SensorChain(probe=ProbeChain(noise=NOISE), speed_noise_hz=0.03),
        seed=seed,
    )
    record = simulate(calibrated_machine(machine(), values), plan, bending=bending)
    record.attrs["source_file"] = f"drop_{speed:g}.nc"
    return record


def guessed_early(measured, seconds=6e-6):
    """A prepared drop whose release is guessed too early, as noise may have it: its fits begin farther off."""
    angle = measured.angle - measured.omega * seconds
    return replace(measured, release=measured.release - seconds, angle=angle)
