"""The one mechanism behind caching, resuming, processes and provenance.

A `Step` is a name, a version and a pure function. A `Task` is a step with its
settings and inputs; its key is made of exactly these. A `Store` keeps results
under their keys. `execute` computes what the store does not hold yet, in this
process, in others, or on a `Cluster`: whatever is an `Executor`.
"""

from tdacoustic.steps.cluster import Cluster
from tdacoustic.steps.execution import Outcome, execute, result_of
from tdacoustic.steps.executor import Executor, Jobs
from tdacoustic.steps.ledger import Progress
from tdacoustic.steps.logfiles import LogFile, log_file
from tdacoustic.steps.provenance import lineage
from tdacoustic.steps.record import Record
from tdacoustic.steps.store import Store, default_store_path
from tdacoustic.steps.task import Step, Task

__all__ = [
    "Cluster",
    "Executor",
    "Jobs",
    "LogFile",
    "Outcome",
    "Progress",
    "Record",
    "Step",
    "Store",
    "Task",
    "default_store_path",
    "execute",
    "lineage",
    "log_file",
    "result_of",
]
