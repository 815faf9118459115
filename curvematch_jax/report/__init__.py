"""A retrieval result as one HTML file: measures, the matrix, rankings, and matched parts in 3-D."""

from ._limits import Limits
from ._report import report_page, write_report

__all__ = ["Limits", "report_page", "write_report"]
