"""Effects on the rotors of eight drops side by side: bow, cross-coupling, residual magnetic force, windage."""

from __future__ import annotations

from tdbsim import hooks
from tdbsim.cache import called, inlined
from tdbsim.columns import MAGNET_FX, MAGNET_FY, ROTOR_ROW
from tdbsim.lane_modes import MODE_STATE, MODE_STOP, MORE_X, MORE_Y, X, Y
from tdbsim.lane_rows import effect_of
from tdbsim.vectors import LANES, load, spread, store

# of a mode: modal forces of the bow and of the magnets, then its row of the cross-coupling
BOW_X, BOW_Y, PULL_X, PULL_Y, COUPLED = range(0, 5 * LANES, LANES)


@called
def fill_forces(m, forces):  # type: ignore[no-untyped-def]
    """Write the modal forces of bows, magnets and cross-coupling."""
    n = len(m.square)
    for k in range(n):
        for a in range(LANES):
            at = k * (COUPLED + n * LANES) + a
            forces[at + BOW_X], forces[at + BOW_Y] = m.square[k] * m.bow[a, 0, k], m.square[k] * m.bow[a, 1, k]
            for i in range(m.magnet.shape[1]):
                forces[at + PULL_X] += m.at_magnet[a, i, k] * m.magnet[a, i, MAGNET_FX]
                forces[at + PULL_Y] += m.at_magnet[a, i, k] * m.magnet[a, i, MAGNET_FY]
            for j in range(n):
                forces[at + COUPLED + j * LANES] = m.circulatory[a, k, j]


@inlined
def add_forces(state, modes, modal, forces, n, coupled, cosine, sine, share, tau):  # type: ignore[no-untyped-def]
    """Store the modal impulses of these effects in a kick.

    `coupled` : lanes with cross-coupling, as bits; (cosine, sine) : of the shafts' angles; `share` : of the magnetic forces.
    """
    for k in range(n):
        i, at = k * MODE_STOP, k * (COUPLED + n * LANES)
        bow_x, bow_y = load(forces, at + BOW_X), load(forces, at + BOW_Y)
        more_x = bow_x * cosine - bow_y * sine + share * load(forces, at + PULL_X)
        more_y = bow_x * sine + bow_y * cosine + share * load(forces, at + PULL_Y)
        if coupled != 0:
            for j in range(n):
                stiffness, place = load(forces, at + COUPLED + j * LANES), modes + j * MODE_STATE
                more_x -= stiffness * load(state, place + Y)
                more_y += stiffness * load(state, place + X)
        store(modal, i + MORE_X, tau * more_x)
        store(modal, i + MORE_Y, tau * more_y)


@inlined
def held(effects, since, holding, room):  # type: ignore[no-untyped-def]
    """Return the share of the magnetic forces left `since` s after the release; `holding` : lanes with any, as bits."""
    share = spread(0.0)
    if holding != 0:
        store(room, 0, since)
        store(room, LANES, share)
        _hold_each(effects, room, holding)
        share = load(room, LANES)
    return share


@called
def _hold_each(effects, room, rare):  # type: ignore[no-untyped-def]
    for a in range(LANES):
        if rare >> a & 1:
            room[LANES + a] = hooks.holding(room[a], effect_of(effects, a, ROTOR_ROW))


@inlined
def slowing(effects, omega, decay, blown, room):  # type: ignore[no-untyped-def]
    """Return the angular acceleration of the rotors by drag; `blown` : lanes with windage effects, as bits."""
    slower = -decay * omega
    if blown != 0:
        store(room, 0, omega)
        store(room, LANES, slower)
        _blow_each(effects, room, blown)
        slower = load(room, LANES)
    return slower


@called
def _blow_each(effects, room, rare):  # type: ignore[no-untyped-def]
    for a in range(LANES):
        if rare >> a & 1:
            room[LANES + a] += hooks.windage(room[a], effect_of(effects, a, ROTOR_ROW))
