"""Reads structures of other programs into one folder that the program reads: `fretwear-import`, or `python -m fretwear.importing`.

A file per program (`gmsh`, `nastran`, `ansys`, `matlab`, `abaqus`) returns a `Structure` (`folder`), which `folder.write` stores.
Third-party readers run in a child process (`child`).
"""


class Rejected(Exception):
    """A file, or a request, that cannot be imported: a sentence that names the place, what was found and what would be right."""
