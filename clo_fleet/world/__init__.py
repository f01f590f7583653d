"""The setting: buildings and worlds, their files, and the events that a log can hold."""
