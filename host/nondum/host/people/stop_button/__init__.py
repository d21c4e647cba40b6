"""The key that stops the robot: read by the host itself, and by nobody else."""
