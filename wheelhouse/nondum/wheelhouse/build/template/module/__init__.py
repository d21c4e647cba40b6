"""$title, a plugin for nondum."""
