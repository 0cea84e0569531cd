"""Figures of an analysed drop: one function per figure, one file per function; most take an `Analysis`.

All of them return a `matplotlib.figure.Figure` without pyplot state, 170 mm wide.  Lengths are drawn in micrometres, speeds
in Hz.  If a record lacks data, the figure says so or the function raises `InputError`.
"""
