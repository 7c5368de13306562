# SPDX-License-Identifier: Apache-2.0
"""What was freed among what is still in use goes back to the system."""

import subprocess
import sys

PROGRAM = """
from pathlib import Path
from deltalux.memory import return_free_memory

def resident():
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmRSS")) / 1024

pieces = [bytearray(100_000) for _ in range(2000)]  # below the size from which the C library maps memory
for piece in pieces:
    piece[::4096] = b"x" * len(piece[::4096])
kept = pieces[::50]
before = resident()
del piece, pieces
freed = resident()
return_free_memory()
print(before, freed, resident())
"""


def test_free_memory_returns():
    done = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True)
    before, freed, after = (float(word) for word in done.stdout.split())
    assert before - freed < 100  # MiB: the C library keeps it,
    assert before - after > 150  # until it is told not to
