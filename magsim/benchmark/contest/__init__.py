"""Methods in processes of their own: each fits and estimates without ever having been near the truth, or each other.

A server is started as a new program, so it has nothing of the process that knows the truth. For each fit and for each
round of estimates it forks a process, which is sent what the method may see over a socket, answers, and is killed with
all that it has started. Nothing that a method sends is unpickled. Where the kernel has Landlock, such a process can
read no files but those of Python, of the packages and of the method itself, and write in a temporary folder alone.

What a hostile method can still do is in ``docs/ladder.md``: what it reads of Python and of magsim includes the public
seeds and the simulator, so it could fly public flights again; against that hidden seeds alone help.
"""

from magsim.benchmark.contest.contest import Contest
from magsim.benchmark.contest.outcome import Allowance, Contestant, Costs, Finish

__all__ = ["Allowance", "Contest", "Contestant", "Costs", "Finish"]
