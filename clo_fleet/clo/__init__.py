"""Causal-link opportunities: the idea, free of any robot. Standard library only."""
