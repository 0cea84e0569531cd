"""Records: a file of channels becomes an `xarray.Dataset` at its native sampling.

The form of a record as read (`read`)
    One data variable a channel, named as in the file, float64, in SI where the file's unit is known.  A channel's
    dimension is ``time``, or ``time_2``, ``time_3`` ... for channels on other time bases; every such dimension has a
    coordinate of the same name in s, counted from the record's first sample (of any channel).
    Channel attributes: ``units`` (SI: "m", "Hz", "V", "1", ... or the file's own text where it is not known),
    ``source_units`` (as in the file), ``long_name``; where the file tells them, ``full_scale`` ([low, high] in ``units``)
    and ``group``.
    A time coordinate carries ``jitter`` (standard deviation of its intervals, s) where the clock was uneven, and ``counted``
    (why, in words) where it was counted by a stated rate.
    Record attributes: ``source_file``, ``sha256``, ``reader``, ``title``, ``drop_time`` (ISO 8601, where known),
    ``drop_time_from`` (what that time is in the file, where it need not be the drop's), ``drop_time_unread`` (what the file
    states as its date, where that is not understood), ``incomplete`` (what is missing, where a file was cut off),
    ``left_out`` (names of channels whose samples have no time, with the reason; only where there are any).

The form of a record that a machine has been laid over (`assign`)
    Probes by their machine name, in m, positive along the probe's axis; ``speed`` in Hz; ``keyphasor`` as recorded;
    other channels are left out and listed in the attribute ``unused``.  What the machine expects and the file lacks is
    listed in the attribute ``missing``.
    Probes of one rate are on one time base (`one_time`); what that took is in the attribute ``time_remarks``.
"""
