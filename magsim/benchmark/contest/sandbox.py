"""What the kernel keeps a method's process from, as far as it can.

Files, connections and signals by Landlock (Linux 5.13 and later), from whose documentation the numbers are
(https://docs.kernel.org/userspace-api/landlock.html); the network and shared memory by namespaces (unshare(2)).
"""

import ctypes
import os
import struct
import sys
from collections.abc import Iterable
from pathlib import Path

CREATE_RULESET, ADD_RULE, RESTRICT_SELF = 444, 445, 446
VERSION, PATH_BENEATH = 1, 1
EXECUTE, WRITE_FILE, READ_FILE, READ_DIR = 1, 2, 4, 8
TRUNCATE, IOCTL = 1 << 14, 1 << 15
FIRST, REFER = (1 << 13) - 1, 1 << 13
NET = 3
"""Binding and connecting TCP sockets."""
SCOPES = 3
"""Abstract sockets and signals beyond the process's own domain."""
NO_NEW_PRIVILEGES, DEATH_SIGNAL, DUMPABLE, SUBREAPER = 38, 1, 4, 36
NEW_IPC, NEW_USER, NEW_NETWORK = 0x08000000, 0x10000000, 0x40000000

READ = EXECUTE | READ_FILE | READ_DIR

SYSTEM = (
    "/usr",
    "/lib",
    "/lib64",
    "/bin",
    "/etc",
    "/sys/devices/system/cpu",
    "/proc/self",
    "/proc/cpuinfo",
    "/proc/meminfo",
    "/dev/urandom",
)
"""What Python and its libraries read."""


def _libc() -> ctypes.CDLL:
    return ctypes.CDLL(None, use_errno=True)


def level() -> int:
    """Return the version of Landlock that the kernel has; 0 for none."""
    if sys.platform != "linux":
        return 0
    return max(int(_libc().syscall(CREATE_RULESET, None, 0, VERSION)), 0)


def end_with_parent(signal: int) -> None:
    """Let the kernel send this process a signal when its parent ends."""
    if sys.platform == "linux":
        _libc().prctl(DEATH_SIGNAL, signal, 0, 0, 0)


def hide_memory() -> None:
    """Keep other processes of the same user from reading this one's memory; those of root still can."""
    if sys.platform == "linux":
        _libc().prctl(DUMPABLE, 0, 0, 0, 0)


def adopt_orphans() -> None:
    """Become the parent of what a child has started when that child ends."""
    if sys.platform == "linux":
        _libc().prctl(SUBREAPER, 1, 0, 0, 0)


def leave_network() -> None:
    """Leave the network and the rights of root, where the kernel lets this process, and so its children."""
    _part(NEW_USER | NEW_NETWORK)


def leave_shared_memory() -> None:
    """Leave the shared memory and the message queues that other processes know, where the kernel lets this one."""
    _part(NEW_IPC)


def _part(namespaces: int) -> None:
    if sys.platform == "linux":
        _libc().unshare(namespaces)


def confine(readable: Iterable[Path], writable: Path) -> bool:
    """Keep this process, for good, from files but those below some places; return whether the kernel can.

    Network connections are refused too, and signals to other processes, where the kernel knows how.
    """
    version = level()
    if version == 0:
        return False
    files = FIRST | (REFER if version >= 2 else 0) | (TRUNCATE if version >= 3 else 0) | (IOCTL if version >= 5 else 0)
    attribute = struct.pack("<Q", files)
    if version >= 4:
        attribute += struct.pack("<Q", NET)
    if version >= 6:
        attribute += struct.pack("<Q", SCOPES)
    libc = _libc()
    rules = int(libc.syscall(CREATE_RULESET, ctypes.create_string_buffer(attribute, len(attribute)), len(attribute), 0))
    if rules < 0:
        return False
    for place in (*map(Path, SYSTEM), *readable):
        _allow(libc, rules, place, READ)
    _allow(libc, rules, Path("/dev/null"), READ_FILE | WRITE_FILE)
    _allow(libc, rules, writable, files)
    libc.prctl(NO_NEW_PRIVILEGES, 1, 0, 0, 0)
    done = libc.syscall(RESTRICT_SELF, rules, 0) == 0
    os.close(rules)
    return bool(done)


def _allow(libc: ctypes.CDLL, rules: int, place: Path, rights: int) -> None:
    try:
        handle = os.open(place, os.O_PATH | os.O_CLOEXEC)
    except OSError:
        return
    if not place.is_dir():
        rights &= EXECUTE | WRITE_FILE | READ_FILE | TRUNCATE
    rule = struct.pack("<Qi", rights, handle)
    libc.syscall(ADD_RULE, rules, PATH_BENEATH, ctypes.create_string_buffer(rule, len(rule)), 0)
    os.close(handle)
