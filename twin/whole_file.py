"""Files appear whole or not at all: written beside, then renamed."""

import os
from pathlib import Path

PART = ".part"  # how the name of a file ends that is still being written


def write_whole(path: Path, content: str | bytes) -> None:
    """Put `content` at `path`, replacing what was there in one step; OSError leaves it untouched.

    Text is written as UTF-8 with the line ends it has. The temporary file lies in the same folder,
    since a rename is only one step within a file system.
    """
    data = content.encode("utf-8") if isinstance(content, str) else content
    part = path.with_name(f".{path.name}.{os.getpid()}{PART}")
    try:
        part.write_bytes(data)
        part.replace(path)
    except BaseException:  # an interrupt too must not leave the part behind
        part.unlink(missing_ok=True)
        raise
