"""What several tests of the simulator start from."""

import pytest
from changed_machine import ADAPTIVE
from plain_drop import BENDING
from tdbsim.drop_model import build_model
from tdbsim.simulate import run


@pytest.fixture(scope="session")
def exact_drop(machine):
    """A drop with contacts, integrated far below what is asked of it, with the modes of `PlainDrop`."""
    return run(build_model(machine, bending=BENDING), ADAPTIVE)
