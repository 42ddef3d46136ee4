"""Which files a run read and with what software: what its manifest needs so that a later run can leave it as it is."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from tdacoustic.campaign import Campaign, load_campaign
from tdacoustic.errors import TdacousticError
from tdacoustic.fleet import load_fleet
from tdacoustic.reporting.template import files_of_template
from tdacoustic.steps import Store
from tdacoustic.workflows.up_to_date import FOLDER, software, state_of

if TYPE_CHECKING:
    from tdacoustic.results import LogInput

__all__ = ["FilesRead", "counts_of"]

_HEAD_BYTES: Final = 4096


@dataclass
class FilesRead:
    """The files that a campaign's run reads, as they are before it begins.

    Parameters
    ----------
    campaign : Campaign
    store : Store
        Remembers the hashes of logs.
    before : dict of str to (str or None)
        By path (relative to the campaign's folder where it is below or beside it as the files write it): sha256,
        `FOLDER` of a folder, None of what is not there.
    """

    campaign: Campaign
    store: Store
    before: dict[str, str | None] = field(init=False)

    def __post_init__(self) -> None:
        self.before = self._states()

    def _states(self) -> dict[str, str | None]:
        return {self._name(path): state_of(path, self.store) for path in self._paths()}

    def _name(self, path: Path) -> str:
        """A path as the files write it: a campaign that is copied with all it reads has the same names."""
        folder = self.campaign.folder
        return path.relative_to(folder).as_posix() if path.is_relative_to(folder) else path.as_posix()

    def _paths(self) -> Iterator[Path]:
        yield from _paths_of(self.campaign)
        for other in self._others().values():
            yield other.path
            yield from _paths_of(other)

    def _others(self) -> dict[str, Campaign]:
        """Campaigns that are fitted together with this one, by what its file calls them; those that can be read."""
        found = {}
        for stated in self.campaign.calibration.with_campaigns:
            try:
                found[stated.text] = load_campaign(stated.path)
            except TdacousticError:
                continue  # the run says so, and fails
        return found

    def made_from(self, inputs: tuple[LogInput, ...]) -> dict[str, Any] | None:
        """Return the manifest's entry, or None where a later run has to assemble the result anew to know.

        That is so where a file changed while it was read, where a log is an address, and where a log that could not be
        read may consist of further files, of which nothing is known.

        Parameters
        ----------
        inputs : tuple of LogInput
            What the run says that it read.
        """
        if self._is_open_ended(inputs) or self._states() != self.before:
            return None
        files = {**self.before, **self._companions(inputs)}
        hashed = {item.sha256 for item in inputs}
        if not hashed <= set(files.values()):  # a log that changed before it was read
            return None
        return {"software": software(), "files": dict(sorted(files.items()))}

    def _companions(self, inputs: tuple[LogInput, ...]) -> dict[str, str | None]:
        """The further files of logs, which only their readers know."""
        found: dict[str, str | None] = {}
        others = self._others()
        for item in inputs:
            whose = next((text for text in others if item.written.startswith(f"{text}: ")), None)
            folder = self.campaign.folder if whose is None else others[whose].folder
            written = item.written if whose is None else item.written.removeprefix(f"{whose}: ")
            name = self._name(folder / written.replace("\\", "/"))
            if name not in self.before:
                found[name] = item.sha256
        return found

    def _is_open_ended(self, inputs: tuple[LogInput, ...]) -> bool:
        was_read = {item.sha256 for item in inputs}
        for campaign in (self.campaign, *self._others().values()):
            for run in campaign.runs:
                for log in run.logs if run.valid else ():
                    if "://" in log.text:
                        return True
                    unread = self.before.get(self._name(log.path)) not in (None, FOLDER, *was_read)
                    if unread and _may_have_companions(log.path):
                        return True
        return False


def _paths_of(campaign: Campaign) -> Iterator[Path]:
    """Every file that is known to be read before any log is opened."""
    yield campaign.path
    tables = (campaign.run_table, campaign.sensor_table)
    yield from (table.path for table in tables if table is not None)
    if campaign.template is not None:
        yield from files_of_template(campaign.template.path)
    for stated in (campaign.fleet, campaign.calibration.prior_fleet):
        if stated is not None:
            yield from _paths_of_fleet(stated.path)
    for other in campaign.calibration.with_campaigns:
        yield other.path
    for run in campaign.runs:
        if run.valid:
            yield from (log.path for log in run.logs)


def _paths_of_fleet(path: Path) -> Iterator[Path]:
    yield path
    if path.is_dir():
        yield path / "fleet.toml"
    try:
        step_path = load_fleet(path).step_path
    except TdacousticError:
        return  # missing or wrong: the file itself tells whether it is still
    if step_path is not None:
        yield step_path


def _may_have_companions(path: Path) -> bool:
    """Whether a log may consist of further files: one of ATFX, or of a format that another package adds."""
    from tdacoustic.formats.table import FORMATS, formats

    if len(formats()) > len(FORMATS):
        return True
    try:
        with path.open("rb") as stream:
            return b"atfx_file" in stream.read(_HEAD_BYTES)
    except OSError:
        return True


def counts_of(campaign: Campaign) -> Mapping[str, int]:
    """Return how many runs and conditions a campaign has, for the manifest."""
    return {"runs": len(campaign.runs), "conditions": len(campaign.conditions())}
