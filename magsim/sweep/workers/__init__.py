"""What flies the shards of a sweep: processes of this machine, or the workers of a cluster."""

from magsim.sweep.workers.cluster import ClusterWorkers, cluster_workers
from magsim.sweep.workers.local import LocalWorkers
from magsim.sweep.workers.protocol import Died, Finished, Workers

__all__ = ["ClusterWorkers", "Died", "Finished", "LocalWorkers", "Workers", "cluster_workers"]
