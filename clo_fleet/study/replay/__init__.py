"""Looking at a run: its scene (`scene`) and its log become one page that opens from disk."""
