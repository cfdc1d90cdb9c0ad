"""Folders that a command makes, made again only where the program, the command or what it reads has changed."""

import functools
import hashlib
import pathlib
import shlex
import shutil
import subprocess
import time


@functools.cache
def digest(program):
    """Of the program's file; empty where it is looked up elsewhere."""
    path = pathlib.Path(program)
    return hashlib.sha256(path.read_bytes()).hexdigest()[:16] if path.is_file() else ""


def stamp_of(folder):
    """The file that says what a folder was made by."""
    return folder.with_name(folder.name + ".command")


def made_by(folder):
    """What a folder was made by; empty where that is not known, as of data that were not made here."""
    return stamp_of(folder).read_text() if stamp_of(folder).exists() else ""


def make(command, folder, done, sources=(), prepare=lambda folder: None):
    """Runs a command, unless the file `done` of its folder is there and came from the same program and command.

    `sources` are the folders that it reads: the folder is made again where one of them was made by something else.
    `prepare` is called with the folder, which is not there then, before the command is run.
    """
    stamp, text = stamp_of(folder), shlex.join(command)
    of_sources = hashlib.sha256("".join(made_by(source) for source in sources).encode()).hexdigest()[:16]
    by = f"{text}\n{digest(command[0])}\n{of_sources}\n"
    if (folder / done).exists() and stamp.exists() and stamp.read_text() == by:
        return False
    stamp.unlink(missing_ok=True)
    shutil.rmtree(folder, ignore_errors=True)
    prepare(folder)
    print(text, flush=True)
    begun = time.monotonic()
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    print(f"  {time.monotonic() - begun:.0f} s", flush=True)
    stamp.write_text(by)
    return True
