"""Records of the simulated drive as operating states of the package."""

from simulated_drive import RATE, record

from tdacoustic.contributions import CrossSpectrumMeter, OperatingState, Span, plan_cross_spectra

BANDS = tuple(
    Span(f"{c:g} Hz", c * 10**-0.05, c * 10**0.05) for c in (125.0, 160.0, 200.0, 250.0, 315.0, 400.0, 500.0, 630.0)
)


def state_of(name, made, references=("motor_z", "gearbox_z"), resolution_hz=4.0):
    plan = plan_cross_spectra(
        RATE,
        made.samples.shape[1],
        len(references),
        len(made.samples) - len(references),
        resolution_hz,
        max_frequency_hz=900.0,
        max_segments=16,
    )
    meter = CrossSpectrumMeter(plan, references, ("mic",))
    for start in range(0, made.samples.shape[1], 8192):
        meter.take(made.samples[:, start : start + 8192])
    return OperatingState(name, meter.result())


def states_of(drive, powers, rng, seconds=24.0, references=("motor_z", "gearbox_z"), tones=None):
    """One state a row of source powers; returns states and records by name."""
    made = {
        f"state {k}": record(drive, power, seconds, rng, () if tones is None else tones[k])
        for k, power in enumerate(powers)
    }
    return [state_of(name, one, references) for name, one in made.items()], made
