"""What several tests of the simulator start from."""

import pytest
from changed_machine import ADAPTIVE
from tdbsim.drop_model import build_model
from tdbsim.simulate import run


@pytest.fixture(scope="session")
def exact_drop(machine):
    """A drop with contacts, integrated far below what is asked of it."""
    return run(build_model(machine), ADAPTIVE)
