"""Variants of a drop side by side leave what each leaves alone."""

import numpy as np

HORIZON = 0.02


def test_points_side_by_side_leave_what_each_leaves_alone(problem):
    """More than a batch, probes that see otherwise, another release, and a point that cannot be among them."""
    names = [p.name for p in problem.parameters]
    points = [problem.start + 0.1 * k for k in range(-5, 6)]
    for name in ("zero_NDE_A", "NDE.runout_cosine_1", "release"):
        points.append(problem.start.copy())
        points[-1][names.index(name)] += 1.0
    impossible = problem.start.copy()
    impossible[names.index("set_point_y_0")] += 1e-3 / problem.parameters[names.index("set_point_y_0")].scale
    points.insert(3, impossible)
    found = problem.residuals_at(points, 0, HORIZON)
    assert found[3] is None
    alone = [problem.residual(point, 0, HORIZON) for k, point in enumerate(points) if k != 3]
    for seen, expected in zip(found[:3] + found[4:], alone, strict=True):
        np.testing.assert_allclose(seen, expected, atol=1e-6)
    # not all the same
    assert min(np.abs(each - alone[5]).max() for k, each in enumerate(alone) if k != 5) > 1e-3


def test_slopes_are_differences_of_residuals(problem):
    """Of every parameter: of rotor, bearings, release and probes."""
    base, slopes = problem.slopes(problem.start, 0, HORIZON)
    assert (np.abs(slopes).max(axis=0) > 0).all()
    for column, parameter in enumerate(problem.parameters):
        near = problem.start.copy()
        near[column] += parameter.nudge
        expected = (problem.residual(near, 0, HORIZON) - base) / parameter.nudge
        np.testing.assert_allclose(
            slopes[:, column], expected, atol=1e-5 * np.abs(expected).max(), err_msg=parameter.name
        )
