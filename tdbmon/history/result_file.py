"""Result files, from which the catalogue is rebuilt: netCDF, one per drop, program version and machine file.

CF-1.11 attributes; features in long form along ``feature``, in units of output.  The whole analysis is in the attribute
``analysis`` as JSON, so that a result stays readable without the program.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
from tdbsim.errors import InputError, did_you_mean

from tdbmon.estimate import OUTSIDE, Estimate
from tdbmon.history.feature import Feature
from tdbmon.history.filing import Filing, StressBox

FORMAT = 1  # of the result file; raised when readers must distinguish it

_TEXTS = ("sha256", "raw_name", "machine", "machine_sha256", "dropped", "filed", "assembly", "version")
_BOX = ("greatest", "mean", "median", "q1", "q3")


def result_bytes(filing: Filing) -> bytes:
    """Return the netCDF file of a drop's results.

    It is made in memory, since on a full disk the library's own writing fails without a clear reason.
    """
    import netCDF4

    file = netCDF4.Dataset("result.nc", "w", memory=1 << 16)
    try:
        file.setncatts(
            {
                "Conventions": "CF-1.11",
                "title": f"Dropdown of {filing.machine}",
                "source": f"tdbmon {filing.version}",
                "history": f"{filing.filed} analysed by tdbmon {filing.version}",
                "comment": "Synthetic record: computed, not measured." if filing.synthetic else "",
                "result_format": np.int32(FORMAT),
                "forces": np.int32(filing.forces),
                "synthetic": np.int32(filing.synthetic),
                "failed_checks": json.dumps(filing.failed_checks),
                "analysis": json.dumps(filing.analysis, allow_nan=False),
                "first_filed": filing.first,
                **{name: getattr(filing, name) for name in _TEXTS},
            }
        )
        file.createDimension("feature", len(filing.features))
        for name in ("name", "end", "unit", "method", "why", "kind"):
            column = file.createVariable(f"feature_{name}" if name != "name" else "feature", str, ("feature",))
            column.long_name = f"{name} of the feature"
            column[:] = np.array([_text(f, name) for f in filing.features], dtype=object)
        outside = [f.estimate.outside for f in filing.features]
        for i, (name, words) in enumerate(
            (
                ("value", "value"),
                ("low", "lower limit of the 95 % interval"),
                ("high", "upper limit of the 95 % interval"),
            )
        ):
            column = file.createVariable(name, "f8", ("feature",), fill_value=np.nan)
            column.long_name = f"{words}, in the unit of feature_unit"
            column.coordinates = "feature feature_end"
            column[:] = np.array([np.nan if row[i] is None else row[i] for row in outside], float)
        _write_stress(file, filing.stress)
    finally:
        content = file.close()
    return bytes(content)


def read_result(path: Path) -> Filing:
    """Read the results of a drop.

    Raises
    ------
    InputError
        If the file is damaged, not a result of this program, or of a newer format.
    """
    import netCDF4

    try:
        with netCDF4.Dataset(path, "r") as file:
            file.set_auto_mask(False)
            form = int(getattr(file, "result_format", 0))
            if form > FORMAT:
                raise InputError(
                    f"{path}: result format {form} is of a newer tdbmon than this one ({FORMAT}): update tdbmon"
                )
            texts = {name: str(getattr(file, name)) for name in _TEXTS}
            return Filing(
                **texts,
                synthetic=bool(file.synthetic),
                forces=bool(file.forces),
                features=tuple(_features(file)),
                stress=tuple(_read_stress(file)),
                failed_checks=tuple(json.loads(file.failed_checks)),
                analysis=json.loads(file.analysis),
                first=str(getattr(file, "first_filed", "")),
            )
    except InputError:
        raise
    except (OSError, RuntimeError, AttributeError, KeyError, IndexError, ValueError) as error:
        raise InputError(
            f"{path}: cannot be read as a result ({error}); run 'tdbmon archive verify' and add the drop again"
        ) from None


def _text(feature: Feature, name: str) -> str:
    if name in ("name", "end"):
        return str(getattr(feature, name))
    return str(getattr(feature.estimate, name))


def _features(file: Any) -> list[Feature]:
    columns = [file.variables[n][:] for n in ("feature", "feature_end", "value", "low", "high")]
    words = [file.variables[f"feature_{n}"][:] for n in ("unit", "method", "why", "kind")]
    found = []
    for name, end, value, low, high, unit, method, why, kind in zip(*columns, *words, strict=True):
        factor = OUTSIDE.get(str(unit))
        if factor is None:
            raise InputError(f"feature {name}: unknown unit '{unit}'{did_you_mean(str(unit), OUTSIDE)}")
        numbers = [None if np.isnan(x) else float(x) / factor for x in (value, low, high)]
        estimate = Estimate(numbers[0], numbers[1], numbers[2], str(unit), str(method), str(why), str(kind))
        found.append(Feature(str(name), str(end), estimate))
    return found


def _write_stress(file: Any, boxes: tuple[StressBox, ...]) -> None:
    if not boxes:
        return
    file.createDimension("stress_end", len(boxes))
    file.createDimension("stress_outlier", max(1, *(len(b.outliers) for b in boxes)))
    ends = file.createVariable("stress_end", str, ("stress_end",))
    ends[:] = np.array([b.end for b in boxes], dtype=object)
    for name in _BOX:
        column = file.createVariable(f"stress_{name}", "f8", ("stress_end",))
        column.units, column.long_name = "MPa", f"{name} of the greatest Hertz stress among the balls while loaded"
        column[:] = [getattr(b, name) * OUTSIDE["MPa"] for b in boxes]
    beyond = file.createVariable("stress_outliers", "f8", ("stress_end", "stress_outlier"), fill_value=np.nan)
    beyond.units, beyond.long_name = "MPa", "peaks beyond three standard deviations from the mean"
    for i, box in enumerate(boxes):
        beyond[i, : len(box.outliers)] = np.array(box.outliers) * OUTSIDE["MPa"]


def _read_stress(file: Any) -> list[StressBox]:
    if "stress_end" not in file.variables:
        return []
    found = []
    for i, end in enumerate(file.variables["stress_end"][:]):
        numbers = {name: float(file.variables[f"stress_{name}"][i]) / OUTSIDE["MPa"] for name in _BOX}
        outliers = file.variables["stress_outliers"][i]
        kept = tuple(float(x) / OUTSIDE["MPa"] for x in outliers if not np.isnan(x))
        found.append(StressBox(str(end), outliers=kept, **numbers))
    return found
