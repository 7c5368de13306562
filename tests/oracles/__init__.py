# SPDX-License-Identifier: Apache-2.0
"""Independent answers: closed forms and two other renderers."""
