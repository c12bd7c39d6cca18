"""Walk through a whole HDF5 file; run as a program of its own, which may crash or hang in its caller's stead.

``python vet.py FILE`` ends with 0 where every object, attribute and value could be read within its limits of memory
and time. It imports nothing of magsim, so it starts fast.
"""

import sys
from contextlib import suppress

CPU_S = 20
MEMORY_BYTES = 8 * 1024**3
VALUE_BYTES = 1024**3
OBJECTS = 200_000


def main(path: str) -> None:
    """Touch everything in the file, each value no larger than the limits allow."""
    with suppress(ImportError, ValueError, OSError):
        import resource

        resource.setrlimit(resource.RLIMIT_CPU, (CPU_S, CPU_S))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    import h5py

    left = OBJECTS
    with h5py.File(path, "r") as file:
        groups = [file]
        while groups:
            group = groups.pop()
            touch_attributes(group)
            for name in group:
                left -= 1
                if left < 0:
                    sys.exit("too many objects")
                if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                    continue
                item = group[name]
                if isinstance(item, h5py.Group):
                    groups.append(item)
                elif isinstance(item, h5py.Dataset):
                    touch_attributes(item)
                    touch_values(item)


def touch_attributes(item: object) -> None:
    """Read every attribute."""
    for name in item.attrs:
        if item.attrs.get_id(name).get_storage_size() < VALUE_BYTES:
            item.attrs[name]


def touch_values(item: object) -> None:
    """Read the values of a data set that keeps them in this file."""
    elsewhere = item.external or item.is_virtual
    if not elsewhere and item.size is not None and item.size * item.dtype.itemsize < VALUE_BYTES:
        item[()]


if __name__ == "__main__":
    main(sys.argv[1])
