"""A simulated drop as a Dataset: the channels that a machine's sensors would record, and unmeasured quantities.

Channels along ``time``, named as in the machine's files: each probe in m, speed in Hz, keyphasor (0 or 1).
Along (``end``, ``time``): ``rotor_x``, ``rotor_y``, ``ring_x``, ``ring_y``, ``support_x``, ``support_y`` in m;
``force_x``, ``force_y`` on the rotor, ``normal_force``, ``friction_force`` (positive counter-clockwise on the rotor) in N;
``slip_speed`` in m/s; ``depth`` in m; ``ring_speed`` in Hz, ``ring_angle`` and ``cage_angle`` in rad, positive counter-clockwise.
Along (``end``, ``ball``, ``time``): ``ball_load`` in N.  Along (``energy_kind``, ``time``): ``energy`` in J; along
(``work_kind``, ``time``): ``work`` in J, dissipated or supplied since the release.
Along (``probe``, ``time``): ``shaft_x``, ``shaft_y`` in m, the shaft's centre in the plane of each probe.
Along ``time``: ``shaft_angle`` in rad and ``rotor_speed`` in Hz, positive counter-clockwise.
Temperatures, growths, torques and heats of bearings with ``heat``: see `tdbsim.heat_record`.
"""

from __future__ import annotations

import math

import numpy as np
import xarray as xr

from tdbsim import state_layout
from tdbsim.ball_bearing import cage_angle
from tdbsim.drop_model import Array
from tdbsim.errors import InputError
from tdbsim.observe import ENERGIES, FORCES, observed
from tdbsim.sensors import Motion, at_probes, measure
from tdbsim.simulate import Trajectory
from tdbsim.state_layout import LEDGER

_PEAK = {"splitting": "of all steps", "dormand_prince": "of the samples"}
_FORCE_UNITS = {"slip_speed": "m/s", "depth": "m"}


def sensed(trajectory: Trajectory) -> xr.Dataset:
    """Return the record of a drop by the machine's sensors, with the effects that act on them."""
    model, plan, n = trajectory.model, trajectory.plan, trajectory.model.n
    machine, state = model.machine, trajectory.state
    x, y = at_probes(machine, model.modes, *_displaced(state, n))
    omega = state[:, state_layout.omega(n)]
    motion = Motion(trajectory.time, x, y, state[:, state_layout.shaft_angle(n)], np.abs(omega) / (2 * math.pi))
    chain = plan.sensors
    for effect in model.effects:
        chain = effect.sense(chain, machine, plan.sampling)
    record = measure(motion, chain, machine, np.random.default_rng(plan.seed), f"Simulated drop from {plan.speed:g} Hz")
    for probe in machine.probes:
        record[machine.channel_in_file(probe.name)].attrs |= {"end": probe.end, "angle_rad": probe.angle}
    return record


def drop_record(trajectory: Trajectory) -> xr.Dataset:
    """Return the Dataset of a drop; its variables are listed in the docstring of this module."""
    model, plan, n = trajectory.model, trajectory.plan, trajectory.model.n
    machine, state = model.machine, trajectory.state
    seen = observed(trajectory)
    forces, loads, energies = seen.forces, seen.loads, seen.energies

    record = sensed(trajectory).assign_coords(
        probe=[probe.name for probe in machine.probes],
        end=list(machine.ends),
        ball=np.arange(1, loads.shape[1] + 1),
        energy_kind=list(ENERGIES),
        work_kind=list(LEDGER),
    )
    omega = state[:, state_layout.omega(n)]
    x, y = at_probes(machine, model.modes, *_displaced(state, n))
    record["shaft_x"] = (("probe", "time"), x, {"units": "m"})
    record["shaft_y"] = (("probe", "time"), y, {"units": "m"})
    place = np.array([state_layout.bodies(n, end) for end in range(2)])
    for name, column in (("ring", 0), ("support", 2)):
        for axis in range(2):
            values = state[:, place + column + axis].T
            record[f"{name}_{'xy'[axis]}"] = (("end", "time"), values, {"units": "m"})
    for name, displaced in zip(("rotor_x", "rotor_y"), _displaced(state, n), strict=True):
        record[name] = (("end", "time"), model.arrays.at_end @ displaced, {"units": "m"})
    for k, name in enumerate(FORCES):
        record[name] = (("end", "time"), forces[:, k], {"units": _FORCE_UNITS.get(name, "N")})
    record["ball_load"] = (("end", "ball", "time"), loads, {"units": "N"})
    record["ring_speed"] = (("end", "time"), state[:, state_layout.ring_speeds(n)].T / (2 * math.pi), {"units": "Hz"})
    ring_angle = state[:, state_layout.ring_angles(n)]
    cage = cage_angle(model.arrays.end.T, ring_angle)
    record["cage_angle"] = (("end", "time"), cage.T, {"units": "rad"})
    record["ring_angle"] = (("end", "time"), ring_angle.T, {"units": "rad"})
    record["shaft_angle"] = ("time", state[:, state_layout.shaft_angle(n)], {"units": "rad"})
    record["rotor_speed"] = ("time", omega / (2 * math.pi), {"units": "Hz"})
    record["energy"] = (("energy_kind", "time"), energies, {"units": "J"})
    record["work"] = (("work_kind", "time"), state[:, state_layout.work(n) :].T, {"units": "J"})
    peak = np.maximum(trajectory.peak_normal, forces[:, FORCES.index("normal_force")].max(axis=1))
    record["peak_normal_force"] = ("end", peak, {"units": "N", "long_name": _PEAK[plan.method]})
    if trajectory.warmth is not None:
        from tdbsim.heat_record import add_heat

        record = add_heat(record, trajectory, trajectory.warmth)
    record.attrs |= {
        "synthetic": "yes",
        "machine": machine.name,
        "gravity_m_per_s2": machine.gravity,
        "release_time_s": plan.levitated,
        "speed_hz": plan.speed,
        "seed": plan.seed,
        "bending_modes": model.modes.bending,
        "method": plan.method,
        "effects": "; ".join(str(effect) for effect in model.effects),
    }
    _check_finite(record)
    return record


def _displaced(state: Array, n: int) -> tuple[Array, Array]:
    """Return the modal displacements (n, k) along x and y."""
    return state[:, state_layout.modes_x(n)].T, state[:, state_layout.modes_y(n)].T


def _check_finite(record: xr.Dataset) -> None:
    for name in record.data_vars:
        if not np.all(np.isfinite(record.variables[name].values)):
            raise InputError(f"the simulated '{name}' is not finite: the run did not converge; give a smaller step")
