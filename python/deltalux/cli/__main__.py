# SPDX-License-Identifier: Apache-2.0
"""`python -m deltalux.cli` is the program `deltalux`; Ctrl-C is quiet once the libraries are loaded."""

from deltalux_program import main

main()
