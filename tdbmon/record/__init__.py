"""Measurement records: the channels of a file as an `xarray.Dataset` at their native sampling.

A record as read from a file (`read`)
    One data variable per channel, named as in the file, float64, in SI where the file's unit is known.  A channel's
    dimension is ``time``, or ``time_2``, ``time_3`` ... for channels on other time bases; every such dimension has a
    coordinate of the same name in s, counted from the record's first sample (of any channel).
    Channel attributes: ``units`` (SI: "m", "Hz", "V", "1", ... or the file's own text if the unit is unknown),
    ``source_units`` (as in the file), ``long_name``; if the file states them, ``full_scale`` ([low, high] in ``units``)
    and ``group``.
    A time coordinate carries ``jitter`` (standard deviation of its intervals, s) if the sampling is uneven, and ``counted``
    (the reason, in words) if the times were computed from a stated sampling rate.
    Record attributes: ``source_file``, ``sha256``, ``reader``, ``title``, ``drop_time`` (ISO 8601, where known),
    ``drop_time_from`` (what this time means in the file, where it may differ from the drop's), ``drop_time_unread`` (the
    date as stated in the file, if it could not be interpreted), ``incomplete`` (what is missing, if the file is truncated),
    ``left_out`` (channels that cannot be used, e.g. without a time base, with the reason; present only if there are any).

A record whose channels have been assigned to a machine (`assign`)
    Probes under their machine name, in m, positive along the probe's axis; ``speed`` in Hz; ``keyphasor`` as recorded;
    other channels are dropped and listed in the attribute ``unused``.  Channels that the machine expects but the file lacks
    are listed in the attribute ``missing``.
    Probes of equal sampling rate share one time base (`one_time`); how this was achieved is in ``time_remarks``.
"""
