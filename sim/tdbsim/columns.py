"""Columns of the arrays that the kernels read (`tdbsim.drop_model.Arrays`); all values SI."""

# columns of `Arrays.end`
(
    GAP, JOURNAL_RADIUS, CONTACT_STIFFNESS, CONTACT_POWER, CONTACT_DAMPING,
    FRICTION, FRICTION_POWER, FRICTION_LOAD,
    RING_MASS, RING_INERTIA, RING_DRAG,
    BALL_COUNT, BALL_STIFFNESS, HALF_CLEARANCE, BALL_DAMPING, CAGE_RATIO, CAGE_ANGLE, RING_ANGLE,
    SUPPORT_MASS, SUPPORT_XX, SUPPORT_XY, SUPPORT_YY, SUPPORT_DAMPING,
    FOUNDATION_MOBILITY, FOUNDATION_STIFFNESS, FOUNDATION_DAMPING,
    COOLING_RATE,
    SHAPE_REACH, WAVES_REACH, HAS_SPRING, HAS_SLIP_LAW,
) = range(31)  # fmt: skip
END_COLUMNS = 31
# SHAPE_REACH, WAVES_REACH: greatest change of gap and of ball interference by effects, m; 0 without such effects
# columns of `Arrays.spin`
INERTIA, DECAY_RATE, GRAVITY, HAS_WINDAGE, HAS_HOLDING, HAS_CIRCULATORY, HAS_BOW = range(7)
SPIN_COLUMNS = 7
# columns of `Arrays.magnet`
MAGNET_STIFFNESS, MAGNET_DAMPING, MAGNET_FX, MAGNET_FY = range(4)
MAGNET_COLUMNS = 4
ROTOR_ROW = 2  # row of `Arrays.effect` that belongs to the rotor
