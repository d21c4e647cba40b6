"""Workers: the processes that run plugins, from launch to the end of their last child."""
