"""The key that stops the robot: only the host itself reads it."""
