"""The record: event log, result, summary, story, and running a world."""
