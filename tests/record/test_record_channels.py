"""Channels as readers give them become a record, or an error that names what is wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tdbsim.errors import InputError

from tdbmon.record.channel import Channel, Content, to_dataset

TIME = np.arange(5) * 1e-3


def made(tmp_path: Path, *channels: Channel):
    file = tmp_path / "record.bin"
    file.write_bytes(b"a file")
    return to_dataset(Content(channels), file, "test")


def channel(name: str, values=(1.0, 2.0, 3.0, 4.0, 5.0), time: np.ndarray = TIME) -> Channel:
    return Channel(name=name, values=np.array(values), unit="um", time=time)


def test_a_channel_named_as_a_time_axis_stays_beside_it(tmp_path):
    record = made(tmp_path, channel("time_2"), channel("A"))
    assert set(record.data_vars) == {"time_2_channel", "A"}
    np.testing.assert_allclose(record.time_2_channel, np.arange(1, 6) * 1e-6)


def test_no_channel_takes_the_place_of_another(tmp_path):
    with pytest.raises(InputError, match="'time_2' and 'time_2_channel' would both be called 'time_2_channel'"):
        made(tmp_path, channel("time_2"), channel("time_2_channel"))
    with pytest.raises(InputError, match="'A' occurs twice"):
        made(tmp_path, channel("A"), channel("A"))


def test_every_channel_has_as_many_samples_as_its_time(tmp_path):
    with pytest.raises(InputError, match="channel 'B' has 3 samples but 5 times"):
        made(tmp_path, channel("A"), channel("B", (1.0, 2.0, 3.0)))


def test_an_overload_of_an_instrument_is_infinite(tmp_path: Path) -> None:
    """SCPI has 9.9e37 for it; a probe was said to be written in another unit, as it moved by 1e35 mm."""
    record = made(tmp_path, channel("NDE_A", (1.0, 9.9e37, -9.9e37, 1e30, 5.0)))
    np.testing.assert_array_equal(record["NDE_A"].values, np.array([1.0, np.inf, -np.inf, 1e30, 5.0]) * 1e-6)


@pytest.mark.parametrize(
    ("order", "words"),
    [
        (np.r_[0:500, 499:1000], "1 sample of 1001 may be duplicated"),
        (np.r_[0:1000, 0:1000], "restarts: the file may contain several records"),
        (np.r_[0:500, 490:1000], "goes back: samples may be duplicated"),
    ],
)
def test_times_that_do_not_go_on_are_told_by_what_they_do(order: np.ndarray, words: str, tmp_path: Path) -> None:
    """A row that stands twice was said to be of a time with too few digits, a second record of pieces in the wrong order."""
    with pytest.raises(InputError, match=words):
        made(tmp_path, channel("A", order.astype(float), 1e-3 * order))
