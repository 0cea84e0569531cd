"""The blind generator: synthetic drops that share no code with `tdbsim`, and how `tdbmon diagnose` does on them.

    machine ── rotor ── truth (a machine as it is, one drop of it) ── drop (the compiled kernel) ── sensors
    hidden ── rotor_effects, bearing_effects, sensor_effects, outside_effects ── effects (all of them)
    case (drawn from a seed, written as files) ── outcome (through the command line) ── judge ── table (the page)

`python -m tests.blind --help` says how to make cases and to run them.
"""
