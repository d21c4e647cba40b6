"""The process that holds the links to other hosts, where `[peers] process` asks for one."""
