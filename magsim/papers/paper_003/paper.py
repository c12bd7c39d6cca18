"""Paper 003 as it is re-run."""

from magsim.papers.paper import Paper
from magsim.papers.paper_003.claims import headlines
from magsim.papers.paper_003.pictures import figures
from magsim.papers.paper_003.tables import tables
from magsim.papers.paper_003.work import flights, tasks, work

PAPER = Paper(
    "003",
    "LSTM-BP on interference from Tolles-Lawson coefficients",
    "J. Xie and B. Chen: Aeromagnetic nonlinear interference compensation method based on hybrid LSTM and BP neural "
    "network architecture, Computer Science and Application 2026, 16(1), 130-141 (in Chinese)",
    flights,
    tasks,
    work,
    headlines,
    tables,
    figures,
    gpu=True,
)
