"""Names of the modes of a shaft on its touchdown bearings: bounce and conical (rigid-body modes), and bending.

On soft supports the shaft hardly bends in the two lowest modes: both ends move in phase (bounce) or in antiphase
(conical).  On stiffer supports the transition to bending modes is gradual; here a mode is a rigid-body mode if these
motions hold more than half of its kinetic energy.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from tdbsim.modes import SupportedModes

_RIGID = 2  # rigid-body modes at the start of the basis: translation and rotation
_WHOLE = 0.5  # share of kinetic energy in these, above which a mode is a rigid-body mode


def mode_names(modes: SupportedModes, ends: Sequence[float]) -> tuple[str, ...]:
    """Return the name of each mode of one plane, by rising frequency: "bounce", "conical" or "bending 1" ...

    Parameters
    ----------
    modes : SupportedModes
        At standstill on isotropic supports, where the modes of both planes coincide.
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
