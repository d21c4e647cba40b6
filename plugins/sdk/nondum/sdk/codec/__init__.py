"""The one codec: typed values to plain data and back, whatever carries them."""
