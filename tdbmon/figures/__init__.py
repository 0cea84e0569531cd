"""Figures of an analysed drop: one function a figure, one file a function; each takes an `Analysis`.

All of them return a `matplotlib.figure.Figure` that belongs to no window (no pyplot state), 170 mm wide.  Lengths are drawn
in micrometres, speeds in Hz.  What a record lacks is said in the figure, or the function raises `InputError`.
"""
