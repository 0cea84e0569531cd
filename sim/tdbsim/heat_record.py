"""Thermal results of a simulated drop as variables of its Dataset (`tdbsim.drop_record`).

``heat_end`` names the ends whose touchdown bearings have heat.  Constant between exchanges, along
(``heat_end``, ``time``): ``load_torque``, ``speed_torque``, ``spin_torque`` inside the bearing in N m; ``rub_heat``,
``inner_race_heat``, ``outer_race_heat`` in W; ``warm_gap`` (radial) and ``warm_clearance`` (of the balls, diametral) in m;
along (``heat_end``, ``part``, ``time``): ``growth`` of radii in m.  Linear between exchanges, along (``heat_end``,
``node``, ``time``): ``temperature_rise`` over the air in K (of nodes without mass during the interval before); along
(``heat_end``, ``time``): ``heat_supplied``, ``heat_lost``, ``heat_stored`` in J since the release.
"""

from __future__ import annotations

import numpy as np
import xarray as xr

from tdbsim import heat_exchange as columns
from tdbsim.drop_model import Array
from tdbsim.heat_coupling import Warmth
from tdbsim.heat_network import GROWTHS, NODES
from tdbsim.simulate import Trajectory


def add_heat(record: xr.Dataset, trajectory: Trajectory, warmth: Warmth) -> xr.Dataset:
    """Return the record with the variables listed in the docstring of this module."""
    ends, course = warmth.ends, warmth.course
    interval = np.searchsorted(warmth.sample, np.arange(len(trajectory.time)))  # that ends at or after each sample
    began = np.maximum(interval - 1, 0)
    since, length = trajectory.time - trajectory.plan.levitated, warmth.time[interval] - warmth.time[began]
    passed = np.divide(since - warmth.time[began], length, out=np.zeros_like(since), where=length > 0)

    def line(values: Array) -> Array:
        left = values[..., began]
        return np.asarray(left + passed * (values[..., interval] - left))

    torques = {
        "load_torque": course[:, :, columns.LOAD_TORQUE],
        "speed_torque": course[:, :, columns.SPEED_TORQUE],
        "spin_torque": course[:, :, columns.SPIN_INNER] + course[:, :, columns.SPIN_OUTER],
    }
    heats = course[:, :, [columns.RUB_HEAT, columns.INNER_HEAT, columns.OUTER_HEAT]]
    power = np.zeros_like(heats)
    power[:, 1:] = np.diff(heats, axis=1) / np.diff(warmth.time)[:, None]
    stored = np.einsum("ej,eji->ei", warmth.capacity, warmth.rise)
    found: dict[str, tuple[Array, str]] = {name: (values[:, began], "N m") for name, values in torques.items()}
    for k, name in enumerate(("rub_heat", "inner_race_heat", "outer_race_heat")):
        found[name] = power[:, interval, k], "W"
    found["warm_gap"] = warmth.acting[:, ends, 0].T[:, began], "m"
    found["warm_clearance"] = 2 * warmth.acting[:, ends, 1].T[:, began], "m"
    found["heat_supplied"] = line(heats.sum(axis=2)), "J"
    found["heat_lost"] = line(course[:, :, columns.LOST]), "J"
    found["heat_stored"] = line(stored), "J"
    along: dict[str, tuple[object, ...]] = {
        name: (("heat_end", "time"), values, {"units": unit}) for name, (values, unit) in found.items()
    }
    along["growth"] = (("heat_end", "part", "time"), warmth.grown[:, :, began], {"units": "m"})
    along["temperature_rise"] = (("heat_end", "node", "time"), line(warmth.rise), {"units": "K"})
    names = [trajectory.model.machine.ends[end] for end in ends]
    return record.assign(along | {"heat_end": names, "node": list(NODES), "part": list(GROWTHS)})
