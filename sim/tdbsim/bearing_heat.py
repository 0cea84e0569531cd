"""The heat table of a touchdown bearing in a machine file: bodies, materials, friction inside the bearing.

A bearing without this table stays cold.  With it the drop is integrated together with the temperatures
(`tdbsim.heat_coupling`).  Radii of journal and bore, balls and pitch circle are those of the bearing.  The thermal modules are
imported only for files with this table.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from tdbsim.quantity import Density, Length, Number, Part, Pressure, quantity

if TYPE_CHECKING:
    from tdbsim.bearing_torque import TorqueLaw
    from tdbsim.heat_network import BearingBody, ThermalMaterial
    from tdbsim.hertz import BearingGeometry, Material
    from tdbsim.machine import TouchdownBearing


class HeatMaterial(Part):
    """A material of rings or balls."""

    elastic_modulus: Pressure = Field(gt=0)
    poisson_ratio: Number = Field(gt=0, lt=0.5)
    density: Density = Field(gt=0)
    conductivity: Annotated[float, quantity("W/(m K)")] = Field(gt=0)
    specific_heat: Annotated[float, quantity("J/(kg K)")] = Field(gt=0)
    expansion: Annotated[float, quantity("1/K")] = Field(ge=0)

    @property
    def elastic(self) -> Material:
        """Its elastic constants."""
        from tdbsim.hertz import Material

        return Material(self.elastic_modulus, self.poisson_ratio)

    @property
    def thermal(self) -> ThermalMaterial:
        """Its thermal constants."""
        from tdbsim.heat_network import ThermalMaterial

        return ThermalMaterial(self.conductivity, self.density, self.specific_heat, self.expansion, self.poisson_ratio)


class BearingHeat(Part):
    """Thermal bodies of a bearing, and its internal friction.

    `inner_race_radius` and `outer_race_radius` are those of the ring walls at the balls (mean of shoulder and groove).  `width`
    is that of all rows together; `shaft_length` that of the heated piece of shaft.  Shaft and housing are of the rings' material,
    `race`.  The friction torque follows Palmgren (`tdbsim.bearing_torque`); the bearing's `inner_ring_drag` acts in addition.
    """

    inner_race_radius: Length
    outer_race_radius: Length
    outer_radius: Length
    housing_radius: Length
    width: Length = Field(gt=0)
    housing_width: Length = Field(gt=0)
    shaft_length: Length = Field(gt=0)
    race: HeatMaterial
    ball: HeatMaterial
    load_factor: Number = Field(ge=0)
    speed_factor: Number = Field(ge=0)
    viscosity: Annotated[float, quantity("m^2/s")] = Field(ge=0)
    spin_friction: Number = Field(0.0, ge=0)

    def body(self, bearing: TouchdownBearing) -> BearingBody:
        """Return the bodies of the bearing (raises InputError where their radii are not in order)."""
        from tdbsim.heat_network import BearingBody

        return BearingBody(
            shaft_radius=bearing.journal_radius,
            bore_radius=bearing.journal_radius + bearing.radial_gap.nominal,
            inner_race_radius=self.inner_race_radius,
            outer_race_radius=self.outer_race_radius,
            outer_radius=self.outer_radius,
            housing_radius=self.housing_radius,
            width=self.width,
            housing_width=self.housing_width,
            shaft_length=self.shaft_length,
            ball_diameter=bearing.balls.diameter,
            pitch_diameter=bearing.balls.pitch_diameter,
            ball_count=bearing.balls.rows * bearing.balls.count,
            race=self.race.thermal,
            ball=self.ball.thermal,
            contact_angle=bearing.balls.contact_angle,
        )

    def geometry(self, bearing: TouchdownBearing) -> BearingGeometry:
        """Return the contact geometry (raises InputError where the parts cannot make a bearing)."""
        return bearing.balls.geometry(self.ball.elastic, self.race.elastic)

    def torque(self, bearing: TouchdownBearing) -> TorqueLaw:
        """Return the law of the torque."""
        from tdbsim.bearing_torque import TorqueLaw

        return TorqueLaw(bearing.balls.pitch_diameter, self.load_factor, self.speed_factor, self.viscosity)
