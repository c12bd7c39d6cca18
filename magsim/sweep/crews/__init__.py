"""What flies the shards of a sweep: processes of this machine, or the workers of a cluster."""

from magsim.sweep.crews.cluster import ClusterCrew, cluster_crew
from magsim.sweep.crews.crew import Crew, Died, Finished
from magsim.sweep.crews.local import LocalCrew

__all__ = ["ClusterCrew", "Crew", "Died", "Finished", "LocalCrew", "cluster_crew"]
