"""Many jobs on many processes or machines: the extras ``ray`` and ``dask``, any executor of ``concurrent.futures``, or this process alone.

``map`` calls a function for each of many jobs. Scheduling is the engine's. What is added: results by content hash in a folder, so that a
repeated job is a look-up; another try after a killed worker; progress; and results that are the same bytes on every engine.
"""

from tumble.distributed.calls import JobError
from tumble.distributed.engines import Engine, Session, connect
from tumble.distributed.jobs import as_completed, grid, map
from tumble.distributed.progress import Progress
from tumble.distributed.store import Store, key

__all__ = ["Engine", "JobError", "Progress", "Session", "Store", "as_completed", "connect", "grid", "key", "map"]
