"""What of a path tells a file from others."""

from collections import Counter
from collections.abc import Iterable
from pathlib import PurePath


def ends_apart(paths: Iterable[str]) -> dict[str, str]:
    """Path -> as much of its end as none of the others has: the name alone where that is enough."""
    left = {path: PurePath(path).parts for path in paths}
    out: dict[str, str] = {}
    for length in range(1, max(map(len, left.values()), default=0) + 1):
        times = Counter(parts[-length:] for parts in left.values())
        alone = [path for path, parts in left.items() if times[parts[-length:]] == 1]
        out |= {path: str(PurePath(*left.pop(path)[-length:])) for path in alone}
    return out | {path: path for path in left}
