"""Imports files of other programs: the command `fretwear-import`, or `python -m fretwear.importing`.

The modules `gmsh`, `nastran`, `ansys`, `matlab` and `abaqus` each read the files of one program into a `folder.Structure`. The function
`folder.write` stores the structure as a neutral folder, which `fretwear` reads. The module `surface` converts measured topographies. The
module `child` runs third-party readers in a child process.
"""


class Rejected(Exception):
    """An import is not possible. The message names the file or the option, its value and a valid value."""
