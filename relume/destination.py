"""Where the picture of a scene goes, and the pictures of its progress."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from relume import output
from relume.accumulator import Accumulator
from relume.inputs import Inputs
from relume.translator import Document
from relume.translator.plan import metropolis, mutations

DUMP_INTERVAL = 60.0
"""With a time limit the picture so far is written each minute, as the manual says [s]."""

PASSES = ".passes.exr"
"""Ending of the file of passes beside a picture."""


class Destination:
    """Where the picture of a scene goes.

    Args:
        document: the scene's document.
        out: picture file, or a folder (existing, or with a trailing slash) for the name that the
            scene gives; None for the scene's name below the working directory.
        inputs: what the scene reads, and nothing is written over.

    Attributes:
        exact: the picture file, where `out` names one; else None.
        notes: sentences for the user.
    """

    def __init__(
        self, document: Document, out: str | Path | None = None, inputs: Inputs | None = None
    ) -> None:
        self.inputs = inputs or Inputs()
        self.notes: list[str] = []
        named = str(out) if out is not None else None
        self.exact: Path | None = None
        self.folder = Path.cwd()
        if named is not None and (named.endswith(("/", "\\")) or Path(named).is_dir()):
            self.folder = Path(named)
            self.folder.mkdir(parents=True, exist_ok=True)
        elif named is not None:
            self.exact = Path(named)
        stem, self.extension = output.split_extension(document.output)
        self.stem = stem
        if self.extension.lower() not in output.WRITERS:
            self.extension = ".ppm"
            if self.exact is None:
                self.notes.append(f"'{document.output}' has no known extension: written as .ppm")

    def check(self) -> None:
        """Check that the picture can be written, before it is rendered.

        Raises:
            OutputError: it cannot, or it or its passes would go over a file that the scene reads.
        """
        if self.exact is not None:
            output.check_format(self.exact)
            self.inputs.refuse(self.exact)
        self.inputs.refuse(self.passes_path())
        probe = self.exact or output.safe_path(self.stem + self.extension, self.folder)[0]
        output.check_writable(probe)

    def part_path(self) -> Path:
        """Path of a file that takes some passes alone.

        Raises:
            OutputError: `out` names no such file.
        """
        if self.exact is None or self.exact.suffix.lower() != ".exr":
            raise output.OutputError("passes are written to a file that -o names, such as part.exr")
        return self.exact

    def passes_path(self) -> Path:
        """Path of the passes while they are rendered: `<stem>.passes.exr` beside the picture."""
        if self.exact is not None:
            return self.exact.with_name(output.split_extension(self.exact.name)[0] + PASSES)
        return output.safe_path(self.stem + PASSES, self.folder)[0]

    def write(
        self,
        document: Document,
        accumulator: Accumulator,
        seconds: float,
        spectral: bool,
        comment: str = "",
    ) -> output.Written:
        """Write the picture; one that the scene names gets a BMP beside it, as the manual says.

        Args:
            document: names the picture, and gives its gamma.
            accumulator: what was rendered.
            seconds: that it took, for the name.
            spectral: whether it was rendered by wavelength, for the name.
            comment: what its metadata say of it.

        Raises:
            OutputError: it cannot be written.
        """
        if self.exact is not None:
            return output.write_image(
                self.exact, accumulator.image(), document.gamma_offset, comment
            )
        method = metropolis(document)
        name = output.output_name(
            self.stem,
            self.extension,
            document.sampling,
            mutations(document) if method else document.supersampling,
            seconds,
            accumulator.spp,
            method=method or "",
            nes=document.next_event_estimation,
            spectrum=spectral,
            suffix=document.suffix,
        )
        path, note = output.safe_path(name, self.folder)
        self.notes += [note] if note else []
        path = self.inputs.spared(path, output.bmp_beside)
        return output.write_outputs(path, accumulator.image(), document.gamma_offset, comment)

    def dump_path(self, index: int) -> Path:
        """Path of a picture of the progress: `image/box_W000001.bmp` beside the picture `box`."""
        if self.exact is not None:
            inner, stem = "", output.split_extension(self.exact.name)[0]
            folder = self.exact.parent
        else:
            inner, _, stem = self.stem.replace("\\", "/").rpartition("/")
            folder = self.folder
        path = output.safe_path(f"{inner}/image/{stem}_W{index:06d}.bmp", folder)[0]
        return self.inputs.spared(path)


Keep = Callable[[Accumulator, float], None]
"""Offered the accumulator and the seconds of rendering after each pass, to keep something of it."""


class Dumps:
    """Writes the picture so far at the scene's interval.

    Args:
        document: gives `IMAGEDUMP` [s] and the gamma.
        destination: where pictures go.
        time_limit: seconds, or None; with a limit the interval is at most a minute.
    """

    def __init__(
        self, document: Document, destination: Destination, time_limit: float | None
    ) -> None:
        self.interval = document.image_dump or float("inf")
        if time_limit is not None:
            self.interval = min(self.interval, DUMP_INTERVAL)
        self.gamma = document.gamma_offset
        self.destination = destination
        self.next = self.interval
        self.count = 0

    def offer(self, accumulator: Accumulator, seconds: float) -> None:
        """Write the picture so far if it is time."""
        if seconds < self.next:
            return
        self.count += 1
        self.next = seconds + self.interval
        output.write_image(self.destination.dump_path(self.count), accumulator.image(), self.gamma)
