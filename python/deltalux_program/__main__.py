# SPDX-License-Identifier: Apache-2.0
"""`python -m deltalux_program` is the program `deltalux`, where that is not installed."""

from . import main

main()
