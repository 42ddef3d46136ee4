"""What worker processes are made to do in tests: a module of its own, so that they can import it."""

import os
import signal
from pathlib import Path

from tdacoustic.workflows.run_many_work import CampaignReport, Told


def told(job):
    """Tell who did it, and with how many threads a library begins."""
    return CampaignReport(Told("done", os.environ.get("OMP_NUM_THREADS", "")), os.getpid())


def heavy(job):
    return CampaignReport(Told("done"), pid=os.getpid(), rss_bytes=1 << 50)


def deadly(job):
    """Die of a campaign called ``deadly``, and once of one called ``once``."""
    mark = job.out / "died"
    if job.given == "deadly" or (job.given == "once" and not mark.exists()):
        Path(mark).touch()
        os.kill(os.getpid(), signal.SIGKILL if hasattr(signal, "SIGKILL") else signal.SIGTERM)
    return CampaignReport(Told("done"), pid=os.getpid())


def unspeakable(job):
    """Return what cannot be sent."""
    return lambda: None
