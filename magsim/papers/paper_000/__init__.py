"""Paper 000, MagTCN: four networks and Tolles-Lawson on a simulated flight and on lines with electronics."""

from magsim.papers.paper import Paper
from magsim.papers.paper_000.claims import headlines
from magsim.papers.paper_000.pictures import figures
from magsim.papers.paper_000.tables import tables
from magsim.papers.paper_000.work import tasks, work
from magsim.papers.paper_000.worlds import flights

PAPER = Paper(
    "000",
    "Aeromagnetic compensation by a temporal convolutional network (MagTCN)",
    "H. Wang and B. Zuo: An Aeromagnetic Compensation Algorithm Based on a Temporal Convolutional Network, Applied "
    "Sciences 15 (2025) 3105",
    flights,
    tasks,
    work,
    headlines,
    tables,
    figures,
    gpu=True,
)
