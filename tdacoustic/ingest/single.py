"""One log without a campaign -> a recording."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields

from tdacoustic.campaign.scale import Scale
from tdacoustic.errors import FormatError, UnitError
from tdacoustic.ingest.conversion import Conversion, convert
from tdacoustic.ingest.cut import cut_raster
from tdacoustic.recording import Channel, Log, LogChannel, Recording

__all__ = ["bind_log"]

_KEYS = tuple(field.name for field in fields(Scale))


def _scales(log: Log, units: Mapping[str, Mapping[str, str]]) -> dict[str, Scale]:
    names = [channel.name for channel in log.channels]
    scales = {}
    for name, keys in units.items():
        if name not in names:
            raise UnitError(
                f"units names channel {name!r}, which {log.path.name} does not have; it has {', '.join(names)}"
            )
        for key in keys:
            if key not in _KEYS:
                raise UnitError(f"units[{name!r}] has key {key!r}; known are {', '.join(_KEYS)}")
        scales[name] = Scale(**keys)
    return scales


def _as_far_as_known(channel: LogChannel, scale: Scale | None, file: str) -> Conversion:
    if scale is not None:
        try:
            return convert(channel, scale, f"units[{channel.name!r}]")
        except UnitError as error:
            raise UnitError(f"channel {channel.name!r} ({file}): {error}") from error
    try:
        return convert(channel, Scale(), f"units[{channel.name!r}]")
    except UnitError as error:
        return Conversion("other", "1", 1.0, 0.0, "numbers as in the log", (str(error),))


def _unique_names(log: Log) -> list[str]:
    names: list[str] = []
    for channel in log.channels:
        name, k = channel.name, 1
        while name in names:
            k += 1
            name = f"{channel.name}#{k}"
        names.append(name)
    return names


def bind_log(
    log: Log, units: Mapping[str, Mapping[str, str]] | None = None, sample_rate_hz: float | None = None
) -> Recording:
    """Bind one log without a campaign.

    Parameters
    ----------
    log : Log
    units : mapping of str to mapping, optional
        By the channel's name in the log, any of ``quantity``, ``unit``, ``sensitivity``,
        ``full_scale``, as in a ``[[channel]]``.
    sample_rate_hz : float, optional
        For channels whose rate the log does not state.

    Returns
    -------
    Recording
        Every channel under its name in the log (a name that stands twice gets ``#2``),
        in SI where its scale is known. The others are ``other`` in ``1``, the numbers as
        they are, and flagged. Named after the file.

    Raises
    ------
    UnitError
        `units` names a channel or key that is not there, or is not enough.
    FormatError
        A channel has no rate and none was given, or the log has no channel.

    Examples
    --------
    ``bind_log(scan("log.wav"), {"ch1": {"full_scale": "20 Pa"}})["ch1"].si_symbol`` is ``"Pa"``.
    """
    scales = _scales(log, units or {})
    channels = []
    for column, (name, source) in enumerate(zip(_unique_names(log), log.channels, strict=True)):
        rate = source.raster.sample_rate_hz or sample_rate_hz
        if rate is None:
            raise FormatError(
                f"channel {name!r} ({log.path.name}): the log states no sampling rate; give sample_rate_hz"
            )
        conversion = _as_far_as_known(source, scales.get(source.name), log.path.name)
        cut = cut_raster(source.raster, rate, None, None)
        channels.append(
            Channel(
                name=name,
                quantity=conversion.quantity,
                si_symbol=conversion.si_symbol,
                log_index=0,
                column=column,
                sample_rate_hz=rate,
                start_sample=cut.start_sample,
                n_samples=cut.n_samples,
                start_s=cut.start_s,
                gain=conversion.gain,
                offset=conversion.offset,
                scaling=conversion.scaling,
                limits=conversion.limits(source.limits),
                flags=(*source.flags, *conversion.warnings),
            )
        )
    return Recording(log.path.name, (log,), tuple(channels))
