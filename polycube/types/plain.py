"""Plain values, as in JSON and YAML."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

Json = Mapping[str, Any]  # a document: its values are of every kind
