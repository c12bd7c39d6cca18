"""Methods in processes of their own: each fits and estimates without ever having been near the truth, or near another method.

A server is started as a new program, so it has nothing of the process that knows the truth. For each piece of work it forks a process, which gets what the
method may see over a socket, answers, and ends. Nothing that a method sends is unpickled. Where the kernel has Landlock, such a process can read
no files but those of Python, of the packages and of the method itself, and can write in a temporary folder of its own alone.
"""

from magsim.benchmark.contest.contest import Contest, Costs, Entry, Limits, Outcome

__all__ = ["Contest", "Costs", "Entry", "Limits", "Outcome"]
