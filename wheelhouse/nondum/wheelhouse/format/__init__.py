"""The files of a payload folder, each parsed strictly."""
