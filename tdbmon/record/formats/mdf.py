"""MDF, the ASAM measurement data format, versions 3 and 4."""

from __future__ import annotations

import gc
import io
import logging
import sys
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

import numpy as np

from tdbmon.record.channel import Channel, Content, named_apart
from tdbmon.record.format import library

_BEGAN = "start of measurement in the file's header, which some programs set when they write the file"


class MDF:
    """MDF files: numeric channels with the master time of their channel group; texts and structures are left out."""

    name = "MDF4"
    extra: str | None = "mdf"

    def recognises(self, head: bytes, path: Path) -> bool:
        return head.startswith((b"MDF     ", b"UnFinMF "))

    def read(self, path: Path) -> Content:
        asammdf = library("asammdf", self, path)
        logging.getLogger("asammdf").setLevel(logging.CRITICAL)
        hook = sys.unraisablehook
        sys.unraisablehook = lambda _: None  # the library's clean-up raises for files that it could not open
        try:
            return _content(asammdf, path)
        except Exception as error:
            wrong = str(error) or type(error).__name__
        finally:
            gc.collect()
            sys.unraisablehook = hook
        raise ValueError(wrong)


def _content(asammdf: Any, path: Path) -> Content:
    found: list[Channel] = []
    # read from memory so that a damaged file leaves no open handle; suppress what the library prints
    with redirect_stdout(io.StringIO()), asammdf.MDF(io.BytesIO(path.read_bytes())) as file:
        masters = file.masters_db
        for group, block in enumerate(file.groups):
            clock: np.ndarray | None = None
            for index in range(len(block.channels)):
                if masters.get(group) == index:
                    continue
                signal = file.get(group=group, index=index)
                values = np.asarray(signal.samples)
                if values.dtype.kind not in "iufb" or values.ndim != 1 or values.size == 0:
                    continue
                time = np.array(signal.timestamps, dtype=np.float64)
                if clock is None or clock.size != time.size or not np.array_equal(clock, time):
                    clock = time
                values = values.astype(np.int8) if values.dtype.kind == "b" else values.copy()
                unit, told = signal.unit or "", str(signal.comment or "")
                found.append(Channel(signal.name, values, unit, time=clock, long_name=told, group=f"group_{group + 1}"))
        began = file.header.start_time
        title = str(getattr(file.header, "subject", "") or "")
    return Content(named_apart(found), title, began.isoformat() if began else "", drop_time_from=_BEGAN)
