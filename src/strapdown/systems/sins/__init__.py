"""System C: one chain over a simulation, a recorded log, or samples as they come."""
