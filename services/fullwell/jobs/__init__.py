"""Jobs and frames: states, the database, the queue, leases, and the embedded service. No module here renders or serves.

Import from the submodules: they are kept apart so that a client needs neither the database's nor the queue's libraries.
"""

__all__: list[str] = []
