"""Packages that only studies need: an extra, imported where they are used."""

from __future__ import annotations

from typing import Any

from human_gait.exceptions import GaitError

_MISSING = "studies need more packages: pip install 'human-gait[study]', or make study"


def arrow() -> Any:
    """Return pyarrow."""
    try:
        import pyarrow as pa  # noqa: PLC0415, an extra
    except ImportError:
        raise GaitError(_MISSING) from None
    return pa


def parquet() -> Any:
    """Return pyarrow's reader and writer of Parquet."""
    arrow()
    import pyarrow.parquet as pq  # noqa: PLC0415, an extra

    return pq


def dask() -> tuple[Any, Any]:
    """Return Dask and its distributed."""
    try:
        import dask as whole  # noqa: PLC0415, an extra
        import distributed  # noqa: PLC0415, an extra
    except ImportError:
        raise GaitError(_MISSING) from None
    return whole, distributed
