"""Where payloads come from: sources that watch drives, and the child that reads one."""
