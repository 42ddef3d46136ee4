"""What is known of a run's microphone, speed and background, held against a standard's rules."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from tdacoustic.railway.rules import Standard

__all__ = ["Conditions", "Finding", "Place", "State"]

State = Literal["met", "broken", "unknown"]
Place = Literal["wayside", "vehicle", "interior"]


@dataclass(frozen=True)
class Finding:
    """One requirement held against what is known.

    Parameters
    ----------
    requirement : str
    state : "met", "broken" or "unknown"
    detail : str
        What was found, or what is missing.
    origin : str
        Clause and how the rule is known.
    """

    requirement: str
    state: State
    detail: str
    origin: str


@dataclass(frozen=True)
class Conditions:
    """What a campaign and its logs say of one microphone in one run; None where nothing says it.

    Parameters
    ----------
    place : "wayside", "vehicle" or "interior", or None
        Beside the track, outside on the vehicle, or inside.
    distance_m : float or None
        Of a wayside microphone from the track's centreline.
    height_m : float or None
        Above the rail's head; inside, above the floor.
    nominal_km_h : float or None
        Speed that was to be driven.
    lowest_km_h, highest_km_h : float or None
        Of the speed within the interval that counts.
    background_db : float or None
        A-weighted level of the background at the microphone.
    reference_track : bool or None
        Whether roughness and decay rates are shown to meet the reference track's (6.2 of ISO 3095).
    """

    place: Place | None = None
    distance_m: float | None = None
    height_m: float | None = None
    nominal_km_h: float | None = None
    lowest_km_h: float | None = None
    highest_km_h: float | None = None
    background_db: float | None = None
    reference_track: bool | None = None

    def position(self, standard: Standard, far: bool = False) -> tuple[Finding, ...]:
        """Judge where the microphone is."""
        if standard.inside:
            return (self._place("interior", standard, "position_tolerance_m"), self._height_inside(standard))
        distance, height = ("far_distance_m", "far_height_m") if far else ("distance_m", "height_m")
        return (
            self._place("wayside", standard, distance),
            self._near(self.distance_m, standard, distance, "from the track's centreline"),
            self._near(self.height_m, standard, height, "above the rail"),
        )

    def _place(self, wanted: Place, standard: Standard, key: str) -> Finding:
        origin = standard.rule(key).origin
        where = "beside the track" if wanted == "wayside" else "inside the vehicle"
        if self.place is None:
            return Finding(f"microphone {where}", "unknown", "nothing says where the microphone is", origin)
        state: State = "met" if self.place == wanted else "broken"
        return Finding(f"microphone {where}", state, f"place: {self.place}", origin)

    def _near(self, value: float | None, standard: Standard, key: str, what: str) -> Finding:
        rule, tolerance = standard.rule(key), standard.value("position_tolerance_m")
        requirement = f"microphone {rule.value:g} m {what}"
        if value is None:
            return Finding(requirement, "unknown", "not stated", rule.origin)
        state: State = "met" if abs(value - rule.value) <= tolerance + 1e-9 else "broken"
        return Finding(requirement, state, f"{value:g} m; {tolerance:g} m allowed", rule.origin)

    def _height_inside(self, standard: Standard) -> Finding:
        seated, standing = standard.rule("seated_height_m"), standard.rule("standing_height_m")
        requirement = f"microphone {seated.value:g} m (seated) or {standing.value:g} m (standing) above the floor"
        if self.height_m is None:
            return Finding(requirement, "unknown", "not stated", seated.origin)
        tolerance = standard.value("position_tolerance_m")
        near = min(abs(self.height_m - rule.value) for rule in (seated, standing)) <= tolerance + 1e-9
        return Finding(requirement, "met" if near else "broken", f"{self.height_m:g} m", seated.origin)

    def speed(self, standard: Standard) -> Finding:
        """Judge how far the speed strayed from the nominal one."""
        rule = standard.rule("speed_tolerance")
        requirement = f"speed within {100 * rule.value:g} % of the nominal"
        if self.nominal_km_h is None:
            return Finding(requirement, "unknown", "no nominal speed is stated", rule.origin)
        if self.lowest_km_h is None or self.highest_km_h is None:
            return Finding(requirement, "unknown", "the speed within the interval is not known", rule.origin)
        farthest = max(abs(self.lowest_km_h - self.nominal_km_h), abs(self.highest_km_h - self.nominal_km_h))
        state: State = "met" if farthest <= rule.value * self.nominal_km_h * (1.0 + 1e-9) else "broken"
        detail = f"{self.lowest_km_h:.1f} to {self.highest_km_h:.1f} km/h for {self.nominal_km_h:g} km/h"
        return Finding(requirement, state, detail, rule.origin)

    def standstill(self, standard: Standard) -> Finding:
        """Judge whether the vehicle stands."""
        origin = standard.rule("stationary_s").origin
        if self.highest_km_h is None:
            return Finding("vehicle at standstill", "unknown", "the speed is not known", origin)
        state: State = "met" if self.highest_km_h <= STANDING_KM_H else "broken"
        return Finding("vehicle at standstill", state, f"up to {self.highest_km_h:.1f} km/h", origin)

    def background(self, standard: Standard, level_db: float) -> Finding:
        """Judge how far the background lies below a level."""
        rule = standard.rule("background_distance_db")
        requirement = f"background at least {rule.value:g} dB below"
        if self.background_db is None:
            return Finding(requirement, "unknown", "no background run", rule.origin)
        below = level_db - self.background_db
        state: State = "met" if below >= rule.value else "broken"
        return Finding(requirement, state, f"{below:.1f} dB below", rule.origin)

    def corrected_db(self, standard: Standard, level_db: float) -> float | None:
        """Return a level less its background, where that is nearer than the standard wants and yet correctable.

        ISO 3095:2013, D.4.2, formula (D.1), an informative procedure; from more than 3 dB on.
        """
        if self.background_db is None:
            return None
        below = level_db - self.background_db
        if not standard.value("background_correctable_db") < below < standard.value("background_distance_db"):
            return None
        return level_db + 10.0 * math.log10(1.0 - 10.0 ** (-0.1 * below))

    def track(self, standard: Standard) -> Finding:
        """Judge whether the track is a reference track."""
        origin = f"6.2 of {standard.name.replace('2025', '2013')}"
        requirement = "reference track: rail roughness and decay rates within their limits"
        if self.reference_track is None:
            return Finding(
                requirement, "unknown", "logs do not tell the rail's roughness nor the track's decay", origin
            )
        return Finding(requirement, "met" if self.reference_track else "broken", "as stated", origin)


STANDING_KM_H = 1.0
"""A speed up to this is a standstill [assumed; as `speed.profile`]."""
