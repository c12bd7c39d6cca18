"""The five papers re-run: their flights, their methods, their tables beside what is found here."""

from magsim.papers.paper import Effort, Paper, PaperFlight, Task
from magsim.papers.registry import find_paper, numbers
from magsim.papers.running import PaperRun, run_paper
from magsim.papers.tables import Cell, Column, Line, PaperTable

__all__ = [
    "Cell",
    "Column",
    "Effort",
    "Line",
    "Paper",
    "PaperFlight",
    "PaperRun",
    "PaperTable",
    "Task",
    "find_paper",
    "numbers",
    "run_paper",
]
