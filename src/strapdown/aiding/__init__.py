"""What tells a navigator more than its inertial sensors: one file per aid, one table of them."""
