"""A pan-tilt unit of the PTU-D46 class with a laser on a USB relay: points at things."""
