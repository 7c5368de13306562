# SPDX-License-Identifier: Apache-2.0
"""Studies: experiments that answer a question with figures; they write no files."""

from .compare_methods import MethodStudy

__all__ = ["MethodStudy"]
