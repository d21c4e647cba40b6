"""A recording as a camera that pans with the body; a V4L2 camera where there is one."""
