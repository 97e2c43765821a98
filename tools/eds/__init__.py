# SPDX-License-Identifier: MIT
"""EDS files (CiA 306): from the description of an object dictionary to its C tables, and a check of the description.
Run by `make build`, `make lint` and tools/dist/programs.py. Reads EDS files; only `to_c` writes.

    python -m eds.to_c FILE.eds NAME OUTDIR    OUTDIR/od_NAME.h and OUTDIR/od_NAME.c
    python -m eds.check FILE.eds...            a line for each fault

with tools/ in PYTHONPATH. `make build` calls the first for each dictionary of this tree, `make lint` the second.

| module | what it has |
| --- | --- |
| `reading` | an EDS file as an object dictionary of python canopen; refuses what the C tables cannot hold |
| `to_c` | the C tables, by the templates od.h.j2 and od.c.j2 |
| `standard` | kinds and data types that CiA 301 and CiA 402 fix |
| `check` | rules of CiA 306 about sections and keys, of CiA 301 and 402 about objects and PDOs |

python canopen reads sections, types, defaults, limits and $NODEID. It reads a file with faults as far as it can: a
default that is no number is left out, SubNumber and the lists of objects are not read. So `reading` compares what
canopen has found with what is written, and names the section of each fault.
"""
