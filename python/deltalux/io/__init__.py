# SPDX-License-Identifier: Apache-2.0
"""Readers: file to Scene, nothing else."""


def load(path, **options):
    raise NotImplementedError
