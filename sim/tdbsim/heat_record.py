"""What heat did in a simulated drop, as variables of its Dataset (`tdbsim.drop_record`).

``heat_end`` names the ends whose touchdown bearings have heat.  Along (``heat_end``, ``time``), as they acted between one exchange
and the next: ``load_torque``, ``speed_torque``, ``spin_torque`` inside the bearing in N m; ``rub_heat``, ``inner_race_heat``,
``outer_race_heat`` in W; ``warm_gap`` (radial) and ``warm_clearance`` (of the balls, diametral) in m; along (``heat_end``,
``part``, ``time``): ``growth`` of radii in m.  On straight lines between exchanges: along (``heat_end``, ``node``, ``time``)
``temperature_rise`` over the air in K (of nodes without mass the mean of the interval before), and along (``heat_end``,
``time``) ``heat_supplied``, ``heat_lost``, ``heat_stored`` in J since the release.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from tdbsim import heat_coupling as columns
from tdbsim.drop_model import Array
from tdbsim.heat_coupling import Warmth, warm_bearings
from tdbsim.heat_network import GROWTHS, NODES
from tdbsim.simulate import Trajectory


def add_heat(record: xr.Dataset, trajectory: Trajectory, warmth: Warmth) -> xr.Dataset:
    """Return the record with the variables that the head of this module tells of."""
    ends, course = warmth.ends, warmth.course
    interval = np.searchsorted(warmth.sample, np.arange(len(trajectory.time)))  # that ends at or after each sample
    began = np.maximum(interval - 1, 0)
    since = trajectory.time - trajectory.plan.levitated

    def line(values: Array) -> Array:
        flat = values.reshape(-1, values.shape[-1])
        return np.array([np.interp(since, warmth.time, row) for row in flat]).reshape(*values.shape[:-1], len(since))

    record = record.assign_coords(
        heat_end=[trajectory.model.machine.ends[end] for end in ends], node=list(NODES), part=list(GROWTHS)
    )
    torques = {
        "load_torque": course[:, :, columns.LOAD_TORQUE],
        "speed_torque": course[:, :, columns.SPEED_TORQUE],
        "spin_torque": course[:, :, columns.SPIN_INNER] + course[:, :, columns.SPIN_OUTER],
    }
    for name, values in torques.items():
        record[name] = (("heat_end", "time"), values[:, began], {"units": "N m"})
    heats = course[:, :, [columns.RUB_HEAT, columns.INNER_HEAT, columns.OUTER_HEAT]]
    power = np.zeros_like(heats)
    power[:, 1:] = np.diff(heats, axis=1) / np.diff(warmth.time)[:, None]
    for k, name in enumerate(("rub_heat", "inner_race_heat", "outer_race_heat")):
        record[name] = (("heat_end", "time"), power[:, interval, k], {"units": "W"})
    gap, half_clearance = warmth.acting[began][:, ends, 0].T, warmth.acting[began][:, ends, 1].T
    record["warm_gap"] = (("heat_end", "time"), gap, {"units": "m"})
    record["warm_clearance"] = (("heat_end", "time"), 2 * half_clearance, {"units": "m"})
    record["growth"] = (("heat_end", "part", "time"), warmth.grown[:, :, began], {"units": "m"})
    record["temperature_rise"] = (("heat_end", "node", "time"), line(warmth.rise), {"units": "K"})
    bearings = warm_bearings(trajectory.model)
    stored = np.stack([bearings[end].network.capacity @ warmth.rise[k] for k, end in enumerate(ends)])
    for name, values in (
        ("heat_supplied", heats.sum(axis=2)), ("heat_lost", course[:, :, columns.LOST]), ("heat_stored", stored)
    ):  # fmt: skip
        record[name] = (("heat_end", "time"), line(values), {"units": "J"})
    return record
