"""Which recordings patterns stand for, and what makes one of them the same as another: its content.

A pattern is a path, a glob pattern or a URL that fsspec opens (``s3://bucket/logs/*.mcap``). A folder that is a bag is one
recording; any other folder is searched for them. A storage file inside a bag's folder stands for that bag.
"""

from __future__ import annotations

import glob
import hashlib
import shutil
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..errors import InputError
from ..importers import suffixes

__all__ = ["Found", "content_hash", "find", "here", "is_remote", "is_storage", "signature"]

_STORAGE = (".mcap", ".db3", ".bag", ".bag.active", ".mcap.zstd", ".db3.zstd")
_MAGIC = ("*", "?", "[")
_CHUNK = 1 << 20  # [byte] read at once; numerical, no effect on the result
_DIGEST = 16  # [byte]: two of 10^6 recordings share a hash with a probability of 10^-27


@dataclass(frozen=True)
class Found:
    """What patterns stand for.

    Attributes:
        recordings: paths or URLs, each once, in order.
        left_out: files that a pattern matched and that are of no kind that is read.
    """

    recordings: tuple[str, ...]
    left_out: tuple[str, ...]


def is_remote(path: str) -> bool:
    """True for what only fsspec opens."""
    return "://" in path


def find(patterns: Iterable[str], mapped: bool) -> Found:
    """The recordings that patterns stand for.

    Args:
        patterns: paths, glob patterns, folders, URLs.
        mapped: a mapping says how files of other programs are read, so that they are recordings too.

    Raises:
        InputError: a pattern stands for nothing; a URL that cannot be opened.
    """
    taken: dict[str, None] = {}
    other: dict[str, None] = {}
    for pattern in patterns:
        matches = _remote_matches(pattern) if is_remote(pattern) else _local_matches(pattern)
        if not matches:
            raise InputError(pattern, "matches nothing", "check the path, and put patterns in quotes")
        any_here = False
        for match in matches:
            recordings = [match] if is_remote(match) else _below(Path(match), mapped)
            taken |= dict.fromkeys(recordings)
            any_here = any_here or bool(recordings)
            if not recordings and Path(match).is_file():
                other[match] = None
        if not any_here and not all(match in other for match in matches):
            raise InputError(pattern, "holds no recording", "give bags, or other files with --map")
    if not taken:
        raise InputError(", ".join(patterns), "holds no recording", "give bags, or other files with --map")
    return Found(tuple(sorted(taken)), tuple(sorted(other)))


def _local_matches(pattern: str) -> list[str]:
    pattern = str(Path(pattern).expanduser())
    if Path(pattern).exists():
        return [pattern]
    if not any(sign in pattern for sign in _MAGIC):
        return []
    return sorted(glob.glob(pattern, recursive=True))  # noqa: PTH207 - a Path has no glob for patterns that begin at the root


def is_storage(path: Path) -> bool:
    """True for a file of a bag, by its name."""
    return path.name.endswith(_STORAGE)


def _below(path: Path, mapped: bool) -> list[str]:
    """The recordings that a path stands for: itself, its bag, or what lies below it."""
    if path.is_file():
        if is_storage(path):
            return [str(path.parent if (path.parent / "metadata.yaml").is_file() else path)]
        return [str(path)] if mapped and path.suffix.lower() in suffixes() else []
    try:
        inside = sorted(path.iterdir())
    except OSError:
        return [str(path)]  # refused when it is read, with the reason
    files = [each for each in inside if each.is_file()]
    if any(each.name == "metadata.yaml" for each in files) or _cut_off(path, files):
        return [str(path)]
    return [each for below in inside if not below.name.startswith(".") for each in _below(below, mapped)]


def _cut_off(folder: Path, files: Sequence[Path]) -> bool:
    """True for the folder of a bag whose recorder was killed: no metadata, and files named after the folder."""
    held = [each for each in files if is_storage(each)]
    return bool(held) and all(each.name.startswith(f"{folder.name}_") for each in held)


