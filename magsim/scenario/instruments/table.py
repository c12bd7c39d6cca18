"""All instruments of a scenario."""

from pydantic import Field, ValidationInfo, field_validator

from magsim.config import Strict
from magsim.scenario.instruments.channels import Electrical, Surfaces
from magsim.scenario.instruments.common import Sensor
from magsim.scenario.instruments.fluxgate import Cabin, FluxgateSensor
from magsim.scenario.instruments.ground import BaseStation
from magsim.scenario.instruments.height import Barometer, Radar
from magsim.scenario.instruments.inertial import Ins
from magsim.scenario.instruments.scalar import ScalarSensor


class Sensors(Strict):
    """All instruments."""

    seed: int | None = Field(
        default=None, ge=0, lt=2**63, description="of the errors of all instruments; left out: the scenario's seed"
    )
    scalar: tuple[ScalarSensor, ...] = Field(min_length=1, strict=False)
    fluxgate: tuple[FluxgateSensor, ...] = Field(default=(), strict=False)
    ins: Ins = Field(default=Ins(), description="in the bird where one is towed, else in the carrier")
    carrier_ins: Ins | None = Field(default=None, description="a second one, in the carrier of a bird")
    cabin: Cabin | None = Field(default=None, description="without it, every instrument has its reference_c")
    electrical: Electrical = Electrical()
    surfaces: Surfaces = Field(default=Surfaces(), description="positions of the control surfaces")
    barometer: Barometer | None = None
    radar: Radar | None = Field(default=None, description="needs [terrain]")
    base: BaseStation | None = Field(default=None, description="on the ground, for the diurnal correction")

    @field_validator("scalar", "fluxgate")
    @classmethod
    def _unique(cls, value: tuple[Sensor, ...], info: ValidationInfo) -> tuple[Sensor, ...]:
        names = [sensor.name for sensor in (*(info.data.get("scalar") or ()), *value)]
        double = sorted({name for name in names if names.count(name) > 1})
        if double:
            msg = f"sensor names must differ, used twice: {', '.join(double)}"
            raise ValueError(msg)
        return value

    @property
    def of_bird(self) -> tuple[str, ...]:
        """Keys of the instruments in the bird."""
        tables = (("scalar", self.scalar), ("fluxgate", self.fluxgate))
        return tuple(f"{key}[{i}].body" for key, table in tables for i, s in enumerate(table) if s.body == "bird")
