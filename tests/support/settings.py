"""Small settings models of every kind of key, and the problems of a wrong text."""

from datetime import datetime
from typing import Annotated, Literal

import pytest
from pydantic import Discriminator, Field, model_validator

from magsim import config
from magsim.config import Name, Numbers, Problems, Strict, Vector
from magsim.errors import RequestError


class Round(Strict):
    kind: Literal["round"] = "round"
    radius_m: float = Field(default=1.0, gt=0.0)
    weights: Numbers = (1.0,)
    place_m: Vector = (0.0, 0.0, 0.0)
    steps: Annotated[tuple[int, ...], Field(strict=False)] = (1,)


class Square(Strict):
    kind: Literal["square"] = "square"
    side_m: float | None = None
    either: float | Annotated[tuple[float, ...], Field(strict=False)] = 1.0
    rate_hz: int = Field(default=120, ge=60, le=480, multiple_of=60, description="step rate")
    when: datetime | None = None


Shape = Annotated[Round | Square, Discriminator("kind")]


class Settings(Strict):
    seed: int
    axis: Literal["pitch", "roll", "yaw"] = "roll"
    lat_deg: float = Field(default=0.0, ge=-89.0, le=89.0)
    on: bool = True
    shape: Shape = Round()
    shapes: tuple[Shape, ...] = Field(default=(), strict=False)
    named: dict[Name, Round] = Field(default_factory=dict)
    share: dict[Literal["first", "second"], float] = Field(default_factory=dict)


class Pair(Strict):
    low: float
    high: float
    parts: tuple[Round, ...] = Field(default=(), strict=False)

    @model_validator(mode="after")
    def _ordered(self) -> "Pair":
        if self.low > self.high:
            raise Problems(("high", "is below low"), ("parts[0].radius_m", "is odd"), ("", "is upside down"))
        return self


def problems(text: str, model: type = Settings, **options: object) -> list[str]:
    """Lines of the error that a text makes."""
    with pytest.raises(RequestError) as caught:
        config.load(text, model, source="p.toml", **options)
    return str(caught.value).split("\n")
