"""The study of Borrajo and Veloso 2024, run again: their domains, their strategies, their table, and ours beside it."""
