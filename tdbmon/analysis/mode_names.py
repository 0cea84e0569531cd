"""Names of the modes of a shaft on its touchdown bearings: bounce and conical, where it moves as a whole, and bending.

On soft supports the two lowest modes bend the shaft little: it bounces with both ends together, or tilts with one end
against the other.  What stiffer supports leave of that is a question of degree; here the share of the kinetic energy in
rigid motions decides.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from tdbsim.modes import SupportedModes

_RIGID = 2  # of the basis: translation and rotation
_WHOLE = 0.5  # of the kinetic energy in these: from there on the shaft moves as a whole


def mode_names(modes: SupportedModes, ends: Sequence[float]) -> tuple[str, ...]:
    """Return "bounce", "conical" or "bending 1" ... for each mode of a plane, by rising frequency.

    Parameters
    ----------
    modes : SupportedModes
        At standstill on round supports, where each stands for both planes.
    ends : sequence of float
        Axial positions of the two touchdown bearings, m.
    """
    both = np.stack([modes.amplitude_x, modes.amplitude_y])[:, :, ::2]
    rigid = np.sum(np.abs(both[:, :_RIGID]) ** 2, axis=(0, 1))
    at = modes.modes.at(ends) @ both
    together = np.real(np.sum(at[:, 0] * at[:, 1].conj(), axis=0)) > 0
    names: list[str] = []
    bending = 0
    for share, same in zip(rigid, together, strict=True):
        name = "bounce" if same else "conical"
        if share <= _WHOLE or name in names:
            bending += 1
            name = f"bending {bending}"
        names.append(name)
    return tuple(names)
