"""Each channel of a simulated record has a name of its own."""

from __future__ import annotations

import pytest
from changed_machine import changed
from tdbsim.errors import InputError
from tdbsim.simulate import DropPlan, simulate
from warm_machine import with_heat


def _mapped(machine, **channels):
    return changed(machine, channels=channels)


@pytest.mark.parametrize(
    ("channels", "says"),
    [
        ({"NDE_A": "ring_x"}, "channel 'ring_x' of 'NDE_A' is a name .* 'NDE_A' .*another name"),
        ({"speed": "rotor_speed"}, "channel 'rotor_speed' of 'speed'"),
        ({"NDE_A": "time"}, "channel 'time' of 'NDE_A'"),
        ({"NDE_A": "end"}, "channel 'end' of 'NDE_A'"),
        ({"NDE_A": "X", "DE_A": "X"}, "'NDE_A' and 'DE_A' are both channel 'X'"),
    ],
)
def test_a_channel_that_would_be_lost_is_refused(machine, channels, says):
    with pytest.raises(InputError, match=says):
        simulate(_mapped(machine, **channels), DropPlan(100.0, 0.01))


def test_every_variable_of_a_drop_is_a_channel_or_a_reserved_name(machine):
    """A variable that is not reserved could take the place of a probe's channel."""
    from tdbsim.channel_names import RESERVED

    drop = simulate(with_heat(machine), DropPlan(100.0, 0.01))
    own = {machine.channel_in_file(name) for name in machine.channel_names()}
    assert set(map(str, drop.variables)) - own == RESERVED
