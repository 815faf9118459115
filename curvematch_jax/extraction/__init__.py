"""Many mesh files to parts, in worker processes, with a folder in which parts are found again."""

from ._collection import Extracted, Failure, extract_collection

__all__ = ["Extracted", "Failure", "extract_collection"]
