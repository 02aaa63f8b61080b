"""What an experiment says of its drives: sums of signals, laws, what of them is free."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Field, ValidationError

from .spec_values import NonZero, Spec, checked_column, is_number


class FreeFactor(Spec):
    """A factor to be found: from `start`, within two bounds; both chosen from the logs where they are left out."""

    start: NonZero | None = None
    within: Annotated[list[NonZero], Field(min_length=2, max_length=2)] | None = None

    def model_post_init(self, _context: Any) -> None:
        if self.within is not None and not (self.within[0] < self.within[1] and self.within[0] * self.within[1] > 0.0):
            raise ValueError(f"within must be two numbers of one sign that rise, not {self.within}")
        if self.within is not None and self.start is not None and not self.within[0] <= self.start <= self.within[1]:
            raise ValueError(f"start {self.start:g} must be within {self.within}")


def _free(value: Any) -> Any:
    if value == "free":
        return FreeFactor()
    if isinstance(value, dict) and set(value) <= set(FreeFactor.model_fields):
        try:
            return FreeFactor.model_validate(value)
        except ValidationError as error:
            raise ValueError(error.errors()[0]["msg"].removeprefix("Value error, ")) from None
    if isinstance(value, FreeFactor):
        return value
    if is_number(value):
        return float(value)
    raise ValueError("must be a number, free, or {start: number, within: [low, high]}")


def _factor(value: Any) -> Any:
    value = _free(value)
    if value == 0.0:
        raise ValueError("must not be 0")
    return value


Factor = Annotated[Any, BeforeValidator(_factor)]


Sum = Annotated[dict[str, Factor], Field(min_length=1)]


class ActuatorSpec(Spec):
    """What drives a joint whose torque was not logged: a position servo, tau = kp (command - q) - kd qd, or a DC motor,
    tau = k / R (voltage - k qd). `command` and `voltage` name logged columns; `delay` [s] is how late they act."""

    command: Annotated[Any, BeforeValidator(checked_column)] | None = None
    kp: Factor = FreeFactor()
    kd: Annotated[Any, BeforeValidator(_free)] = 0.0
    voltage: Annotated[Any, BeforeValidator(checked_column)] | None = None
    k: Factor = FreeFactor()
    R: Factor = FreeFactor()
    delay: Annotated[Any, BeforeValidator(_free)] = 0.0

    def model_post_init(self, _context: Any) -> None:
        if (self.command is None) == (self.voltage is None):
            raise ValueError("give command, of a position servo, or voltage, of a DC motor")
        alien = {"k", "R"} if self.command is not None else {"kp", "kd"}
        if wrong := sorted(alien & self.model_fields_set):
            raise ValueError(f"{wrong[0]} goes with {'voltage' if self.command is not None else 'command'}")
        if isinstance(self.k, FreeFactor) != isinstance(self.R, FreeFactor):
            raise ValueError("give both k and R, or leave both free")
        for name, value in (("kd", self.kd), ("delay", self.delay)):
            if isinstance(value, float) and value < 0.0:
                raise ValueError(f"{name} must be a number, at least 0, or free")
