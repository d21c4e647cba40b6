"""The world model and the execution of plans. It holds state; all else here is pure."""
