"""Loaded by the workers that `--workers` starts: Ctrl-C is for the process that they work for."""

import signal

signal.signal(signal.SIGINT, signal.SIG_IGN)
