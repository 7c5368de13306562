# SPDX-License-Identifier: Apache-2.0
"""stub"""
def run() -> None:
    """stub"""
