"""The workbench: methods compared, speed charted against accuracy, stability where methods fail."""
