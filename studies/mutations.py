"""What an injected error is: see `error_injection`."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Mutation:
    """One error.

    Attributes:
        file: which is changed.
        says: what is wrong then.
        old: text that the file holds once.
        new: what takes its place.
        tests: those that may find it, below `tests/`, the quickest first.
        equivalent: why no picture changes, if none does.
    """

    file: str
    says: str
    old: str
    new: str
    tests: tuple
    equivalent: str = ""


def of(file, *tests):
    """A function that makes mutations of a file."""

    def mutation(says, old, new, *others, equivalent=""):
        return Mutation(file, says, old, new, others or tests, equivalent)

    return mutation
