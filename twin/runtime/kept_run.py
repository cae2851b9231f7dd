"""What a run leaves for comparisons: `hashes.json` in its folder."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from twin.errors import RecordingError
from twin.files.reading import absence, read_text
from twin.files.writing import write_whole
from twin.recording.hashes import HASHES, RunHashes
from twin.scenario.provenance import Provenance

_FORMAT = 1
_MOST_BYTES = 100_000_000


@dataclass(frozen=True, kw_only=True)
class KeptRun:
    """How a run was made, and short hashes of what it was."""

    provenance: Provenance
    digest: str | None
    """None: the run was not finished."""
    hashes: RunHashes

    def write(self, folder: Path) -> None:
        """Write the file of a run's folder.

        Raises:
            RecordingError: It cannot be written.
        """
        values = {
            "format": _FORMAT,
            "digest": self.digest,
            "provenance": self.provenance.to_dict(),
            **self.hashes.to_dict(),
        }
        write_whole(folder / HASHES, json.dumps(values, indent=1, ensure_ascii=False) + "\n")

    @classmethod
    def read(cls, file: Path) -> Self:
        """Read such a file.

        Raises:
            RecordingError: It is missing, or none.
        """
        try:
            values = json.loads(read_text(file, _MOST_BYTES))
            return cls(
                provenance=Provenance.from_dict(values["provenance"]),
                digest=values["digest"],
                hashes=RunHashes.from_dict(values),
            )
        except OSError as fault:
            why = absence(file) or f"cannot be read: {fault.strerror}"
            raise RecordingError(f"{file}: {why}; `twin run` writes it into the folder of a run") from None
        except (ValueError, KeyError, TypeError, RecursionError):
            raise RecordingError(f"{file}: not the hashes of a run, as `twin run` writes them") from None
