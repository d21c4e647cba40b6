"""People in images: boxes by HOG on any CPU, or by a network that the operator brings."""
