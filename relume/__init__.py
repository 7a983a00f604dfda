"""Legacy scene files, lit again: an old keyword scene language rendered by Mitsuba 3."""

from relume import llvm

llvm.check_versions()
llvm.install()
