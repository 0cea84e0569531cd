"""A trend over drops of several speeds: one slope for all, a level of its own for each speed.

Mixed model (N. M. Laird, J. H. Ware, Biometrics 38 (1982) 963) with the number of the drop as fixed effect and the class of
speed as random intercept, by restricted maximum likelihood.  It needs at least two classes of three drops each and eight in all.
"""

from __future__ import annotations

import warnings
from collections import Counter

import numpy as np

from tdbmon.estimate import Estimate

_LEAST, _IN_CLASS, _CLASSES = 8, 3, 2


def mixed_trend(series: list[Estimate], order: list[int], classes: list[int], unit: str) -> Estimate:
    """Return the slope a drop with its 95 % interval (Wald), SI.

    Parameters
    ----------
    series : list of Estimate
        The feature, drop by drop; the missing ones are left out.
    order : list of int
        Number of each drop in the machine's life.
    classes : list of int
        Class of speed of each drop.
    unit : str
        Of the feature.
    """
    rows = [(e.value, o, c) for e, o, c in zip(series, order, classes, strict=True) if e.value is not None]
    counts = Counter(c for _, _, c in rows)
    rows = [row for row in rows if counts[row[2]] >= _IN_CLASS]
    speeds = len({c for _, _, c in rows})
    if len(rows) < _LEAST or speeds < _CLASSES:
        return Estimate.missing(unit, f"needs {_CLASSES} speeds of {_IN_CLASS} drops each, {_LEAST} in all")
    values, at, groups = (np.array(column, float) for column in zip(*rows, strict=True))
    spread = float(np.std(values))
    if spread == 0:
        return Estimate(0.0, unit=unit, method="all drops alike", why="no scatter")
    from statsmodels.regression.linear_model import OLS
    from statsmodels.regression.mixed_linear_model import MixedLM

    design = np.column_stack([np.ones_like(at), at - at.mean()])
    with warnings.catch_warnings():
        # it warns where the speeds' levels do not differ, and may know no error of the slope then: nought is the edge of
        # what a variance can be.  There the model is a straight line through all drops
        warnings.simplefilter("ignore")
        found = MixedLM(values / spread, design, groups).fit(reml=True)
        slope, error = float(found.fe_params[1]), float(found.bse_fe[1])
        if not np.isfinite([slope, error]).all():
            line = OLS(values / spread, design).fit()
            slope, error = float(line.params[1]), float(line.bse[1])
    slope, error = slope * spread, error * spread
    rule = f"mixed model over {speeds} speeds (restricted maximum likelihood), a drop"
    return Estimate.from_sigma(slope, error, unit, rule)
