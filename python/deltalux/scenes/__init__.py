"""Generated demonstration scenes."""
