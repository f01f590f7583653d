"""The neighbours: files of other projects."""