def _file_system(url: str) -> tuple[Any, str]:
    try:
        from fsspec.core import url_to_fs
    except ImportError:
        raise InputError(url, "needs the package fsspec", "pip install 'fric[batch]'") from None
    try:
        system, path = url_to_fs(url)
    except (ValueError, ImportError) as error:
        raise InputError(url, f"cannot be opened ({error})", "check the URL, or install what it needs") from None
    return system, str(path)


def _remote_matches(pattern: str) -> list[str]:
    """Bags and files at a URL: a folder with ``metadata.yaml`` is a bag."""
    system, path = _file_system(pattern)
    try:
        matches = system.glob(path) if any(sign in path for sign in _MAGIC) else [path] if system.exists(path) else []
        found = []
        for match in matches:
            if not system.isdir(match) or system.exists(f"{match}/metadata.yaml"):
                found.append(match)
            else:
                below = sorted(each for each in system.find(match))
                bags = {each.rsplit("/", 1)[0] for each in below if each.endswith("/metadata.yaml")}
                found += sorted(bags | {e for e in below if e.endswith(_STORAGE) and e.rsplit("/", 1)[0] not in bags})
    except Exception as error:  # each store has errors of its own
        raise InputError(
            pattern, f"cannot be listed ({type(error).__name__}: {error})", "check the URL and the access"
        ) from None
    return [system.unstrip_protocol(each) for each in found]


def _files(path: Path) -> list[Path]:
    return sorted(each for each in path.iterdir() if each.is_file()) if path.is_dir() else [path]


def signature(path: str, beside: Sequence[Path] = ()) -> str:
    """Path, sizes and times of change: as long as they stay, the content need not be read again; empty when unknown.

    Args:
        path: of a recording.
        beside: further files that belong to it.
    """
    told = hashlib.blake2b(path.encode(), digest_size=_DIGEST)
    try:
        if is_remote(path):
            system, inner = _file_system(path)
            names = sorted(system.find(inner)) if system.isdir(inner) else [inner]
            for name in names:
                told.update(f"\0{name}\0{system.ukey(name)}".encode())
        else:
            for file in (*_files(Path(path)), *beside):
                state = file.stat()
                told.update(f"\0{file.name}\0{state.st_size}\0{state.st_mtime_ns}".encode())
    except Exception:  # it is not there any more, or the store gives no state: then its content decides
        return ""
    return told.hexdigest()


def content_hash(path: Path, beside: Sequence[Path] = ()) -> str:
    """Hash of the names and bytes of a recording's files; the name of the recording itself does not matter.

    Raises:
        OSError: a file cannot be read.
    """
    told = hashlib.blake2b(digest_size=_DIGEST)
    for file in (*_files(path), *beside):
        name = file.name if path.is_dir() else file.suffix.lower()
        told.update(f"{len(name)}\0{name}\0{file.stat().st_size}\0".encode())
        with file.open("rb") as stream:
            while chunk := stream.read(_CHUNK):
                told.update(chunk)
    return told.hexdigest()


@contextmanager
def here(path: str) -> Iterator[Path]:
    """The recording on this machine: where it is, or a copy for as long as it is needed.

    Raises:
        InputError: it cannot be fetched.
    """
    if not is_remote(path):
        yield Path(path)
        return
    folder = Path(tempfile.mkdtemp(prefix="fric-batch-"))
    try:
        system, inner = _file_system(path)
        target = folder / inner.rstrip("/").rsplit("/", 1)[-1]
        try:
            if system.isdir(inner):
                target.mkdir()
                for each in system.find(inner):
                    system.get_file(each, str(target / each.rsplit("/", 1)[-1]))
            else:
                system.get_file(inner, str(target))
        except Exception as error:  # each store has errors of its own
            raise InputError(path, f"cannot be fetched ({type(error).__name__}: {error})", "check the access") from None
        yield target
    finally:
        shutil.rmtree(folder, ignore_errors=True)
