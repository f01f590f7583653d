"""The planner: the fleet's domain, planning tasks, and Fast Downward in processes of its own."""
