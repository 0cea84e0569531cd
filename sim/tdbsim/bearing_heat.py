"""Heat, temperatures and growth of a touchdown bearing in a simulated drop, computed after the run.

The coupling is one-way: forces, slip and speeds of the run make heat here, but the growth found here does not act back on
the gap and the balls of that run, nor does the torque found here brake its ring.  Inside a run the effect
`thermal_growth` closes the gap with the heat of friction, and `inner_ring_drag` brakes the ring.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from tdbsim.bearing_torque import TorqueLaw, race_heat
from tdbsim.errors import InputError, did_you_mean
from tdbsim.heat_network import NODES, BearingBody, Temperatures, growth, temperatures
from tdbsim.hertz import BearingGeometry

if TYPE_CHECKING:
    import xarray as xr


def heat_drop(
    drop: xr.Dataset,
    end: str,
    body: BearingBody,
    geometry: BearingGeometry,
    law: TorqueLaw,
    spin_friction: float,
    step: float = 1e-3,
) -> xr.Dataset:
    """Return what the bearing of one end suffers in a drop.

    Parameters
    ----------
    drop : xarray.Dataset
        Of `tdbsim.simulate.simulate`.
    end : str
    body, geometry, law
        Of all rows of the bearing together: the run's balls stand for them.
    spin_friction : float
        Coefficient of the balls spinning on the races.
    step : float
        Of the heat network, s, at least a sample; its fastest bodies take tenths of a second.  Heats are averaged over a
        step, so no energy is lost; temperatures between steps are on straight lines, and where there is no mass (rub,
        contacts) they are those of the mean heat of a step.

    Returns
    -------
    xarray.Dataset
        Along ``time``: ``rub_heat``, ``inner_race_heat``, ``outer_race_heat`` in W, ``load_torque``, ``speed_torque``,
        ``torque`` in N m, ``ball_growth``, ``inner_growth``, ``outer_growth`` in m; along (``node``, ``time``):
        ``temperature_rise`` in K over the ambient; along ``time`` ``heat_supplied``, ``heat_lost``, ``heat_stored`` in J.

    Raises
    ------
    InputError
        If the drop has no such end, or the step is not positive.
    """
    import xarray as xr

    ends = [str(name) for name in drop["end"].values]
    if end not in ends:
        raise InputError(f"'{end}' is no end of this drop{did_you_mean(end, ends)}")
    if not step > 0:
        raise InputError(f"step {step:g} s of the heat network is not positive")
    at = drop.sel(end=end)
    time, speed = at["time"].values, at["ring_speed"].values
    balls = at["ball_load"].values.T
    azimuth = at["cage_angle"].values[:, None] + 2 * np.pi * np.arange(balls.shape[1]) / balls.shape[1]
    load = np.hypot(np.sum(balls * np.cos(azimuth), axis=1), np.sum(balls * np.sin(azimuth), axis=1))
    made = race_heat(geometry, law, balls, load, speed, spin_friction)
    # the run has integrated the work of friction, which its samples would miss between them
    rubbed = drop["work"].sel(work_kind=f"friction_{ends.index(end)}").values
    work = np.stack([np.diff(rubbed), *(np.diff(time) * _between(heat) for heat in (made.inner, made.outer))])
    stride = max(1, int(step / (time[1] - time[0]) * (1 + 1e-9)))
    first = np.arange(0, len(time) - 1, stride)
    knots = np.append(first, len(time) - 1)
    power = np.add.reduceat(work, first, axis=1) / np.diff(time[knots])
    coarse = temperatures(body, time[knots], power, drop["rotor_speed"].values[knots], speed[knots])
    found = Temperatures(
        time,
        np.array([np.interp(time, coarse.time, row) for row in coarse.rise]),
        *(np.interp(time, coarse.time, heat) for heat in (coarse.supplied, coarse.lost, coarse.stored)),
    )
    grown = growth(body, found)
    along = {
        "rub_heat": (-at["friction_force"].values * at["slip_speed"].values, "W"),
        "inner_race_heat": (made.inner, "W"),
        "outer_race_heat": (made.outer, "W"),
        "load_torque": (law.of_load(load), "N m"),
        "speed_torque": (law.of_speed(speed), "N m"),
        "torque": (made.torque, "N m"),
        "ball_growth": (grown.ball, "m"),
        "inner_growth": (grown.inner, "m"),
        "outer_growth": (grown.outer, "m"),
        "heat_supplied": (found.supplied, "J"),
        "heat_lost": (found.lost, "J"),
        "heat_stored": (found.stored, "J"),
    }
    result = xr.Dataset({name: ("time", values, {"units": unit}) for name, (values, unit) in along.items()})
    result["temperature_rise"] = (("node", "time"), found.rise, {"units": "K"})
    return result.assign_coords(time=time, node=list(NODES))


def _between(values: np.ndarray) -> np.ndarray:
    return np.asarray((values[1:] + values[:-1]) / 2)
