"""WAV files: samples from -1 to 1 of full scale, without names or units."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from tdbmon.record.channel import Channel, Content


class WAV:
    """WAV files: channels ch1, ch2 ... in the unit "1" (of full scale), which need a sensitivity for conversion to metres."""

    name = "WAV"
    extra: str | None = None

    def recognises(self, head: bytes, path: Path) -> bool:
        return head[:4] in (b"RIFF", b"RIFX", b"RF64") and head[8:12] == b"WAVE"

    def read(self, path: Path) -> Content:
        from scipy.io import wavfile

        with warnings.catch_warnings():
            # for a truncated file scipy returns the available samples with only a warning
            warnings.filterwarnings("error", message=".*EOF.*|.*[Ii]ncomplete.*", category=wavfile.WavFileWarning)
            rate, data = wavfile.read(path)
        columns = data.reshape(len(data), -1)
        scale, offset = _packing(data.dtype)
        channels = tuple(
            Channel(f"ch{k + 1}", column.copy(), "1", interval=1.0 / rate, scale=scale, offset=offset)
            for k, column in enumerate(columns.T)
        )
        return Content(channels)


def _packing(dtype: np.dtype[np.generic]) -> tuple[float, float]:
    if dtype.kind == "f":
        return 1.0, 0.0
    half = 2.0 ** (8 * dtype.itemsize - 1)
    return 1.0 / half, (-1.0 if dtype.kind == "u" else 0.0)
