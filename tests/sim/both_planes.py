"""The rotor in both planes at once, against which what is computed of one plane is held."""

from __future__ import annotations

import numpy as np


class BothPlanes:
    """Mass, stiffness and gyroscopic matrix (4m, 4m) of a `RotorModel`, in (x, y, theta_x, theta_y) per node."""

    def __init__(self, model):
        self.size = 4 * len(model.nodes)
        corner = 4 * np.arange(len(model.nodes))
        self.x, self.y = (np.add.outer(corner, places).ravel() for places in ((0, 3), (1, 2)))
        self.sign = np.tile([1.0, -1.0], len(model.nodes))  # psi = -theta_x
        self.mass, self.stiffness = (self._twice(each) for each in (model.plane_mass, model.plane_stiffness))
        self.gyroscopic = np.zeros((self.size, self.size))
        self.gyroscopic[np.ix_(self.x, self.y)] = model.plane_polar * self.sign
        self.gyroscopic[np.ix_(self.y, self.x)] = -(model.plane_polar * self.sign).T

    def _twice(self, plane):
        full = np.zeros((self.size, self.size))
        full[np.ix_(self.x, self.x)] = plane
        full[np.ix_(self.y, self.y)] = plane * np.outer(self.sign, self.sign)
        return full

    def in_plane_x(self, plane):
        """Lay vectors or rows (..., 2m) of one plane into the x-z plane: (..., 4m)."""
        full = np.zeros((*plane.shape[:-1], self.size))
        full[..., self.x] = plane
        return full

    def in_plane_y(self, plane):
        """Lay vectors or rows (..., 2m) of one plane into the y-z plane: (..., 4m)."""
        full = np.zeros((*plane.shape[:-1], self.size))
        full[..., self.y] = plane * self.sign
        return full
