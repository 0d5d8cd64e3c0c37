"""Readers for test_import.py. Each one fails in another way of a child process."""

import os
import signal
import time


def die():
    os.kill(os.getpid(), signal.SIGSEGV)


def hang():
    time.sleep(1000)


def eat():
    return {"name": bytearray(1 << 34)}


def miss():
    raise ImportError("No module named 'meshio'")


def leave():
    os._exit(7)
