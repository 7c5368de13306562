# SPDX-License-Identifier: Apache-2.0
"""`python -m deltalux.cli` is the same program as `deltalux`."""

from . import main

main()
