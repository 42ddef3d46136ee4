"""``[calibration]``: what is fitted, to what, and how."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import AfterValidator, Field, model_validator

from tdacoustic.campaign.values import StatedPath
from tdacoustic.toml_models import NonNegative, Positive, Table, Text, each_once

__all__ = ["CalibrationParameter", "CalibrationSettings", "LevelKind"]

LevelKind = Literal["surface", "receivers", "bands", "orders"]
"""Measured levels that a calibration can use: of the 4 m surface, at each receiver, of third octaves, of the mesh order
over a run-up."""

DEFAULT_FREE = ("masuda.constant_db", "gear_dynamics.mesh_damping_ratio")


class CalibrationParameter(Table):
    """One ``[[calibration.parameter]]``: how far a parameter may go, and what is known of it before.

    Parameters
    ----------
    name : str
        Key of the fleet, with the number of an entry where it is a list (``"gear_dynamics.mass_kg.2"``); or any name
        without a dot, which is a parameter for expressions alone.
    value : float or None
        Where the search starts. Default: the fleet's value.
    min, max : float or None
        Bounds. Default: those that such a parameter usually has.
    prior_mean, prior_sigma : float or None
        Both or neither, in the unit of the name.
    scale : {"linear", "log"} or None
        On which it is moved. Default: ``"log"`` for what cannot be zero, ``"linear"`` for levels.
    expression : str or None
        Instead of fitting it: an expression of other names, as lmfit has them.
    """

    name: Text
    value: float | None = None
    min: float | None = None
    max: float | None = None
    prior_mean: float | None = None
    prior_sigma: Positive | None = None
    scale: Literal["linear", "log"] | None = None
    expression: Text | None = None

    @model_validator(mode="after")
    def _whole(self) -> CalibrationParameter:
        if (self.prior_mean is None) != (self.prior_sigma is None):
            raise ValueError("prior_mean and prior_sigma belong together: one of them is missing")
        if self.min is not None and self.max is not None and not self.min < self.max:
            raise ValueError(f"min must be below max, got {self.min:g} and {self.max:g}")
        if self.expression is not None and self.prior_mean is not None:
            raise ValueError("a parameter with an expression is not fitted and takes no prior")
        return self


class CalibrationSettings(Table):
    """``[calibration]``.

    Parameters
    ----------
    free : tuple of str
        Parameters of the fleet to fit, with their usual bounds. Default: Masuda's constant, or the structure's gain
        where the fleet's total adds the structure in its place, and the mesh damping ratio.
    parameter : tuple of CalibrationParameter
        More of them, or bounds, priors and expressions for those of `free`.
    data : tuple of str
        Which measured levels are used: any of `LevelKind`. Levels of ``[[level]]`` always are.
    model_sigma_db : float
        Scatter of the model itself, one standard deviation.
    fit_model_sigma : bool
        Whether the model's scatter is taken from the misfit instead.
    level_sigma_db : float
        What a recorded level is uncertain by at least [assumed], one standard deviation.
    loss : str
        ``"linear"``, or a robust loss of scipy's.
    starts : int
        Of the search, spread over the bounds.
    posterior : bool
        Whether the posterior is sampled (needs the extra ``posterior``).
    posterior_walkers, posterior_steps : int
    prior_fleet : path or None
        A calibrated fleet: what was found there is the prior of what is fitted here.
    prior_discount : float
        Factor on the standard deviations found there.
    with_campaigns : tuple of path
        Further campaigns of the same fleet, fitted together with this one.
    offset_sigma_db : float
        What the levels of a campaign are off by as a whole, one standard deviation; where several are fitted together.
    """

    free: Annotated[tuple[Text, ...], AfterValidator(each_once)] = DEFAULT_FREE
    parameter: tuple[CalibrationParameter, ...] = ()
    data: Annotated[tuple[LevelKind, ...], AfterValidator(each_once), Field(min_length=1)] = ("surface",)
    model_sigma_db: NonNegative = 4.0
    fit_model_sigma: bool = False
    level_sigma_db: Positive = 0.3
    loss: Literal["linear", "soft_l1", "huber", "cauchy", "arctan"] = "linear"
    starts: Annotated[int, Field(ge=1, le=1000)] = 16
    posterior: bool = False
    posterior_walkers: Annotated[int, Field(ge=4, le=1000)] = 32
    posterior_steps: Annotated[int, Field(ge=50, le=1_000_000)] = 4000
    prior_fleet: StatedPath | None = None
    prior_discount: Annotated[float, Field(ge=1.0)] = 2.0
    with_campaigns: tuple[StatedPath, ...] = ()
    offset_sigma_db: Positive = 1.0

    @model_validator(mode="after")
    def _each_once(self) -> CalibrationSettings:
        names = [parameter.name for parameter in self.parameter]
        twice = next((name for i, name in enumerate(names) if name in names[:i]), None)
        if twice is not None:
            raise ValueError(f"[[calibration.parameter]] names {twice!r} twice")
        return self

    @property
    def names(self) -> tuple[str, ...]:
        """Every parameter that takes part, each once."""
        return tuple(dict.fromkeys([*self.free, *(parameter.name for parameter in self.parameter)]))

    def stated(self, name: str) -> CalibrationParameter:
        """Return what is stated of a parameter; nothing but its name where nothing is."""
        held = (parameter for parameter in self.parameter if parameter.name == name)
        return next(held, CalibrationParameter(name=name))
