# SPDX-License-Identifier: Apache-2.0
"""Errors of Deltalux: each message says what, where, found, expected and remedy."""


class Error(Exception):
    """Base of every error that Deltalux raises on purpose."""


class SceneError(Error):
    """The scene's content cannot be used (geometry, materials, lights)."""


class OptionError(Error, ValueError):
    """An argument is out of its range, unknown, or contradicts another."""


class FormatError(Error):
    """A file is malformed, truncated, foreign, or uses an unsupported feature."""


class Cancelled(Error):
    """A progress callback or Ctrl-C stopped the call; the session stays valid."""
